"""The options of `replay` for a recording of another program: what the observer is, and what it is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import pytest

from dcmp_hil import load_rig
from dcmp_hil.common.section import Positive
from dcmp_hil.config.rig import KINDS
from dcmp_hil.control.observers.paper import PaperSettings
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay
from tests.helpers import named
from tests.offline.synthetic import swing, write

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil import ObserverContext
    from dcmp_hil.values import Estimate, Sample
    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

MADE: list[tuple[ObserverContext, dict[str, float]]] = []


class Mine:
    """An observer of one's own, that believes in no motion."""

    def __init__(self, context: ObserverContext, **options: float) -> None:
        MADE.append((context, options))

    def update(self, sample: Sample) -> Estimate:
        from dcmp_hil.values import Estimate

        return Estimate(sample.position, 0.0, 0.0)


@pytest.fixture
def recording(tmp_path: Path) -> str:
    truth = swing(duration=1.5)
    columns = {"time_s": truth.time, "position_rad": truth.position, "voltage_V": truth.voltage}
    return str(write(tmp_path / "rec.csv", columns))


def figures(cli: Cli, *arguments: str) -> dict[str, Any]:
    outcome = cli("replay", *arguments, "--no-write", "--json", "-")
    assert outcome.code == 0, outcome.err
    found: dict[str, Any] = json.loads(outcome.out)
    return found


def test_an_observer_of_one_s_own_is_told_what_options_and_rig_say(
    cli: Cli, recording: str, tmp_path: Path
) -> None:
    MADE.clear()
    mine = ("--observer", named(Mine))
    figures(cli, recording, *mine)
    told = ("--set", "model.gravity_rad_s2=9.5", "--set", "model.f1_rad_s2=0.25", "--f0", "0.4", "--ku", "3")
    figures(cli, recording, *mine, *told)
    rig = tmp_path / "my-rig.toml"
    rig.write_text(
        "[model]\ngravity_rad_s2 = 7.0\nf1_rad_s2 = 0.5\nku_rad_s2_V = 2.5\n"
        "[encoder]\ncounts_per_rev = 2156\n"
        f'[observer]\nkind = "{named(Mine)}"\noptions = {{ gain = 3.0 }}\n'
    )
    figures(cli, recording, "--rig", str(rig))
    figures(cli, recording, "--rig", str(rig), "--set", "model.f1_rad_s2=0.75", "--counts-per-rev", "1000")
    usual, by_option, by_rig, by_both = (context for context, _ in MADE)
    assert usual.model[:4] == (0.1, 1.3, 14.03, 5.4)
    assert by_option.model[:4] == (0.4, 0.25, 9.5, 3.0)
    assert by_rig.model[:4] == (0.1, 0.5, 7.0, 2.5)
    assert by_both.model[:4] == (0.1, 0.75, 7.0, 2.5)
    assert [context.counts_per_rev for context, _ in MADE][2:] == [2156.0, 1000.0]
    assert [options for _, options in MADE] == [{}, {}, {"gain": 3.0}, {"gain": 3.0}]


@pytest.mark.parametrize("kind", [kind for kind in KINDS["observer"] if kind != "custom"])
def test_every_observer_of_a_rig_runs_over_a_file(kind: str, cli: Cli, recording: str) -> None:
    by_name = figures(cli, recording, "--observer", kind)
    assert by_name == figures(cli, recording, "--set", f"observer.kind={kind}")
    settings = ReplaySettings(observer=kind)
    assert settings.section == KINDS["observer"][kind].model_validate({"kind": kind})
    of_table = replay(read_recording(Path(recording)), ReplaySettings(observer=settings.section))
    of_name = replay(read_recording(Path(recording)), settings)
    assert of_table.figures == of_name.figures
    assert of_name.figures.velocity_error_rms_rad_s == by_name["velocity_error_rms_rad_s"]


class OwnDefaultsSettings(ObserverSettings):
    """A further kind of observer, with keys of the usual names and defaults of its own."""

    kind: Literal["own_defaults"]
    L1_1_s: Positive = 12.0
    L2_1_s2: Positive = 34.0
    M_rad_s3: Positive = 56.0
    mu0_rad_s: Positive = 7.0
    start: Literal["zero", "measured"] = "zero"

    def build(self, context: ObserverContext) -> SuperTwisting:
        return SuperTwisting(context, L1=self.L1_1_s, L2=self.L2_1_s2, M=self.M_rad_s3, mu0=self.mu0_rad_s)


