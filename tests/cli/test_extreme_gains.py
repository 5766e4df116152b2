"""Gains and models of any size: an error in words or figures, never a traceback."""

from __future__ import annotations

import json
import math
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config import change_rig, load_rig, load_tables
from dcmp_hil.config.explain import numbers
from dcmp_hil.errors import ConfigError
from tests.offline.synthetic import swing, write
from tests.recording.test_reexecute import record

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.config.tables import RigTables
    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Cli = Callable[..., Outcome]
    Script = Callable[..., Finished]

EXTREMES = ("1.7e308", "1e300", "nan", "inf", "0", "-1", "1e-300")
SLOW = ("loop.rate_hz=10", "controller.kp_1_s2=1", "controller.kd_1_s=2")
RIGS: dict[str, tuple[str, ...]] = {
    "slow": SLOW,
    "unwatched": ("supervisor.monitors=finite",),
    "paper": ("observer.kind=paper",),
}


def made(make: Callable[[list[str]], RigTables], key: str, value: str) -> bool:
    """Make a rig with an override; return whether it is one. Another exception fails the test."""
    table, _, field = key.partition(".")
    try:
        rig = make([f"{key}={value}"])
    except ConfigError as error:
        said = str(error)
    else:
        assert getattr(getattr(rig, table), field) == float(value)
        assert math.isfinite(float(value))
        return True
    assert f"{key}: got" in said or "with these gains" in said, said
    return False


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")  # numpy's, where the loop is judged by its matrix
def test_every_gain_of_any_size_gives_a_rig_or_a_sentence(name: str) -> None:
    rig = load_rig("bench-1khz", RIGS[name])
    keys = [key for key in numbers(rig) if key.startswith(("observer.", "controller.", "model."))]
    assert len(keys) >= 11
    for key in keys:
        answers = [made(partial(change_rig, rig), key, value) for value in EXTREMES]
        assert not all(answers), key
        if not key.startswith("controller."):
            assert [made(partial(load_tables, "bench-1khz"), key, value) for value in ("nan", "1e300")] == [
                False,
                False,
            ]


def test_a_rule_that_cannot_be_computed_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> str:
        raise OverflowError("too large")

    rig = load_rig("bench-1khz")
    monkeypatch.setattr("dcmp_hil.config.rig.RULES", (broken,))
    for make in (partial(load_rig, "bench-1khz"), partial(change_rig, rig)):
        with pytest.raises(ConfigError, match=r"^--set model.f0_1_s: a number is too large or too small"):
            make(["model.f0_1_s=0.2"])
    with pytest.raises(ConfigError, match=r"^bench-1khz.toml: a number is too large or too small"):
        load_rig("bench-1khz")


@pytest.mark.parametrize("option", ["--set", "--compare"])
def test_an_overflow_while_a_variant_is_made_is_an_error_line(
    option: str, script: Script, tmp_path: Path
) -> None:
    record(tmp_path, *SLOW, duration=2.0)
    done = script("replay", "run.mcap", option, "observer.L1_1_s=1.7e308")
    assert (done.code, done.out) == (2, "")
    (line,) = done.err.splitlines()
    assert line.startswith(f"error: {option} observer.L1_1_s: got ")
    assert "at most 100000" in line


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--mu0", "1e-300"), ""),
        (("--compare", "mu0=5e-324"), ""),
        (("--cutoff", "1e-300"), "too low for a usual step"),
        (("--cutoff", "5e-324"), "too low for a usual step"),
        (("--f0", "500"), "--f0: got 500; expected a number in 1/s, at least 0 and at most 100"),
        (("--ku", "20000"), "--ku: got 20000; expected a number in (rad/s2)/V, above 0 and at most 10000"),
    ],
)
def test_a_file_with_extreme_options_is_figures_or_an_error_line(
    options: tuple[str, ...], says: str, cli: Cli, tmp_path: Path
) -> None:
    truth = swing(duration=1.0)
    columns = {"time_s": truth.time, "position_rad": truth.position, "voltage_V": truth.voltage}
    file = str(write(tmp_path / "rec.csv", columns))
    outcome = cli("replay", file, "--no-write", "--json", "-", *options)
    if says:
        assert (outcome.code, outcome.out) == (2, "")
        assert says in outcome.err.replace("\n", " ")
        return
    assert outcome.code == 0, outcome.err
    figures: dict[str, Any] = json.loads(outcome.out)
    tiny = figures["compared"][0] if "compared" in figures else figures
    none = json.loads(cli("replay", file, "--no-write", "--json", "-", "--mu0", "0").out)
    assert tiny["velocity_error_rms_rad_s"] == none["velocity_error_rms_rad_s"]  # a floor of nothing is none
