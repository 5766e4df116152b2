"""Reading a rig: names, files, overrides."""

import copy
import math
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dcmp_hil.config import Rig, copy_rig, load_rig, shipped_rigs
from dcmp_hil.errors import ConfigError

FOLDER = Path(__file__).parents[2] / "dcmp_hil/rigs"


def fault(source: str, *overrides: str) -> str:
    """Load a rig that must be refused; return the error message."""
    with pytest.raises(ConfigError) as caught:
        load_rig(source, overrides)
    assert caught.value.exit_code == 2
    for jargon in ("Input should", "type=", "pydantic", "https://", "NoneType", "validation error"):
        assert jargon not in str(caught.value)
    return str(caught.value)


def file(folder: Path, text: str, name: str = "mine.toml") -> str:
    path = folder / name
    path.write_text(text)
    return str(path)


def test_shipped_rigs_load() -> None:
    assert shipped_rigs() == ["bench-1khz", "bench-can", "bench-serial", "paper"]
    assert [load_rig(name).name for name in shipped_rigs()] == shipped_rigs()


def test_defaults_are_the_bench() -> None:
    bench, nothing = load_rig("bench-1khz"), Rig(name="bench-1khz")
    assert bench.model_dump() == nothing.model_dump()


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("loop.rate_hz=fast", ['--set loop.rate_hz: got "fast"', "at least 10 and at most 20000", "Hz"]),
        ("loop.rate_hz=0.001", ["got 0.001", "at least 10"]),
        ("loop.rate_hz=nan", ["got nan", "a number"]),
        ("loop.rate_hz=inf", ["got inf", "a number"]),
        ("loop.rate_hz=true", ["got true", "a number"]),
        ("loop.rate_hz=[1]", ["got a list", "a number"]),
        ("loop.rate_hz={a=1}", ["got a table", "a number"]),
        ("loop.rat_hz=500", ["loop.rat_hz: unknown key", "Did you mean rate_hz?"]),
        ("loop.period_us=500", ["rate_hz = 2000"]),
        ("loop.rate_khz=1", ["rate_hz = 1000"]),
        ("loop.delay_samples=2", ["expected 0 or 1"]),
        ("loop=3", ["--set loop: got 3", "a table"]),
        ("lop.rate_hz=500", ["lop: unknown key", "Did you mean loop?"]),
        ("kp_1_s2=5", ["It belongs in [controller]"]),
        ("amplifier.voltage_limit_mV=5000", ["It is given in V: voltage_limit_V = 5"]),
        ("amplifier.voltage_limit=5", ["It is given in V: voltage_limit_V"]),
        ('amplifier.voltage_limit_V="10 V"', ['got "10 V"', "voltage_limit_V = 10, without quotes or unit"]),
        ('sim.step_us="200us"', ["step_us = 200, without quotes or unit"]),
        ("sim.step_us=0.0002", ["at least 1", "us"]),
        ("sim.step_us=300", ["does not divide the period of 1000 us", "250 us would"]),
        ("sim.step_us=2000", ["does not divide", "1000 us would"]),
        ("sim.plant.ku=5", ["sim.plant.ku: unknown key", "ku_rad_s2_V"]),
        ("observer.kind=supertwist", ["--set observer.kind", 'mean "super_twisting"?', "module:Class"]),
        ("observer.kind=3", ["got 3"]),
        ("observer.mu0_rad_s=500", ["at most 300 rad/s", "Leave the key out"]),
        ("reference.kind=sinus", ['Did you mean "sine"?']),
        ("reference.kind=csv", ["reference.file: missing"]),
        ("controller.options={a=1}", ["controller.options: unknown key"]),
        ("backend.kind=canbus", ['backend.kind: got "canbus"', 'mean "can"?']),
        ("backend.kind=serial", ["backend.port: missing"]),
        ("name=", ["name"]),
        ("foo", ["--set foo: expected KEY=VALUE"]),
        ("=3", ["expected KEY=VALUE"]),
        ("loop.rate_hz.x=5", ["loop.rate_hz is a value, not a table"]),
    ],
)  # fmt: skip
def test_load_names_key_and_remedy_when_value_is_bad(override: str, words: list[str]) -> None:
    text = fault("bench-1khz", override)
    for word in words:
        assert word in text


