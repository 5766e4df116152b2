"""Reading recordings: names, units, and every way in which a file can be wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay
from tests.offline.synthetic import INERTIA_KG_M2, MODEL, Truth, swing, write


@pytest.fixture(scope="module")
def truth() -> Truth:
    return swing(duration=1.5)


def torque_of(truth: Truth) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return INERTIA_KG_M2 * MODEL.ku * truth.voltage


UNITS = {
    "ms, deg, mNm, rpm by name": (
        {"time_ms": 1e3, "position_deg": 180 / math.pi, "torque_mNm": 1e3, "velocity_rpm": 30 / math.pi},
        ColumnOptions(),
    ),
    "us, rev, Ncm, deg/s in brackets": (
        {"t [us]": 1e6, "Angle (rev)": 0.5 / math.pi, "Tau [N cm]": 100.0, "omega (deg/s)": 180 / math.pi},
        ColumnOptions(),
    ),
    "ns, counts, by option": (
        {"stamp": 1e9, "ticks": 2156 / (2 * math.pi), "drive": 1.0, "rate": 1.0},
        ColumnOptions(
            time="stamp",
            time_unit="ns",
            position="ticks",
            position_unit="counts",
            counts_per_rev=2156,
            torque="drive",
            velocity="RATE",
        ),
    ),
    "an option has the last word": (
        {"time_s": 1e3, "position_rad": 180 / math.pi, "torque": 1.0, "velocity": 1.0},
        ColumnOptions(time_unit="ms", position_unit="Degrees"),
    ),
}


@pytest.mark.parametrize("case", UNITS)
def test_units_give_the_same_recording(case: str, truth: Truth, tmp_path: Path) -> None:
    sizes, options = UNITS[case]
    columns = (truth.time, truth.position, torque_of(truth), truth.velocity)
    scaled = {name: column * size for (name, size), column in zip(sizes.items(), columns, strict=True)}
    recording = read_recording(write(tmp_path / "units.csv", scaled, "%.15g"), options)
    assert recording.input_kind == "torque"
    assert recording.velocity is not None
    got = (recording.time, recording.position, recording.input, recording.velocity)
    for expected, values in zip(columns, got, strict=True):
        assert values == pytest.approx(expected, rel=1e-9, abs=1e-9)
    result = replay(recording, ReplaySettings(inertia=INERTIA_KG_M2)).figures
    same = replay(truth.recording(velocity=truth.velocity)).figures
    assert result.velocity_error_rms_rad_s == pytest.approx(same.velocity_error_rms_rad_s, rel=1e-6)
    assert result.disturbance_rms_rad_s2 == pytest.approx(same.disturbance_rms_rad_s2, rel=1e-6)


def test_position_is_unwrapped_when_it_jumps_by_a_turn(truth: Truth, tmp_path: Path) -> None:
    moved = truth.position - np.median(truth.position)
    wrapped = np.mod(moved, 2.0 * math.pi)  # crosses 0 at every swing
    path = write(tmp_path / "wrapped.csv", {"t": truth.time, "q": wrapped, "voltage": truth.voltage})
    recording = read_recording(path)
    assert np.ptp(wrapped) > 6.0
    assert recording.position - recording.position[0] == pytest.approx(moved - moved[0], abs=1e-9)
    assert any("unwrapped" in note for note in recording.notes)


def test_semicolons_comments_blank_lines_and_byte_order_mark_are_read(truth: Truth, tmp_path: Path) -> None:
    rows = "\n".join(
        f"{t};{q};{u}" for t, q, u in zip(truth.time, truth.position, truth.voltage, strict=True)
    )
    path = tmp_path / "german.csv"
    path.write_text(f"\ufeff# time_s;position_rad;voltage_V\n\n{rows}\n\n# the end\n", encoding="utf-8")
    assert read_recording(path).time == pytest.approx(truth.time)


def test_one_input_is_taken_when_the_file_has_both(truth: Truth, tmp_path: Path) -> None:
    path = write(
        tmp_path / "both.csv",
        {"time": truth.time, "pos": truth.position, "torque": torque_of(truth), "voltage": truth.voltage},
    )
    with pytest.raises(ConfigError, match=r"--torque .* or --voltage"):
        read_recording(path)
    assert read_recording(path, ColumnOptions(prefer="voltage")).input_kind == "voltage"
    assert read_recording(path, ColumnOptions(torque="torque")).input_kind == "torque"
    with pytest.raises(ConfigError, match=r"one input"):
        read_recording(path, ColumnOptions(torque="torque", voltage="voltage"))


def line(k: int) -> str:
    return f"{0.001 * k:.3f},{0.01 * k:.4f},0.5"


GOOD = ["time,position,voltage", *(line(k) for k in range(40))]


def with_row(k: int, text: str) -> str:
    return "\n".join([*GOOD[: k + 1], text, *GOOD[k + 2 :]])


Options = ColumnOptions
ZEROS = "0,0,0\n"

BAD = {
    "an empty file": ("", Options(), ("empty",)),
    "a header alone": ("time,position,voltage\n", Options(), ("no rows of numbers",)),
    "numbers for a header": ("\n".join(GOOD[1:]), Options(), ("first line", "time_s,position_rad")),
    "few rows": ("\n".join(GOOD[:9]), Options(), ("8 rows", "Record longer")),
    "an open quote": ('time,position,voltage\n"0,0,0\n', Options(), ("no rows of numbers",)),
    "a NUL": ("time,position,voltage\n\0,0,0\n", Options(), ("bad.csv",)),
    "two equal names": ("time,position,position,voltage\n0,0,0,0\n", Options(), ("equally likely",)),
    "two similar names": (
        "time,pos_left,pos_right,voltage\n0,0,0,0\n",
        Options(),
        ("pos_left and pos_right", '--position "pos_left"'),
    ),
    "no time": ("a,position,voltage\n" + ZEROS, Options(), ("looks like time", "--time COLUMN")),
    "no position": ("time,b,voltage\n" + ZEROS, Options(), ("looks like position", "--position COLUMN")),
    "no input": ("time,position,c\n" + ZEROS, Options(), ("torque or voltage", "--torque COLUMN")),
    "a misspelt column": ("\n".join(GOOD), Options(position="positon"), ("--position", '"position"?')),
    "a wrong unit": ("\n".join(GOOD), Options(position_unit="inch"), ("--position-unit", "rad, mrad, deg")),
    "a unit of another": ("\n".join(GOOD), Options(time_unit="deg"), ("--time-unit", "s, ms, us, ns")),
    "counts of what": ("\n".join(GOOD), Options(position_unit="counts"), ("--counts-per-rev",)),
    "one column for two": ("\n".join(GOOD), Options(velocity="position"), ("used twice",)),
    "impossible numbers": (
        "\n".join([GOOD[0], *(f"{0.001 * k},1e9,0" for k in range(40))]),
        Options(),
        ("row 1", "--position-unit"),
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_recording_is_a_config_error_that_names_the_remedy(case: str, tmp_path: Path) -> None:
    text, options, expected = BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_recording(path, options)
    for part in expected:
        assert part in str(caught.value)


def test_missing_file_folder_and_binary_are_config_errors(tmp_path: Path) -> None:
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x80time")
    for path in (tmp_path / "none.csv", tmp_path, binary, Path("nul\0.csv")):
        with pytest.raises(ConfigError, match=r"Check the path|Save it as"):
            read_recording(path)


cells = st.one_of(
    st.floats(width=32).map(str),
    st.integers(-3, 60).map(str),
    st.sampled_from(["", "nan", "1e400", "-1e308", "x", '"', ";", "#", "\0", "0.5 "]),
)
headers = st.lists(
    st.sampled_from(
        ["time", "t_ms", "position", "pos_deg", "torque", "voltage_V", "velocity", "u", "", "#", "1"]
    ),
    max_size=6,
)


@given(
    header=headers,
    rows=st.lists(st.lists(cells, max_size=6), max_size=40),
    rising=st.booleans(),
    noise=st.text(max_size=60),
)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_garbage_gives_a_result_or_a_config_error(
    header: list[str], rows: list[list[str]], rising: bool, noise: str, tmp_path: Path
) -> None:
    lines = [[f"{0.02 * k}", *row] if rising else row for k, row in enumerate(rows)]
    path = tmp_path / "garbage.csv"
    text = "\n".join([",".join(["time", *header] if rising else header), *map(",".join, lines), noise])
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    try:
        figures = replay(read_recording(path), ReplaySettings(inertia=1.0, start=0.0)).figures
    except ConfigError:
        return
    assert math.isfinite(figures.velocity_error_rms_rad_s)


values = st.floats(-1e6, 1e6)


@given(
    steps=st.lists(st.one_of(st.floats(1e-9, 10.0), st.just(0.003)), min_size=25, max_size=60),
    data=st.data(),
    observer=st.sampled_from(["super_twisting", "paper"]),
)
@settings(max_examples=150, deadline=None)
def test_wild_numbers_give_a_result_or_a_config_error(
    steps: list[float], data: st.DataObject, observer: str
) -> None:
    count = len(steps)
    position, voltage = (
        np.array(data.draw(st.lists(values, min_size=count, max_size=count))) for _ in range(2)
    )
    wild = Truth(np.cumsum(steps), position, voltage, voltage)
    try:
        figures = replay(wild.recording(), ReplaySettings(observer=observer, start=0.0)).figures
    except ConfigError:
        return
    assert math.isfinite(figures.velocity_error_rms_rad_s)
    assert math.isfinite(figures.disturbance_error_rms_rad_s2)
