"""What a reader is told: place, key, what was got, what was expected, and what was perhaps meant."""

from pathlib import Path

import pytest

from dcmp_hil.config import load_rig
from dcmp_hil.errors import ConfigError


def faults(source: str | Path, *overrides: str) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as caught:
        load_rig(source, overrides)
    return caught.value.faults


def rig_file(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("amplifier.voltage_limit_mV=10000", "It is given in V: voltage_limit_V = 10."),
        ("amplifier.voltage_limit_mv=10000", "It is given in V: voltage_limit_V = 10."),
        ("amplifier.voltage_limit_v=10", "It is given in V: voltage_limit_V = 10."),
        ("reference.amplitude_deg=180", "amplitude_rad = 3.14159265."),
        ("reference.amplitude_mrad=500", "amplitude_rad = 0.5."),
        ("reference.rate_rpm=60", "It is given in rad/s: rate_rad_s = 6.28318531."),
        ("reference.rate_hz=1", "It is given in rad/s: rate_rad_s = 6.28318531."),
        ("run.duration_ms=5000", "duration_s = 5."),
        ("sim.step_s=0.0002", "step_us = 200."),
        ("sim.step_ms=0.2", "step_us = 200."),
        ("loop.rate_khz=2.5", "rate_hz = 2500."),
        ("loop.period_ms=0.5", "The rate is given instead: rate_hz = 2000."),
        ("loop.dt_s=0.001", "rate_hz = 1000."),
        ("loop.period_us=0", "The rate is given instead: rate_hz."),
        ("loop.period_us=1e-320", "The rate is given instead: rate_hz."),
        pytest.param("loop.period_us=" + "9" * 400, "The rate is given instead: rate_hz.", id="beyond float"),
        ("model.ku=5.4", "It is given in (rad/s2)/V: ku_rad_s2_V."),
        ("observer.L1=4.9", "It is given in 1/s: L1_1_s."),
    ],
)
def test_message_converts_when_unit_is_another(override: str, words: str) -> None:
    (fault,) = faults("bench-1khz", override)
    assert fault.startswith(f"--set {override.partition('=')[0]}: unknown key. ")
    assert fault.endswith(words)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("reference.from_hz=1", 'It belongs to kind = "chirp".'),
        ("observer.start=zero", 'It belongs to kind = "paper".'),
        ("observer.options={}", 'It belongs to kind = "module:Class".'),
        ("sim.rate_hz=500", "It belongs in [loop]."),
        ("sim.plant.rate_hz=500", "It belongs in [loop]."),
        ("rate_hz=500", "It belongs in [loop]."),
        ("run.start=engage", "It belongs in [observer] or [supervisor]."),
        ("loop.name=x", "It belongs above the first [table]."),
        ("lop={}", "Did you mean loop?"),
        ("loop.delay_sampels=1", "Did you mean delay_samples?"),
        ("loop.quux=1", "Known here: rate_hz, delay_samples."),
    ],
)
def test_message_names_home_or_neighbour_when_key_is_unknown(override: str, words: str) -> None:
    (fault,) = faults("bench-1khz", override)
    assert fault.endswith(words)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ('sim.step_us="200us"', "Write step_us = 200, without quotes or unit."),
        ('sim.step_us="0.2 ms"', "Write step_us = 200, without quotes or unit."),
        ('loop.rate_hz="1 kHz"', "Write rate_hz = 1000, without quotes or unit."),
        ('amplifier.voltage_limit_V="5000 mV"', "Write voltage_limit_V = 5, without quotes or unit."),
        ('amplifier.voltage_limit_V="1,5"', "Write voltage_limit_V = 1.5, without quotes or unit."),
        ('amplifier.voltage_limit_V="1,500"', "Write a number in V, without quotes or unit."),
        ('amplifier.voltage_limit_V="10 A"', "Write a number in V, without quotes or unit."),
        ('reference.rate_rad_s="30 deg/s"', "Write rate_rad_s = 0.523598776, without quotes or unit."),
        ('amplifier.sign="-1"', "Did you mean -1?"),
        ('encoder.sign="none"', "expected 1 or -1."),
        ('loop.delay_samples="one"', "expected 0 or 1."),
        ('sim.step_us="autoo"', 'Did you mean "auto"?'),
        ('controller.position="measurd"', 'Did you mean "measured"?'),
        ('backend.kind="simm"', 'Did you mean "sim"?'),
    ],
)
def test_message_shows_how_to_write_it_when_value_is_text(override: str, words: str) -> None:
    (fault,) = faults("bench-1khz", override)
    assert words in fault


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("loop.rate_hz=20000.0001", "got 20000.0001; expected a number, at least 10 and at most 20000."),
        ("encoder.counts_per_rev=4", 'at least 16 and at most 16777216 or "ideal".'),
        ("loop.delay_samples=true", "got true; expected 0 or 1."),
        ("loop.delay_samples=1.0", "expected 0 or 1."),
        ('observer.kind="a:"', 'expected text such as "my_lab.rig:Mine".'),
        ('name=".."', 'expected text such as "my-rig".'),
        ("loop=3", "expected a table with keys such as loop.rate_hz."),
        ("reference=[]", "got a list; expected a table with keys such as reference."),
        ("encoder.counts_per_rev={float=1}", "--set encoder.counts_per_rev: got a table; expected a number"),
        ("model.eta_rad_s2=1e6", "at least -1000 and at most 1000. External disturbance"),
        ("amplifier.slew_V_s=0.45", "at least 1 and at most 1000000000"),
        ("controller.kp_1_s2=1e300", "got 1e+300; expected a number in 1/s2, at most 1000000000."),
        ("observer.L1_1_s=1e300", "expected a number in 1/s, at least 1e-06 and at most 100000."),
        ("reference.amplitude_rad=1e300", "expected a number in rad, at most 10000."),
        ("reference.offset_rad=-1e300", "expected a number in rad, at least -10000."),
        ("observer.mu0_rad_s=1e300", "expected a number in rad/s, at most 10000."),
    ],
)
def test_message_shows_bounds_and_unit_when_value_is_out_of_reason(override: str, words: str) -> None:
    (fault,) = faults("bench-1khz", override)
    assert words in fault


