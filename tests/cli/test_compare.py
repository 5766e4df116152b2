"""`replay --compare`: observers, controllers and gains side by side, over a file and over a run."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil.cli import console
from tests.offline.synthetic import swing, write
from tests.recording.test_reexecute import record
from tests.telemetry.runs import values

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Cli = Callable[..., Outcome]

VARIANTS = {  # as written: as --set
    "observer=Paper; M=500": ("observer.kind=paper", "observer.M_rad_s3=500"),
    "observer.mu0_rad_s=90": ("observer.mu0_rad_s=90",),
    "model.f0_1_s=0.4;L1=6": ("model.f0_1_s=0.4", "observer.L1_1_s=6"),
}
CONTROLLERS = {
    "controller.kp_1_s2=3000;controller.kd_1_s=120": ("controller.kp_1_s2=3000", "controller.kd_1_s=120"),
    "controller.kind=pd": ("controller.kind=pd",),
}


def options(variants: dict[str, tuple[str, ...]]) -> list[str]:
    return [word for text in variants for word in ("--compare", text)]


def sets(keys: tuple[str, ...]) -> list[str]:
    return [word for key in keys for word in ("--set", key)]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    truth = swing(duration=1.0)
    columns = {"time_s": truth.time, "position_rad": truth.position, "voltage_V": truth.voltage}
    return str(write(tmp_path_factory.mktemp("a-file") / "rec.csv", columns))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(record(tmp_path_factory.mktemp("a-run"), duration=0.8))


def figures(cli: Cli, *arguments: str) -> dict[str, Any]:
    outcome = cli("replay", *arguments, "--no-write", "--force", "--json", "-")
    assert outcome.code == 0, outcome.err
    found: dict[str, Any] = json.loads(outcome.out)
    return found


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def test_each_variant_of_a_file_is_what_set_gives_alone(cli: Cli, recording: str, tmp_path: Path) -> None:
    csv_file, rrd = tmp_path / "o.csv", tmp_path / "o.rrd"
    plain = figures(cli, recording)
    compared = figures(cli, recording, *options(VARIANTS), "--csv", str(csv_file), "--rrd", str(rrd))
    together = columns(csv_file)
    others = compared.pop("compared")
    assert compared == plain
    assert [other.pop("set") for other in others] == ["; ".join(keys) for keys in VARIANTS.values()]
    for number, (other, keys) in enumerate(zip(others, VARIANTS.values(), strict=True), start=1):
        alone = figures(cli, recording, *sets(keys), "--csv", str(csv_file))
        own = [note for note in other.pop("notes") if note not in alone["notes"]]
        assert len(own) == ("model" in keys[0])  # another model has another reference
        assert other.items() <= alone.items()
        assert other["velocity_error_rms_rad_s"] != plain["velocity_error_rms_rad_s"]
        for name in ("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2"):
            assert together[f"{name}_compare{number}"] == columns(csv_file)[name]
    assert values(rrd, "joint/velocity_rad_s").shape[1] == 2 + len(VARIANTS)


def test_each_variant_of_a_run_is_what_set_gives_alone(cli: Cli, run: str, tmp_path: Path) -> None:
    variants = {**VARIANTS, **CONTROLLERS}
    csv_file, rrd = tmp_path / "o.csv", tmp_path / "o.rrd"
    plain = figures(cli, run)
    compared = figures(cli, run, *options(variants), "--csv", str(csv_file), "--rrd", str(rrd))
    together = columns(csv_file)
    others = compared.pop("compared")
    assert compared == plain
    assert plain["identical"]
    assert [other.pop("set") for other in others] == ["; ".join(keys) for keys in variants.values()]
    for number, (other, keys) in enumerate(zip(others, variants.values(), strict=True), start=1):
        alone = figures(cli, run, *sets(keys), "--csv", str(csv_file))
        assert other.pop("identical") is alone["identical"] is False
        assert other.pop("unrepeated_changes") == alone["unrepeated_changes"] == []
        assert other == {name: line["again"] for name, line in alone.items() if isinstance(line, dict)}
        for name in ("velocity_estimate_rad_s", "disturbance_estimate_rad_s2", "voltage_demand_V"):
            assert together[f"{name}_compare{number}"] == columns(csv_file)[f"{name}_again"]
    shown = values(rrd, "voltage_demand_V")
    assert shown.shape[1] == 2 + len(variants)
    assert len({tuple(line) for line in shown.T}) == 1 + len(variants)  # recorded and again are the same
    assert not np.isnan(shown).any()


def test_variants_stand_on_top_of_set_and_are_columns_of_the_table(
    cli: Cli, run: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = ("--mu0", "70", "--compare", "observer=paper", "--compare", "controller.kind=pd")
    compared = figures(cli, run, *base)["compared"]
    assert (
        compared[0]["velocity_error_rms_rad_s"]
        == (figures(cli, run, "--observer", "paper")["velocity_error_rms_rad_s"]["again"])
    )
    both = figures(cli, run, "--mu0", "70", "--set", "controller.kind=pd")
    assert compared[1]["demand_tv_V_s"] == both["demand_tv_V_s"]["again"]
    monkeypatch.setattr(console, "out", console.SafeConsole(soft_wrap=True, width=150))
    table = cli("replay", run, *base).out
    for label in ("recorded", "observer.mu0_rad_s=70", "observer.kind=paper", "controller.kind=pd"):
        assert label in table


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("observer.mu=5",), "--compare observer.mu: unknown key"),
        (("observer=nope",), "--compare observer.kind"),
        (("loop.rate_hz=500",), "what was measured stays as it was"),
        (("nothing",), "Write KEY=VALUE"),
        ((" ; ",), "Write KEY=VALUE"),
        (("mu0=60", "observer.mu0_rad_s=60"), "given twice"),
        (("observer.kind=nowhere:Mine",), "--compare observer.kind=nowhere:Mine: "),
    ],
)
@pytest.mark.parametrize("kind", ["file", "run"])
def test_a_variant_that_cannot_be_is_refused(
    kind: str, arguments: tuple[str, ...], says: str, cli: Cli, request: pytest.FixtureRequest
) -> None:
    source = request.getfixturevalue("recording" if kind == "file" else "run")
    outcome = cli("replay", source, "--no-write", *options(dict.fromkeys(arguments, ())))
    assert (outcome.code, outcome.out) == (2, "")
    assert says in outcome.err.replace("\n", " ")


def test_another_model_is_judged_by_a_reference_that_the_files_hold(
    script: Callable[..., Finished], recording: str, tmp_path: Path
) -> None:
    models = ("f0=0.5", "ku=6", "L1=6")
    variants = [word for key in models for word in ("--compare", key)]
    outputs = ("--csv", "o.csv", "--rrd", "o.rrd", "--json", "o.json")
    done = script("replay", recording, "--ku", "5.4", *variants, *outputs, cwd=tmp_path)
    assert done.code == 0, done.err
    compared = json.loads((tmp_path / "o.json").read_text())["compared"]
    table = {name: np.array(cells, float) for name, cells in columns(tmp_path / "o.csv").items()}
    judged = table["time_s"] - table["time_s"][0] > 0.3 + 1e-6
    names = [name for name in table if name.startswith("disturbance_reference")]
    assert [name.partition("rad_s2")[2] for name in names] == ["", "_compare1", "_compare2"]
    u, v = table["voltage_V"], table["velocity_reference_rad_s"]
    u = 0.5 * (u + np.append(u[1:], u[-1]))  # around a row
    for number, variant in enumerate(compared, start=1):
        own = table.get(f"disturbance_reference_rad_s2_compare{number}", table[names[0]])
        error = (table[f"disturbance_estimate_rad_s2_compare{number}"] - own)[judged]
        rms = float(np.sqrt(np.mean(error**2)))
        assert variant["disturbance_error_rms_rad_s2"] == pytest.approx(rms, rel=1e-6)
        said = f"{variant['set']}: The disturbance is judged by a reference with the model of this variant"
        assert (
            (said in done.err)
            == (number < len(models))
            == any("model of this variant" in note for note in variant["notes"])
        )
    f0, ku = (table[name] - table[names[0]] for name in names[1:])
    assert f0[judged] == pytest.approx((0.4 * v)[judged], abs=1e-6)  # x'' + f0 x' - u: by its definition
    assert np.corrcoef(ku[judged], -u[judged])[0, 1] > 0.95  # u is filtered in it
    assert values(tmp_path / "o.rrd", "joint/disturbance_rad_s2").shape[1] == 2 + len(models) + 2


def test_a_controller_is_compared_over_a_run_only(cli: Cli, recording: str) -> None:
    outcome = cli("replay", recording, "--no-write", "--compare", "controller.kind=pd")
    assert outcome.code == 2
    assert "with a key of observer or model" in outcome.err.replace("\n", " ")
