"""`run --compare` and `replay --compare` with a list of observers, through the installed command."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.cli import console
from dcmp_hil.recording.reader import read_run
from tests.helpers import bench
from tests.installed import Finished, environment
from tests.offline.synthetic import swing, write

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tests.cli.conftest import Outcome

    Script = Callable[..., Finished]
    Cli = Callable[..., Outcome]

OLDER = Path(__file__).parents[1] / "recording" / "data"
KINDS = ("friction_kalman", "derivative", "kalman", "extended_state")
LIST = ",".join(KINDS)
OWN_KIND, OWN_NAME = "own:Mine", "own_own_mine"
FAST = ("--fast", "--viewer", "none")
HEADER = ("v error", "w error", "v lag", "v noise", "w noise", "TV", "cost")
OWN = '''
from dcmp_hil import Estimate

class Mine:
    """Fails after half a second."""

    def __init__(self, context):
        pass

    def update(self, sample):
        return Estimate(sample.position, 0.0, 1.0 / (sample.t < 0.5))
'''


def columns_of(place: Path) -> Mapping[str, np.ndarray[Any, Any]]:
    (folder,) = (place / "runs").iterdir()
    return read_run(folder).columns


def table(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([row[name] or "nan" for row in rows], float) for name in rows[0]}


def column(kind: str, quantity: str) -> str:
    return {
        "velocity": f"velocity_{kind}_rad_s",
        "disturbance": f"disturbance_{kind}_rad_s2",
        "demand": f"voltage_demand_{kind}_V",
    }[quantity]


@pytest.fixture(scope="module")
def compared(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Finished]:
    """Return the folder of a run with four observers beside the loop, and one that fails, and its output."""
    folder = tmp_path_factory.mktemp("compared")
    (folder / "own.py").write_text(OWN)
    compare = ("--compare", LIST, "--compare", OWN_KIND)
    command = ("run", "bench-1khz", *FAST, "--duration", "10", *compare, "--from", "2")
    done = subprocess.run(
        [installed, *command, "--json", "o.json"],
        cwd=folder,
        env=environment(COLUMNS="200"),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300.0,
        check=False,
    )
    return folder, Finished(done.returncode, done.stdout, done.stderr)


def test_a_run_ends_with_a_table_of_the_observers(compared: tuple[Path, Finished]) -> None:
    folder, done = compared
    assert done.code == 0, done.err
    title, header, units, *lines = done.out[done.out.index("observers on the same") :].splitlines()
    assert title == "observers on the same samples, 2.00 to 10.00 s; errors against the truth"
    assert header.split() == " ".join(HEADER).split()
    assert units.split() == ["rad/s", "rad/s²", "ms", "rad/s", "rad/s²", "V/s", "µs", "ratio"]
    assert [line.split()[0] for line in lines[: len(KINDS) + 2]] == ["super_twisting", *KINDS, OWN_KIND]
    assert lines[0].split()[1] == "*"
    figures = json.loads((folder / "o.json").read_text())
    comparison = figures["comparison"]
    assert comparison["reference"] == "truth"
    loop, *beside, _ = comparison["observers"]
    assert [one["observer"] for one in beside] == list(KINDS)
    assert (loop["observer"], loop["closes_loop"]) == ("super_twisting", True)
    assert not any(one["closes_loop"] for one in beside)
    for name in ("velocity_error_rms_rad_s", "disturbance_error_rms_rad_s2", "voltage_tv_V_s"):
        assert loop[name] == pytest.approx(figures[name], rel=1e-3)
    known = {one["observer"]: one for one in comparison["observers"]}
    assert known["friction_kalman"]["velocity_error_rms_rad_s"] < 0.5 * loop["velocity_error_rms_rad_s"]
    assert known["derivative"]["velocity_lag_s"] == pytest.approx(1.0 / 60.0, abs=3e-3)
    assert known["derivative"]["voltage_tv_V_s"] > 5.0 * loop["voltage_tv_V_s"]
    assert all(one["cost_us"] > 0.0 and one["cost_ratio"] > 0.0 for one in (loop, *beside))
    assert json.loads(next(folder.glob("runs/*/summary.json")).read_text())["comparison"] == comparison


def test_the_run_is_the_same_to_the_bit_as_without(compared: tuple[Path, Finished]) -> None:
    plain = run(bench(), duration=2.0, fast=True).columns
    found = columns_of(compared[0])
    assert len(found) == len(plain) + 4 * (len(KINDS) + 1)
    for name, values in plain.items():
        assert found[name][: len(values)].tobytes() == values.tobytes(), name


def test_a_class_that_fails_beside_the_loop_leaves_the_run_whole_and_one_warning(
    compared: tuple[Path, Finished],
) -> None:
    folder, done = compared
    (warning,) = [line for line in done.err.splitlines() if "gave up" in line]
    assert f"{OWN_NAME}, which runs beside the loop only, gave up: {OWN_KIND} raised Zero" in warning
    assert "own.py, line 11" in warning
    columns = columns_of(folder)
    own = np.isfinite(columns[column(OWN_NAME, "velocity")])
    assert own[:500].all()
    assert not own[500:].any()
    comparison = json.loads((folder / "o.json").read_text())["comparison"]
    figures = comparison["observers"][-1]
    assert (figures["observer"], figures["velocity_error_rms_rad_s"]) == (OWN_KIND, None)
    assert comparison["notes"] == [f"{OWN_KIND} has no numbers from 2.000 s on, and therefore no figures."]


def test_replay_and_export_of_its_recording_have_the_same_numbers(
    compared: tuple[Path, Finished], script: Script, tmp_path: Path
) -> None:
    (folder,) = (compared[0] / "runs").iterdir()
    again = (
        "replay",
        str(folder),
        "--compare",
        f"super_twisting,{LIST}",
        "--from",
        "2",
        "--csv",
        "again.csv",
    )
    done = script(*again, "--json", "again.json", env={"COLUMNS": "140"})
    assert done.code == 0, done.err
    assert script("export", str(folder), "--csv", "run.csv").code == 0
    recorded, exported, repeated = (
        columns_of(compared[0]),
        table(tmp_path / "run.csv"),
        table(tmp_path / "again.csv"),
    )
    for number, kind in enumerate(KINDS, start=1):  # the one that closed the loop is not run twice
        for quantity, other in (
            ("velocity", "velocity_estimate_rad_s"),
            ("disturbance", "disturbance_estimate_rad_s2"),
            ("demand", "voltage_demand_V"),
        ):
            values = recorded[column(kind, quantity)]
            assert np.isfinite(values).all()
            assert values.tobytes() == exported[column(kind, quantity)].tobytes()
            assert values.tobytes() == repeated[f"{other}_compare{number}"].tobytes()
    assert not any(name.endswith(f"_compare{len(KINDS) + 1}") for name in repeated)
    first = json.loads((compared[0] / "o.json").read_text())["comparison"]
    second = json.loads((tmp_path / "again.json").read_text())["comparison"]
    for one in (*first["observers"], *second["observers"]):
        del one["cost_us"], one["cost_ratio"]
    assert second["observers"] == first["observers"][:-1]
    assert second["window_s"] == first["window_s"]
    shown = done.out[done.out.index("observers on the same") :].splitlines()
    assert [line.split()[0] for line in shown[3 : 4 + len(KINDS)]] == ["super_twisting", *KINDS]


def test_a_run_in_real_time_has_them_from_its_telemetry_process(script: Script, tmp_path: Path) -> None:
    compare = ("--compare", "kalman", "--compare", "friction_kalman", "--set", "timing.realtime=off")
    done = script("run", "--viewer", "none", "--no-record", "--duration", "2", *compare, "--json", "o.json")
    assert done.code == 0, done.err
    assert "observers on the same samples" in done.out
    loop, *beside = json.loads((tmp_path / "o.json").read_text())["comparison"]["observers"]
    assert [one["observer"] for one in beside] == ["kalman", "friction_kalman"]
    for one in (loop, *beside):
        assert 0.0 < one["velocity_error_rms_rad_s"] < 1.0
        assert one["voltage_tv_V_s"] > 0.0


def test_a_name_that_is_none_is_refused_before_anything_begins(script: Script, tmp_path: Path) -> None:
    done = script("run", *FAST, "--duration", "1", "--compare", "kalman,friction", env={"COLUMNS": "400"})
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith('error: --compare: got "friction"')
    assert 'Did you mean "friction_kalman"?' in done.err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--compare", "friction_kalman", "--set", "encoder.counts_per_rev=ideal"), "this one is ideal"),
        (("--compare", "nowhere:Mine"), "importing nowhere failed"),
    ],
)
def test_an_observer_that_cannot_be_made_is_refused_before_anything_begins(
    arguments: tuple[str, ...], said: str, cli: Cli, tmp_path: Path
) -> None:
    done = cli("run", *FAST, "--duration", "1", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err.replace("\n", " ")
    assert "--compare" in done.err
    assert not (tmp_path / "runs").exists()


def test_a_file_of_another_program_is_compared_by_the_zero_phase_reference(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth = swing(duration=4.0)
    columns = {"time_s": truth.time, "position_rad": truth.position, "voltage_V": truth.voltage}
    file = str(write(tmp_path / "rec.csv", columns))
    arguments = ("replay", file, "--ku", "5.4", "--no-write", "--counts", "4096")
    lists = ("--compare", "friction-kalman,derivative", "--compare", "mu0=60", "--json", "o.json")
    monkeypatch.setattr(console, "out", console.SafeConsole(soft_wrap=True, width=150))
    done = cli(*arguments, *lists)
    assert done.code == 0, done.err
    assert "errors against the zero-phase reference" in done.out
    first, second = done.out.split("observers on the same samples")
    assert "observer.mu0_rad_s=60" in first
    assert "friction_kalman" not in first
    assert "(in the loop)" not in second
    assert "V/s" not in second  # a file has no demand
    found = json.loads((tmp_path / "o.json").read_text())
    kinds = ["super_twisting", "friction_kalman", "derivative"]
    assert [one["set"] for one in found["compared"][:2]] == [f"observer.kind={kind}" for kind in kinds[1:]]
    comparison = found["comparison"]
    assert comparison["reference"] == "zero_phase"
    assert [one["observer"] for one in comparison["observers"]] == kinds
    for one, other in zip(comparison["observers"], (found, *found["compared"]), strict=False):
        for name in ("velocity_error_rms_rad_s", "disturbance_error_rms_rad_s2"):
            assert one[name] == pytest.approx(other[name], rel=1e-9)
    refused = cli(*arguments, "--compare", "derivativ")
    assert refused.code == 2
    assert 'Did you mean "derivative"?' in refused.err.replace("\n", " ")


@pytest.mark.parametrize(
    "file", sorted(Path(__file__).parents[1].glob("recording/data/*.mcap")), ids=lambda file: file.stem
)
def test_older_recordings_are_compared_as_well(file: Path, cli: Cli, tmp_path: Path) -> None:
    shutil.copy(file, tmp_path / "old.mcap")
    done = cli("replay", "old.mcap", "--compare", "kalman,derivative", "--json", "o.json")
    assert done.code in {0, 6}, done.err  # some have no checksum over all
    comparison = json.loads((tmp_path / "o.json").read_text())["comparison"]
    assert [one["observer"] for one in comparison["observers"]][1:] == ["kalman", "derivative"]
    assert all(one["velocity_noise_rad_s"] is not None for one in comparison["observers"])