def test_a_further_observer_keeps_its_own_defaults(monkeypatch: pytest.MonkeyPatch, recording: str) -> None:
    kinds = {**KINDS["observer"], "own_defaults": OwnDefaultsSettings}
    monkeypatch.setitem(KINDS, "observer", kinds)
    usual = OwnDefaultsSettings(kind="own_defaults")
    assert ReplaySettings(observer="own_defaults").section == usual
    given = ReplaySettings(observer="own_defaults", L2=5.51, mu0=8.0).section
    assert given == usual.model_copy(update={"L2_1_s2": 5.51, "mu0_rad_s": 8.0})
    data = read_recording(Path(recording))
    by_name = replay(data, ReplaySettings(observer="own_defaults"))
    by_gains = replay(data, ReplaySettings(L1=12.0, L2=34.0, M=56.0, mu0=7.0))
    assert by_name.figures == by_gains.figures
    assert ReplaySettings(observer="paper", from_zero=True).section == PaperSettings(start="zero")


@pytest.mark.parametrize("key", ["observer.mu0_rad_s=2000", "observer.L1_1_s=9000"])
def test_rules_of_a_loop_do_not_apply_where_none_is_closed(key: str, cli: Cli, recording: str) -> None:
    with pytest.raises(ConfigError):
        load_rig("bench-1khz", [key])
    assert figures(cli, recording, "--set", key)["rows"] > 100


@pytest.mark.parametrize(
    ("short", "keys"),
    [
        (("--mu0", "70"), ("observer.mu0_rad_s=70",)),
        (
            ("--M", "40", "--L1", "6", "--L2", "8"),
            ("observer.M_rad_s3=40", "observer.L1_1_s=6", "observer.L2_1_s2=8"),
        ),
        (("--f0", "0.5", "--ku", "4"), ("model.f0_1_s=0.5", "model.ku_rad_s2_V=4")),
        (("--observer", "paper", "--M", "500"), ("observer.kind=paper", "observer.M_rad_s3=500")),
        (("--counts-per-rev", "1000"), ("encoder.counts_per_rev=1000",)),
        (("--counts-per-rev", "ideal"), ("encoder.counts_per_rev=ideal",)),
    ],
)
def test_set_says_the_same_as_the_short_options(
    short: tuple[str, ...], keys: tuple[str, ...], cli: Cli, recording: str
) -> None:
    overrides = [word for key in keys for word in ("--set", key)]
    assert figures(cli, recording, *overrides) == figures(cli, recording, *short) != figures(cli, recording)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--set", "controller.kp_1_s2=5"), "what was measured stays as it was"),
        (("--set", "observer.mu=5"), "unknown key"),
        (("--set", "model.f0_1_s=-1"), "model.f0_1_s"),
        (("--set", "observer.mu0_rad_s=5", "--mu0", "6"), "say the same"),
        (("--rig", "nowhere.toml"), "nowhere.toml"),
        (("--modulus", "x"), "--modulus"),
        (("--modulus", "-1"), "--modulus"),
        (("--period", "-1"), "--period"),
        (("--time", "none"), "--period"),
        (("--no-input", "--voltage", "voltage_V"), "--no-input"),
        (("--mu0", "5", "--observer", "paper"), "--mu0"),
    ],
)
def test_what_cannot_be_is_refused(options: tuple[str, ...], says: str, cli: Cli, recording: str) -> None:
    outcome = cli("replay", recording, *options, "--no-write")
    assert (outcome.code, outcome.out) == (2, "")
    assert says in outcome.err.replace("\n", " ")


@pytest.mark.parametrize(
    ("option", "value"),
    [("--period", "10.000001"), ("--from", "-0.00000012345678"), ("--L1", "100000.00001")],
)
def test_a_number_that_is_refused_is_named_as_it_was_given(
    cli: Cli, recording: str, option: str, value: str
) -> None:
    outcome = cli("replay", recording, f"{option}={value}", "--no-write")
    assert outcome.code == 2
    assert float(outcome.err.partition("got ")[2].partition(";")[0]) == float(value)


def test_a_period_that_was_given_is_told_in_full(recording: str) -> None:
    read = read_recording(Path(recording), ColumnOptions(period=0.00500000123, time="none"))
    assert any("0.00500000123 s" in note for note in read.notes), read.notes
