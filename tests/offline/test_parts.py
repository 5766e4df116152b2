"""The parts of a replay: column names, the encoder's step, the reference, the files written."""

from __future__ import annotations

import math
import sys
import types
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import (
    ReplaySettings,
    columns,
    estimate_counts_per_rev,
    read_recording,
    replay,
    write_csv,
    write_rrd,
    zero_phase,
)
from dcmp_hil.offline.column_names import match
from dcmp_hil.offline.resolution import equivalent_counts_per_rev
from tests.offline.synthetic import swing

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.offline.units import Quantity

LSB = 2.0 * math.pi / 2156


@pytest.mark.parametrize(
    ("header", "quantity", "column", "unit"),
    [
        ("time,pos_des,pos_meas,tau", "position", "pos_meas", "rad"),
        ("time,position_reference,position", "position", "position", "rad"),
        ("t,q,qd,tau", "velocity", "qd", "rad/s"),
        ("Timestamp [ns],Angle (deg)", "time", "Timestamp [ns]", "ns"),
        ("jointPosition,jointVelocity", "velocity", "jointVelocity", "rad/s"),
        ("jointPosition,jointVelocity", "position", "jointPosition", "rad"),
        ("torqueNm,x", "torque", "torqueNm", "N m"),
        ("torque_mNm,x", "torque", "torque_mNm", "mN m"),
        ("u_V,x", "voltage", "u_V", "V"),
        ("voltage_demand_V,voltage_sent_V,voltage_applied_V", "voltage", "voltage_applied_V", "V"),
        ("time,torque_cmd", "torque", "torque_cmd", "N m"),
        ("speed_rpm", "velocity", "speed_rpm", "rpm"),
    ],
)
def test_column_is_found_by_its_name(header: str, quantity: Quantity, column: str, unit: str) -> None:
    found = match(quantity, header.split(","), None, None)
    assert found is not None
    assert (found.column, found.unit) == (column, unit)


@pytest.mark.parametrize(
    ("header", "quantity"),
    [
        ("u,x", "voltage"),
        ("bus_voltage_V", "voltage"),
        ("velocity_estimate_rad_s", "velocity"),
        ("pos_cmd", "position"),
    ],
)
def test_column_is_not_taken_when_it_is_something_else(header: str, quantity: Quantity) -> None:
    assert match(quantity, header.split(","), None, None) is None


def test_counts_are_estimated_despite_rounding_and_glitches() -> None:
    position = swing().position
    assert estimate_counts_per_rev(position) == pytest.approx(2156.0, rel=1e-9)
    assert estimate_counts_per_rev(np.round(position, 4)) == pytest.approx(2156.0, rel=0.01)
    hundredths = np.radians(np.round(np.degrees(position), 2))  # steps of 0.16 and 0.17 degrees
    assert estimate_counts_per_rev(hundredths) == pytest.approx(2156.0, rel=0.005)
    glitched = position.copy()
    glitched[700:] += 0.3 * LSB  # one step that is no count
    assert estimate_counts_per_rev(glitched) == pytest.approx(2156.0, rel=1e-3)


def test_no_counts_are_claimed_when_there_is_no_step() -> None:
    smooth = swing(counts=None).position
    assert estimate_counts_per_rev(smooth) is None
    assert estimate_counts_per_rev(np.zeros(500)) is None
    noise = np.random.default_rng(3).normal(0.0, LSB / math.sqrt(12.0), len(smooth))
    assert estimate_counts_per_rev(smooth + noise) is None
    assert equivalent_counts_per_rev(smooth + noise) == pytest.approx(2156.0, rel=0.1)


def test_reference_is_a_butterworth_run_both_ways_when_sampling_is_even() -> None:
    signal = pytest.importorskip("scipy.signal")
    truth = swing()
    begins = np.arange(len(truth.time)) == 0
    reference = zero_phase(truth.time, truth.position, truth.voltage, period=0.003, f0=0.1, begins=begins)
    smooth = signal.filtfilt(*signal.butter(3, 15.0, fs=1.0 / 0.003), truth.position)
    inner = (truth.time > 0.3) & (truth.time < 5.7)  # the ends are padded differently
    assert reference.velocity[inner] == pytest.approx(np.gradient(smooth, 0.003)[inner], abs=1e-6)


