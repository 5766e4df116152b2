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

from dcmp_hil.recording.reader import read_run
from tests.installed import Finished, environment
from tests.offline.synthetic import swing, write

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Script = Callable[..., Finished]

OLDER = Path(__file__).parents[1] / "recording" / "data"
KINDS = ("friction_kalman", "derivative", "kalman", "extended_state")
LIST = ",".join(KINDS)
FAST = ("--fast", "--viewer", "none")
LINES = (
    "velocity error, RMS",
    "disturbance error, RMS",
    "velocity, late by",
    "velocity above 15 Hz",
    "disturbance above 15 Hz",
    "voltage, variation",
    "cost of a step",
    "cost / super_twisting",
)
OWN = '''
from dcmp_hil import Estimate

class Mine:
    """Fails after half a second."""

    def __init__(self, context):
        pass

    def update(self, sample):
        return Estimate(sample.position, 0.0, 1.0 / (sample.t < 0.5))
'''


def columns_of(run: Path) -> Mapping[str, np.ndarray[Any, Any]]:
    (folder,) = (run / "runs").iterdir()
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
    """Return the folder of a run of ten seconds with four observers beside the loop, and its output."""
    folder = tmp_path_factory.mktemp("compared")
    command = ("run", "bench-1khz", *FAST, "--duration", "10", "--compare", LIST, "--from", "2")
    done = subprocess.run(
        [installed, *command, "--json", "o.json"],
        cwd=folder,
        env=environment(COLUMNS="140"),
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
    title, header, *lines = done.out[done.out.index("observers on the same") :].splitlines()
    assert title == "observers on the same samples, 2.00 to 10.00 s; errors against the truth"
    assert header.split() == ["super_twisting", "(in", "the", "loop)", *KINDS]
    assert [line[:24].strip() for line in lines] == list(LINES)
    figures = json.loads((folder / "o.json").read_text())
    comparison = figures["comparison"]
    assert (comparison["reference"], comparison["notes"]) == ("truth", [])
    loop, *beside = comparison["observers"]
    assert [one["observer"] for one in beside] == list(KINDS)
    assert (loop["observer"], loop["closes_loop"]) == ("super_twisting", True)
    assert not any(one["closes_loop"] for one in beside)
    for name in ("velocity_error_rms_rad_s", "disturbance_error_rms_rad_s2", "voltage_tv_V_s"):
        assert loop[name] == pytest.approx(figures[name], rel=1e-3)
    known = {one["observer"]: one for one in comparison["observers"]}
    assert known["friction_kalman"]["velocity_error_rms_rad_s"] < 0.5 * loop["velocity_error_rms_rad_s"]
    assert known["derivative"]["velocity_lag_s"] == pytest.approx(1.0 / 60.0, abs=3e-3)
    assert known["derivative"]["voltage_tv_V_s"] > 5.0 * loop["voltage_tv_V_s"]
    assert all(one["cost_us"] > 0.0 and one["cost_ratio"] > 0.0 for one in comparison["observers"])
    assert json.loads(next(folder.glob("runs/*/summary.json")).read_text())["comparison"] == comparison


def test_the_run_is_the_same_to_the_bit_as_without(
    compared: tuple[Path, Finished], script: Script, tmp_path: Path
) -> None:
    done = script("run", "bench-1khz", *FAST, "--duration", "3", "--json", "plain.json")
    assert done.code == 0, done.err
    assert "observers on the same" not in done.out
    assert json.loads((tmp_path / "plain.json").read_text())["comparison"] is None
    plain, found = columns_of(tmp_path), columns_of(compared[0])
    assert len(found) == len(plain) + 4 * len(KINDS)
    for name, values in plain.items():
        assert found[name][: len(values)].tobytes() == values.tobytes(), name


def test_replay_and_export_of_its_recording_have_the_same_numbers(
    compared: tuple[Path, Finished], script: Script, tmp_path: Path
) -> None:
    (run,) = (compared[0] / "runs").iterdir()
    again = ("replay", str(run), "--compare", f"super_twisting,{LIST}", "--from", "2", "--csv", "again.csv")
    done = script(*again, "--json", "again.json", env={"COLUMNS": "140"})
    assert done.code == 0, done.err
    assert script("export", str(run), "--csv", "run.csv").code == 0
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
    assert second == first
    shown = done.out[done.out.index("observers on the same") :].splitlines()
    assert [line[:24].strip() for line in shown[2:]] == list(LINES)


def test_a_run_in_real_time_has_them_from_its_telemetry_process(script: Script, tmp_path: Path) -> None:
    compare = ("--compare", "kalman", "--compare", "friction_kalman", "--set", "timing.realtime=off")
    done = script("run", "--viewer", "none", "--duration", "2", *compare, "--json", "o.json")
    assert done.code == 0, done.err
    assert "observers on the same samples" in done.out
    columns = columns_of(tmp_path)
    for kind in ("kalman", "friction_kalman"):
        assert np.isfinite(columns[column(kind, "velocity")]).all()
        assert np.isfinite(columns[column(kind, "demand")]).all()
    figures = json.loads((tmp_path / "o.json").read_text())
    assert len(figures["comparison"]["observers"]) == 3


def test_a_class_that_fails_beside_the_loop_leaves_the_run_whole_and_one_warning(
    compared: tuple[Path, Finished], script: Script, tmp_path: Path
) -> None:
    (tmp_path / "own.py").write_text(OWN)
    done = script("run", *FAST, "--duration", "2", "--compare", "own:Mine,kalman", env={"COLUMNS": "200"})
    assert done.code == 0, done.err
    warnings = [line for line in done.err.splitlines() if "gave up" in line]
    assert len(warnings) == 1
    assert "own_own_mine, which runs beside the loop only, gave up: own:Mine raised Zero" in warnings[0]
    assert "own.py, line 11" in warnings[0]
    found, plain = columns_of(tmp_path), columns_of(compared[0])
    for name in ("position_rad", "velocity_estimate_rad_s", "voltage_sent_V"):
        assert found[name].tobytes() == plain[name][: len(found[name])].tobytes()
    own = np.isfinite(found[column("own_own_mine", "velocity")])
    assert own.sum() == 500
    assert own[:500].all()
    assert np.isfinite(found[column("kalman", "velocity")]).all()
    assert "own:Mine has no numbers from 0.500 s on, and therefore no figures." in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--compare", "kallman"), 'Did you mean "kalman"?'),
        (("--compare", "friction_kalman", "--set", "encoder.counts_per_rev=ideal"), "this one is ideal"),
        (("--compare", "nowhere:Mine"), "nowhere"),
    ],
)
def test_a_name_that_is_none_is_refused_before_anything_begins(
    arguments: tuple[str, ...], said: str, script: Script, tmp_path: Path
) -> None:
    done = script("run", *FAST, "--duration", "1", *arguments, env={"COLUMNS": "400"})
    assert (done.code, done.out) == (2, "")
    assert said in done.err
    assert "--compare" in done.err
    assert not (tmp_path / "runs").exists()