def test_load_names_every_fault_at_once_when_there_are_several(tmp_path: Path) -> None:
    path = file(tmp_path, '[loop]\nrate_hz = "1 kHz"\ndelay = 1\n[encoder]\ncounts = 4096\n[nonsense]\n')
    lines = fault(path).splitlines()
    assert len(lines) == 4
    for key in ("loop.rate_hz", "loop.delay", "encoder.counts", "nonsense"):
        assert any(key in line for line in lines)
    assert all(line.startswith(path) for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [("[loop\n", "line 1"), ("a = \n", "line 1"), ("\x00", "not TOML"), ("x = 1\nx = 2\n", "line 2")],
)
def test_load_names_line_when_file_is_no_toml(tmp_path: Path, text: str, words: str) -> None:
    assert words in fault(file(tmp_path, text))


def test_load_names_file_when_it_cannot_be_read(tmp_path: Path) -> None:
    assert "No such file" in fault(str(tmp_path / "nope.toml"))
    (tmp_path / "folder.toml").mkdir()
    assert "folder.toml" in fault(str(tmp_path / "folder.toml"))
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe4"')
    assert "UTF-8" in fault(str(tmp_path / "latin.toml"))
    (tmp_path / "big.toml").write_text("# " + "x" * (1 << 20))
    assert "128 KiB" in fault(str(tmp_path / "big.toml"))


def test_load_suggests_name_when_rig_is_unknown() -> None:
    assert 'Did you mean "bench-1khz"?' in fault("bench-1kHz")


def test_plant_is_model_where_sim_plant_says_nothing() -> None:
    rig = load_rig("bench-1khz", ["model.gravity_rad_s2=20", "sim.plant.f1_rad_s2=0"])
    assert rig.plant.gravity == 20.0
    assert rig.plant.f1 == 0.0


@pytest.mark.parametrize(
    ("rate", "steps"), [(1000, 5), (500, 10), (10_000, 1), (5000, 1), (4999, 2), (300, 17), (20_000, 1)]
)
def test_plant_step_is_largest_divisor_up_to_200_us_when_auto(rate: float, steps: int) -> None:
    rig = load_rig("bench-1khz", [f"loop.rate_hz={rate}"])
    assert rig.plant_steps == steps
    assert rig.period / steps <= 200e-6 * (1 + 1e-9)


def test_name_is_file_stem_when_file_has_none(tmp_path: Path) -> None:
    assert load_rig(file(tmp_path, "", "my rig.toml")).name == "my-rig"