def test_reference_has_no_lag_and_the_true_disturbance_when_motion_is_smooth() -> None:
    time = np.arange(0.0, 4.0, 0.001)
    position, velocity = np.sin(3.0 * time), 3.0 * np.cos(3.0 * time)
    applied = 40.0 * np.sin(5.0 * (time - 0.0005))  # the middle of the step that ends at each row
    reference = zero_phase(time, position, applied, period=0.001, f0=0.2, begins=np.arange(len(time)) == 0)
    middle = (time > 0.3) & (time < 3.7)
    expected = -9.0 * np.sin(3.0 * time) + 0.2 * velocity - 40.0 * np.sin(5.0 * time)
    assert reference.velocity[middle] == pytest.approx(velocity[middle], abs=1e-3)
    assert reference.disturbance[middle] == pytest.approx(expected[middle], abs=0.01)


def test_reference_is_bad_nowhere_when_a_fast_recording_ends_in_motion() -> None:
    time = np.arange(0.0, 1.0, 1e-4)
    reference = zero_phase(
        time, 5.0 * time, 0.0 * time, period=1e-4, f0=0.1, begins=np.arange(len(time)) == 0
    )
    assert reference.velocity == pytest.approx(5.0, abs=0.1)  # 2.9 off at the end with scipy's own padding


def test_reference_is_missing_only_where_a_stretch_is_too_short() -> None:
    time = np.concatenate((np.arange(500) * 0.003, 3.0 + np.arange(5) * 0.003, 5.0 + np.arange(500) * 0.003))
    begins = np.append([True], np.diff(time) > 0.03)
    reference = zero_phase(time, np.sin(time), 0.0 * time, period=0.003, f0=0.1, begins=begins)
    assert np.flatnonzero(np.isnan(reference.velocity)).tolist() == list(range(500, 505))


def test_written_csv_is_a_recording_again(tmp_path: Path) -> None:
    truth = swing(duration=2.0)
    result = replay(truth.recording(velocity=truth.velocity))
    path = tmp_path / "out.csv"
    write_csv(result, path)
    header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header == list(columns(result))
    assert header[:3] == ["time_s", "position_rad", "voltage_V"]
    again = replay(read_recording(path), ReplaySettings(input_at="end", ku=5.4)).figures
    assert again.velocity_error_rms_rad_s == pytest.approx(result.figures.velocity_error_rms_rad_s, rel=1e-5)
    assert again.given_velocity_error_rms_rad_s == pytest.approx(
        result.figures.given_velocity_error_rms_rad_s, rel=1e-5
    )


def test_rrd_is_written_with_every_plot_from_time_zero(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    written: list[tuple[Path, str, np.ndarray, dict[str, dict[str, np.ndarray]]]] = []
    series = types.ModuleType("dcmp_hil.telemetry.rerun.series")

    def write_series(path: Path, *rest: Any) -> None:
        path.touch()
        written.append((path, *rest))

    monkeypatch.setattr(series, "write_series", write_series, raising=False)
    monkeypatch.setitem(sys.modules, series.__name__, series)
    truth = swing(duration=1.0)
    result = replay(truth.recording(time=truth.time + 50.0, velocity=truth.velocity))
    write_rrd(result, tmp_path / "out.rrd")
    ((path, application, time, plots),) = written
    assert (path.parent, application) == (tmp_path, "dcmp-hil replay")  # beside, and then renamed
    assert list(tmp_path.iterdir()) == [tmp_path / "out.rrd"]
    assert time == pytest.approx(truth.time, abs=1e-9)
    assert {name: list(lines) for name, lines in plots.items()} == {
        "joint/position_rad": ["measured", "estimate"],
        "joint/velocity_rad_s": ["estimate", "reference", "given"],
        "joint/disturbance_rad_s2": ["estimate", "reference"],
        "control/voltage_V": ["applied"],
    }
    assert all(len(values) == len(time) for lines in plots.values() for values in lines.values())


def test_unwritable_csv_is_a_config_error(tmp_path: Path) -> None:
    result = replay(swing(duration=1.0).recording())
    with pytest.raises(ConfigError, match=r"Choose a file you may write"):
        write_csv(result, tmp_path / "no" / "out.csv")