def test_a_file_of_another_program_is_compared_by_the_zero_phase_reference(
    script: Script, tmp_path: Path
) -> None:
    truth = swing(duration=4.0)
    columns = {"time_s": truth.time, "position_rad": truth.position, "voltage_V": truth.voltage}
    file = str(write(tmp_path / "rec.csv", columns))
    arguments = ("replay", file, "--ku", "5.4", "--no-write", "--counts", "4096")
    lists = ("--compare", "friction-kalman,derivative", "--compare", "mu0=60", "--json", "o.json")
    done = script(*arguments, *lists, env={"COLUMNS": "140"})
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
    refused = script(*arguments, "--compare", "derivativ", env={"COLUMNS": "400"})
    assert refused.code == 2
    assert 'Did you mean "derivative"?' in refused.err


@pytest.mark.parametrize(
    "file", sorted(Path(__file__).parents[1].glob("recording/data/*.mcap")), ids=lambda file: file.stem
)
def test_older_recordings_are_compared_as_well(file: Path, script: Script, tmp_path: Path) -> None:
    shutil.copy(file, tmp_path / "old.mcap")
    done = script("replay", "old.mcap", "--compare", "kalman,derivative", "--json", "o.json")
    assert done.code in {0, 6}, done.err  # some have no checksum over all
    comparison = json.loads((tmp_path / "o.json").read_text())["comparison"]
    assert [one["observer"] for one in comparison["observers"]][1:] == ["kalman", "derivative"]
    assert all(one["velocity_noise_rad_s"] is not None for one in comparison["observers"])
