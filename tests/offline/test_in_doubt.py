"""Recordings that gave a wrong figure without a word: now the right one, or a refusal with its remedy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay
from dcmp_hil.offline.column_names import match
from tests.offline.logged import COUNTS_PER_REV, DEG_PER_RAD, HEADER, TOLERANCE_RAD_S, columns, figure, motion

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.offline.recording import LoggedSignals
    from dcmp_hil.offline.units import Quantity


UNITS: dict[Quantity, str] = {"time": "ms", "position": "deg", "voltage": "mV", "torque": "mN m"}


def read(tmp_path: Path, content: str | bytes, **options: object) -> LoggedSignals:
    path = tmp_path / "rec.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(path, ColumnOptions(**options))  # type: ignore[arg-type]


def rms(recording: LoggedSignals) -> float:
    settings = ReplaySettings(ku=5.4, counts_per_rev=COUNTS_PER_REV)
    return replay(recording, settings).figures.velocity_error_rms_rad_s


def degrees(head: str) -> str:
    rows = columns(q=lambda q: f"{DEG_PER_RAD * q:.8f}").lines(";", comma=True)
    return "\n".join([head, *rows]) + "\n"


@pytest.mark.parametrize("encoding", ["mac_roman", "cp850", "cp437", "cp1252", "utf-8", "utf-16"])
def test_a_degree_sign_in_any_encoding_is_one(encoding: str, tmp_path: Path) -> None:
    recording = read(tmp_path, degrees("Zeit [s];Winkel [°];Spannung [V]").encode(encoding))
    assert rms(recording) == pytest.approx(figure(), abs=TOLERANCE_RAD_S)


@pytest.mark.parametrize("name", ["Winkel [º]", "Winkel/°", "Winkel [\ufffd]", "Winkel (°, meas)"])
def test_a_sign_like_a_degree_is_one(name: str, tmp_path: Path) -> None:
    recording = read(tmp_path, degrees(f"Zeit [s];{name};Spannung [V]"))
    assert rms(recording) == pytest.approx(figure(), abs=TOLERANCE_RAD_S)


@pytest.mark.parametrize(
    ("quantity", "name", "told"),
    [
        ("position", "Position (mm)", "mm"),
        ("position", "Winkel [?]", "?"),
        ("position", "position [pi rad]", "pi rad"),
        ("position", "phi/pct", "pct"),
        ("time", "time [0.1 ms]", "0.1 ms"),
        ("time", "Time (ticks)", "ticks"),
        ("voltage", "voltage_%", "%"),
        ("voltage", "Voltage (A)", "A"),
        ("torque", "torque [% rated]", "% rated"),
    ],
)
def test_a_unit_that_is_unknown_is_not_taken_as_si(quantity: Quantity, name: str, told: str) -> None:
    with pytest.raises(ConfigError, match=f"--{quantity}-unit") as caught:
        match(quantity, [name], None, None)
    assert f'"{told}"' in str(caught.value)
    known = match(quantity, [name], name, UNITS[quantity])
    assert known is not None
    assert known.source == "option"


@pytest.mark.parametrize(
    ("quantity", "name", "unit"),
    [
        ("time", "Time (UTC)", "s"),
        ("time", "Zeit [hh:mm:ss]", "s"),
        ("time", "Date/Time", "s"),
        ("time", "Time (ms since boot)", "ms"),
        ("time", "time [h]", "h"),
        ("time", "Zeitstempel", "s"),
        ("position", "/joint_states/position[0]", "rad"),
        ("position", "Position (joint 1)", "rad"),
        ("position", "theta(t)", "rad"),
        ("position", "angle (deg, unwrapped)", "deg"),
        ("position", "Angle [gon]", "gon"),
        ("position", "position_mdeg", "mdeg"),
        ("velocity", "omega [ø/s]", "deg/s"),
        ("torque", "Torque (N·m)", "N m"),
        ("voltage", "U [kV]", "kV"),
    ],
)
def test_what_brackets_say_is_a_unit_or_describes(quantity: Quantity, name: str, unit: str) -> None:
    found = match(quantity, [name], name, None)
    assert found is not None
    assert found.unit == unit


def test_per_cent_in_the_header_of_a_file_are_no_volts(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--voltage-unit"):
        read(tmp_path, "\n".join(["time_s,position_rad,voltage_%", *columns().lines()]) + "\n")


def test_degrees_without_a_unit_are_asked_for(tmp_path: Path) -> None:
    content = "\n".join(["time,angle,voltage", *columns(q=lambda q: f"{DEG_PER_RAD * q:.5f}").lines()]) + "\n"
    with pytest.raises(ConfigError, match="--position-unit deg"):
        rms(read(tmp_path, content))
    recording = read(tmp_path, content, position_unit="deg")
    assert rms(recording) == pytest.approx(figure(), abs=TOLERANCE_RAD_S)


def test_radians_without_a_unit_are_not_asked_for(tmp_path: Path) -> None:
    recording = read(tmp_path, "\n".join(["time,angle,voltage", *columns().lines()]) + "\n")
    assert rms(recording) == pytest.approx(figure(), abs=TOLERANCE_RAD_S)


def torn(position: list[str], cut: int) -> str:
    rows = [f"{t},{u},{q}" for t, q, u in zip(columns().t, position, columns().u, strict=False)]
    return "\n".join(["time_s,voltage_V,position", *rows])[:-cut]


def test_a_last_whole_number_that_breaks_off_is_left_out(tmp_path: Path) -> None:
    counts = [str(round(q * COUNTS_PER_REV / math.tau) + 5000) for q in motion().position]
    options = {"position_unit": "counts", "counts_per_rev": COUNTS_PER_REV}
    recording = read(tmp_path, torn(counts, 3), **options)
    assert len(recording.time) == len(counts) - 1
    assert "The last line is unfinished and left out." in recording.notes
    whole = read(tmp_path, torn(counts[:-1], 1) + counts[-2][-1] + "\n", **options)
    assert rms(recording) == pytest.approx(rms(whole), abs=1e-9)


def test_a_last_number_of_no_fixed_length_that_breaks_off_is_left_out(tmp_path: Path) -> None:
    numbers = [repr(round(float(q), 7)) for q in motion().position]
    recording = read(tmp_path, torn(numbers, len(numbers[-1].partition(".")[2]) - 1))
    assert len(recording.time) == len(numbers) - 1
    whole = read(tmp_path, torn(numbers[:-1], 1) + numbers[-2][-1] + "\n")
    assert rms(recording) == pytest.approx(rms(whole), abs=1e-9)


def test_a_last_line_that_is_whole_is_kept_without_its_end(tmp_path: Path) -> None:
    counts = [str(round(q * COUNTS_PER_REV / math.tau) + 5000) for q in motion().position]
    recording = read(
        tmp_path,
        torn([*counts[:-1], counts[-1] + "#"], 1),
        position_unit="counts",
        counts_per_rev=COUNTS_PER_REV,
    )
    assert len(recording.time) == len(counts)


def test_a_voltage_that_lost_its_point_is_left_out(tmp_path: Path) -> None:
    rows = columns().lines()
    largest = int(np.argmax(np.abs(motion().voltage)))
    start, _, volts = rows[largest].rpartition(",")
    rows[largest] = f"{start},{volts.replace('.', '')}"
    recording = read(tmp_path, "\n".join([HEADER, *rows]) + "\n")
    assert recording.left_out == 1
    assert any("far beyond all the others" in note for note in recording.notes)
    assert rms(recording) == pytest.approx(figure(), abs=0.01 * figure())


def test_names_above_those_of_the_sensors_are_found(tmp_path: Path) -> None:
    lines = ["time,position,voltage", "clocked by,AMT102,VNH5019", "ms,deg,mV"]
    rows = columns(
        t=lambda t: f"{1e3 * t:.3f}", q=lambda q: f"{DEG_PER_RAD * q:.8f}", u=lambda u: f"{1e3 * u:.3f}"
    )
    recording = read(tmp_path, "\n".join([*lines, *rows.lines()]) + "\n")
    assert rms(recording) == pytest.approx(figure(), abs=TOLERANCE_RAD_S)


def test_stamps_in_whole_ms_of_a_period_near_3_ms_are_an_even_grid(tmp_path: Path) -> None:
    rows = [
        f"{int(1e3 * k / 333.0)},{q},{u}"
        for k, (q, u) in enumerate(zip(columns().q, columns().u, strict=True))
    ]
    recording = read(tmp_path, "\n".join(["time_ms,position_rad,voltage_V", *rows]) + "\n")
    assert np.ptp(np.diff(recording.time)) < 1e-9
    assert np.median(np.diff(recording.time)) == pytest.approx(1.0 / 333.0, rel=1e-4)