@pytest.mark.parametrize("key", ["loop.\x1b[31m", "loop.a\nb", "\u202eloop.x", "loop." + "y" * 500])
def test_message_is_one_short_printable_line_when_key_is_not(key: str) -> None:
    (fault,) = faults("bench-1khz", f"{key}=1")
    assert fault.isprintable()
    assert len(fault) < 250


def test_message_names_place_of_each_fault_when_file_and_override_are_wrong(tmp_path: Path) -> None:
    path = rig_file(tmp_path, "[loop]\nrat_hz = 500\n[extra]\na = 1\n")
    got = faults(path, "encoder.counts=1", "fresh.x.y=1", "sim={sed=1}", "reference.kind=csv")
    places = {fault.partition(": ")[0] for fault in got}
    assert places == {
        f"{path}, loop.rat_hz",
        f"{path}, extra",
        "--set encoder.counts",
        "--set fresh",
        "--set sim.sed",
        "--set reference.file",
    }


def test_message_names_place_of_each_rule_when_file_and_override_break_one(tmp_path: Path) -> None:
    path = rig_file(tmp_path, "[sim]\nstep_us = 300\n")
    first, second = faults(path, "observer.mu0_rad_s=500")
    assert first.startswith(f"{path}, sim.step_us: got 300 us")
    assert second.startswith("--set observer.mu0_rad_s: got 500 rad/s")


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("rate_hz = 1,5", "Write a decimal point, not a comma."),
        ("rate_hz = 10 kHz", "Write the number without its unit"),
        ("rate_hz = 10kHz", "Write the number without its unit"),
        ("kind = sine", "Text needs quotes"),
        ("[loop", "both brackets"),
        ("rate_hz : 5", "Write KEY = VALUE"),
    ],
)
def test_message_shows_line_and_remedy_when_file_is_no_toml(tmp_path: Path, line: str, remedy: str) -> None:
    (fault,) = faults(rig_file(tmp_path, f"# a comment\n{line}\n"))
    assert "line 2" in fault
    assert line in fault
    assert remedy in fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[loop]\n[loop]\n", "Cannot declare [loop] twice"),
        ("a = " + "[" * 4000, "nested too deeply"),
        ("a = " + "9" * 5000, "a line of more than 4096 characters"),
    ],
    ids=["twice", "deep", "long"],
)
def test_message_is_in_words_when_parser_gives_up(tmp_path: Path, text: str, words: str) -> None:
    (fault,) = faults(rig_file(tmp_path, text))
    assert words in fault
    assert len(fault) < 400
