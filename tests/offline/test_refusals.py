"""Recordings that are refused, since a figure would be in doubt."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay

if TYPE_CHECKING:
    from pathlib import Path


def rising(count: int = 200) -> list[str]:
    return [f"{0.01 * (k % 7):.4f},0.5" for k in range(count)]


REFUSED: dict[str, tuple[list[str], dict[str, object], str]] = {
    "nothing says when": (["position_rad,voltage_V", *rising()], {}, "--period T"),
    "a sample number, and no period": (
        ["sample,position_rad,voltage_V", *(f"{k},{row}" for k, row in enumerate(rising()))],
        {"time": "sample"},
        "--period T",
    ),
    "no input": (["time_s,position_rad", *(f"{0.002 * k:.3f},0.1" for k in range(200))], {}, "--no-input"),
    "one stamp for all": (
        ["time_s,position_rad,voltage_V", *(f"1.7e9,{row}" for row in rising())],
        {},
        "--period",
    ),
    "coarse stamps of uneven rows": (
        [
            "time_ms,position_rad,voltage_V",
            *(f"{int(0.05 * k * k) // 100 * 100},{row}" for k, row in enumerate(rising(400))),
        ],
        {},
        "--period T",
    ),
    "a period that the stamps deny": (
        ["time_s,position_rad,voltage_V", *(f"{0.002 * k:.3f},{row}" for k, row in enumerate(rising()))],
        {"period": 0.003},
        "--time none",
    ),
    "whole numbers without a unit": (
        ["time_s,angle,voltage_V", *(f"{0.002 * k:.3f},{k},0.5" for k in range(200))],
        {},
        "--position-unit counts",
    ),
    "counts of what": (
        ["time_s,position_counts,voltage_V", *(f"{0.002 * k:.3f},{k},0.5" for k in range(200))],
        {},
        "--counts-per-rev",
    ),
    "a modulus that is too small": (
        ["time_s,position_counts,voltage_V", *(f"{0.002 * k:.3f},{k},0.5" for k in range(200))],
        {"counts_per_rev": 2000, "modulus": 100.0},
        "--modulus",
    ),
    "a unit that is none": (
        ["time,angle,voltage", "s,inch,V", *(f"{0.002 * k:.3f},{row}" for k, row in enumerate(rising()))],
        {},
        "--position-unit",
    ),
    "stamps of a second": (
        ["time,angle_rad,voltage_V", *(f"10:11:{k // 100:02d},{row}" for k, row in enumerate(rising(800)))],
        {},
        "--period T",
    ),
    "a position of words": (
        ["time_s,position_rad,voltage_V", *(f"{0.002 * k:.3f},off,0.5" for k in range(200))],
        {},
        "no finite number",
    ),
    "volts for an angle": (
        ["time,position,voltage", "s,V,V", *(f"{0.002 * k:.3f},0.1,0.5" for k in range(200))],
        {},
        "--position-unit",
    ),
    "time that jumps at random": (
        [
            "time_s,position_rad,voltage_V",
            *(f"{k * 7919 % 200 * 0.002:.3f},{row}" for k, row in enumerate(rising())),
        ],
        {},
        "--period",
    ),
    "no input and one": (
        ["time_s,position_rad,voltage_V", *(f"{0.002 * k:.3f},{row}" for k, row in enumerate(rising()))],
        {"no_input": True, "voltage": "voltage_V"},
        "--no-input",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_in_doubt_is_refused_and_the_remedy_does_no_harm(name: str, tmp_path: Path) -> None:
    lines, options, remedy = REFUSED[name]
    path = tmp_path / "rec.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ConfigError) as caught:
        replay(read_recording(path, ColumnOptions(**options)), ReplaySettings(ku=5.4))  # type: ignore[arg-type]
    assert remedy in str(caught.value)
    for harm in ("Sort", "sort the rows", "remove", "Mend"):
        assert harm not in str(caught.value)


@pytest.mark.parametrize(
    "start",
    [b"PK\x03\x04", b"\x89HDF\r\n", b"MATLAB 5.0 MAT-file", b"\x1f\x8b", b"PAR1", bytes(range(32)) * 20],
)
def test_other_kinds_of_file_are_named(start: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rec.csv"
    path.write_bytes(start + bytes(200))
    with pytest.raises(ConfigError, match=r"Save it as"):
        read_recording(path)
