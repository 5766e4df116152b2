"""Position counters that wrap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, LoggedSignals, ReplaySettings, read_recording, replay
from tests.offline.logged import COUNTS_PER_REV, HEADER, T, columns, figure, motion

if TYPE_CHECKING:
    from pathlib import Path


def turning(fast: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return a motion of many turns both ways, rad; `fast` is the largest step, rad."""
    t = np.arange(3000) * T
    return np.asarray((np.sin(2.0 * t) + 0.2 * np.sin(7.0 * t)) / (3.4 * T) * fast, dtype=np.float64)


def counted(modulus: float, cpr: float, *, signed: bool, fast: float) -> list[str]:
    counts = np.round(turning(fast) * cpr / math.tau)
    wrapped = np.mod(counts + (modulus / 2 if signed else 0), modulus) - (modulus / 2 if signed else 0)
    assert np.ptp(wrapped) > 0.9 * modulus
    return ["time_s,position_counts", *(f"{k * T:.3f},{count:.0f}" for k, count in enumerate(wrapped))]


def unwrapped(cpr: float, fast: float) -> float:
    counts = np.round(turning(fast) * cpr / math.tau)
    recording = LoggedSignals(
        name="turning",
        time=np.asarray(np.arange(3000) * T, dtype=np.float64),
        position=counts * math.tau / cpr,
        input=np.zeros(3000),
        input_kind="none",
    )
    return replay(recording, ReplaySettings(counts_per_rev=cpr)).figures.velocity_error_rms_rad_s


@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize(
    ("modulus", "cpr", "fast"),
    [
        (2**8, 2000, 0.3),
        (2**12, 4096, 0.5),
        (2**16, 2000, 0.6),
        (2**16, 4096, 1.5),
        (2**16, 65536, 2.5),
        (2**24, 2**23, 0.5),
        (2**32, 2**29, 0.3),
        (2000, 2000, 0.5),  # a turn
        (2000, 2000, 2.0),
        (10000, 10000, 1.0),
    ],
)
def test_counters_that_wrap_are_continued(
    modulus: int, cpr: int, fast: float, signed: bool, tmp_path: Path
) -> None:
    path = tmp_path / "rec.csv"
    path.write_text("\n".join(counted(modulus, cpr, signed=signed, fast=fast)) + "\n")
    expected = unwrapped(cpr, fast)
    for given in (None, float(modulus)):
        options = ColumnOptions(counts_per_rev=cpr, no_input=True, modulus=given)
        result = replay(read_recording(path, options), ReplaySettings(counts_per_rev=cpr))
        assert result.figures.velocity_error_rms_rad_s == pytest.approx(expected, rel=1e-6)
        assert "The position wraps at" in " ".join(result.notes)
        assert (result.figures.rows_left_out, result.figures.restarts) == (0, 0)


@pytest.mark.parametrize(
    ("low", "turn", "unit"),
    [
        (0, 360, "deg"),
        (-180, 360, "deg"),
        (0, math.tau, "rad"),
        (-math.pi, math.tau, "rad"),
        (0, 1, "rev"),
        (-360, 720, "deg"),
    ],
)
@pytest.mark.parametrize("fast", [0.05, 1.0, 2.5])
def test_angles_that_wrap_are_continued(
    low: float, turn: float, unit: str, fast: float, tmp_path: Path
) -> None:
    angle = (
        np.round(turning(fast) * 4096 / math.tau)
        / 4096
        * (1 if unit == "rev" else math.tau if unit == "rad" else 360)
    )
    wrapped = np.mod(angle - low, turn) + low
    path = tmp_path / "rec.csv"
    path.write_text(
        "\n".join([f"time_s,angle_{unit}", *(f"{k * T:.3f},{q:.9f}" for k, q in enumerate(wrapped))])
    )
    result = replay(read_recording(path, ColumnOptions(no_input=True)), ReplaySettings(counts_per_rev=4096))
    assert result.figures.velocity_error_rms_rad_s == pytest.approx(unwrapped(4096, fast), rel=1e-4)
    assert result.figures.rows == 3000


def test_a_counter_that_is_too_fast_for_its_modulus_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "rec.csv"
    path.write_text("\n".join(counted(256, 2000, signed=False, fast=0.7)))  # 223 counts a row
    with pytest.raises(ConfigError, match=r"--modulus"):
        read_recording(path, ColumnOptions(counts_per_rev=2000, no_input=True))


def test_a_modulus_that_is_not_found_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "rec.csv"
    path.write_text("\n".join(counted(3000, 2000, signed=False, fast=0.5)))
    with pytest.raises(ConfigError, match=r"--modulus"):
        read_recording(path, ColumnOptions(counts_per_rev=2000, no_input=True))
    options = ColumnOptions(counts_per_rev=2000, no_input=True, modulus=3000.0)
    result = replay(read_recording(path, options), ReplaySettings(counts_per_rev=2000))
    assert result.figures.velocity_error_rms_rad_s == pytest.approx(unwrapped(2000, 0.5), rel=1e-6)


def test_a_position_set_anew_begins_a_stretch(tmp_path: Path) -> None:
    moved = motion().position + np.where(np.arange(len(motion().time)) > 800, 3.0, 0.0)
    path = tmp_path / "rec.csv"
    path.write_text(
        "\n".join(
            [
                HEADER,
                *(
                    f"{k * T:.3f},{q:.8f},{u}"
                    for k, (q, u) in enumerate(zip(moved, columns().u, strict=True))
                ),
            ]
        )
    )
    result = replay(read_recording(path), ReplaySettings(ku=5.4, counts_per_rev=COUNTS_PER_REV))
    assert result.figures.restarts == 1
    assert result.figures.velocity_error_rms_rad_s == pytest.approx(figure(), abs=5e-3)
    assert "The position jumps in 1 place, the first time at row 802" in " ".join(result.notes)