def test_reference_file_is_read_from_folder_of_rig(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("time_s,position_rad\n0,0\n1,0.5\n2,0\n")
    rig = load_rig(file(tmp_path, '[reference]\nkind = "csv"\nfile = "way.csv"\n'))
    assert math.isclose(rig.reference.at(1.0).position, 0.5)
    (tmp_path / "way.csv").write_text("time_s,position_rad\n0,0\n1,nan\n")
    assert "row 2" in fault(str(tmp_path / "mine.toml"))
    assert "nope.csv" in fault("bench-1khz", "reference.kind=csv", "reference.file=nope.csv")


def test_copy_writes_a_rig_that_loads_and_its_schema(tmp_path: Path) -> None:
    written = copy_rig("bench-1khz", tmp_path / "mine.toml")
    assert [path.name for path in written] == ["mine.toml", "rig.schema.json"]
    assert load_rig(tmp_path / "mine.toml").model_dump() == load_rig("bench-1khz").model_dump()
    for target in (tmp_path / "mine.toml", tmp_path / "no/such/place.toml"):
        with pytest.raises(ConfigError, match=target.name):
            copy_rig("bench-1khz", target)


def test_copy_refuses_when_target_is_no_place_for_a_rig(tmp_path: Path) -> None:
    for target, words in (
        (tmp_path / "mine", "Call it mine.toml"),
        (tmp_path / "no/such/mine.toml", f"there is no folder {tmp_path / 'no/such'}"),
        (Path("/proc/mine.toml"), "mine.toml"),
        (tmp_path / "a\0b.toml", "embedded null byte"),
    ):
        with pytest.raises(ConfigError) as caught:
            copy_rig("bench-1khz", target)
        assert words in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_copy_leaves_what_is_there_when_file_exists(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("precious")
    (tmp_path / "rig.schema.json").write_text("mine too")
    with pytest.raises(ConfigError, match="exists already"):
        copy_rig("bench-1khz", tmp_path / "mine.toml")
    assert (tmp_path / "mine.toml").read_text() == "precious"
    assert copy_rig("paper", tmp_path / "other.toml") == [tmp_path / "other.toml"]
    assert (tmp_path / "rig.schema.json").read_text() == "mine too"


def test_name_starts_with_letter_when_file_stem_does_not(tmp_path: Path) -> None:
    names = [load_rig(file(tmp_path, "", stem)).name for stem in ("...toml", "--.toml", ".-a b.toml")]
    assert names == ["rig", "rig", "a-b"]


def test_load_names_path_when_it_holds_a_null_byte() -> None:
    assert fault("a\0b.toml").startswith("a\\u0000b.toml: embedded null byte")


def test_load_names_line_when_file_is_no_utf8(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes(b'# one\n# two\nname = "\xe4"\n')
    assert "latin.toml, line 3: not UTF-8" in fault(str(tmp_path / "latin.toml"))


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0,0\n", "at least two rows"),
        ("0,0\n1,x\n", "row 2"),
        ("1,0\n0,0\n", "time must rise"),
        ("0,1e308\n1e-300,-1e308\n1,0\n", "no smooth curve"),
    ],
)
def test_load_names_key_and_file_when_reference_file_is_bad(tmp_path: Path, rows: str, words: str) -> None:
    (tmp_path / "way.csv").write_text(f"time_s,position_rad\n{rows}")
    path = file(tmp_path, '[reference]\nkind = "csv"\nfile = "way.csv"\n')
    text = fault(path)
    assert text.startswith(f"{path}, reference.file: {tmp_path / 'way.csv'}")
    assert words in text
    given = fault("bench-1khz", "reference.kind=csv", f"reference.file={tmp_path / 'way.csv'}")
    assert given.startswith("--set reference.file: ")


def test_load_names_remedy_when_scipy_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.interpolate", None)
    (tmp_path / "way.csv").write_text("time_s,position_rad\n0,0\n1,1\n")
    assert "pip install" in fault(file(tmp_path, '[reference]\nkind = "csv"\nfile = "way.csv"\n'))


BASES = [tomllib.loads((FOLDER / f"{name}.toml").read_text()) for name in ("bench-1khz", "paper")]
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from(["ideal", "none", "10 V", "sine", "a:B", 1e300, -1, 0]),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(st.text(max_size=6), st.integers(), max_size=2),
)


@st.composite
def mutated(draw: st.DrawFn) -> tuple[dict[str, Any], set[str]]:
    """A shipped rig with one to three things done to it; and the keys and tables that were touched."""
    table: dict[str, Any] = copy.deepcopy(draw(st.sampled_from(BASES)))
    touched: set[str] = set()
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(table)))
        home = table[name] if isinstance(table[name], dict) and draw(st.booleans()) else table
        key = draw(
            st.one_of(
                st.sampled_from(sorted(home)) if home else st.just("x"), st.text(min_size=1, max_size=8)
            )
        )
        action = draw(st.sampled_from(["set", "rename", "drop"]))
        value = home.pop(key, None) if action != "set" else draw(VALUES)
        if action == "rename":
            key = draw(st.sampled_from([key + "s", key[:-1] or "k", key.upper(), key + "_mV", key + "_ms"]))
        if action != "drop":
            home[key] = value
        touched |= {key, name}
    return table, touched


@settings(max_examples=2000, deadline=None, suppress_health_check=list(HealthCheck))
@given(mutated())
def test_load_gives_rig_or_config_error_for_any_table(case: tuple[dict[str, Any], set[str]]) -> None:
    from pydantic import ValidationError

    from dcmp_hil.config.formatting import dotted
    from dcmp_hil.config.validation_errors import explain_faults

    table, touched = case
    try:
        Rig.model_validate(table)
    except ValidationError as error:
        faults = explain_faults(error, table, "rig.toml", ())
        assert faults
        for sentence in faults:
            assert sentence.startswith("rig.toml")
            assert "Input should" not in sentence
            assert any(dotted([name]) in sentence for name in touched), (sentence, touched)
