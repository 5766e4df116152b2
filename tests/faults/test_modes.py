"""`dcmp-hil run --fault` in every mode of a run, as a user meets it: the installed script."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.recording.reader import read_run

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

OFFSET = "plant.offset:V=0.1,at=0.2s"
SLOW = "host.slow:ms=1,at=0.2s,times=5"
DROP = "wire.drop:p=1,way=down,at=0.3s,for=1ms"  # one SAMPLE: too few for a warning
STOP = "firmware.stop:at=0.3s"
WIRED = "warning: backend.kind = sim has no wire, and a fault needs one: this run has backend.kind=sim-board."


def run(script: Script, *arguments: str) -> Finished:
    """Run the bench for half a second, without a viewer, with the figures as JSON on stdout."""
    return script("run", "bench-1khz", "--viewer", "none", "--duration", "0.5", "--json", "-", *arguments)


@pytest.mark.parametrize("faults", [(OFFSET, SLOW), (DROP, SLOW)])
def test_a_paced_run_with_faults_is_recorded_as_any_run(
    script: Script, tmp_path: Path, faults: tuple[str, ...]
) -> None:
    done = run(script, *(word for fault in faults for word in ("--fault", fault)))
    wired = DROP in faults
    said, kept_in, _ = " ".join(done.err.split()).partition("kept in ")
    assert (done.code, said.strip(), kept_in) == (0, WIRED if wired else "", "kept in ")
    assert json.loads(done.out)["faults"] == list(faults)
    (folder,) = (tmp_path / "runs").iterdir()
    assert json.loads((folder / "summary.json").read_text())["ended_by"] == "duration"
    kept = read_run(folder)
    assert json.loads(kept.run["faults"]) == list(faults)
    assert kept.rig.backend.kind == ("sim-board" if wired else "sim")


@pytest.mark.parametrize("mode", ["--no-control", "--fast"])
@pytest.mark.parametrize("backend", ["sim", "sim-board"])
def test_faults_act_without_control_and_in_virtual_time(
    script: Script, tmp_path: Path, mode: str, backend: str
) -> None:
    away = "plant.enc_jump:counts=4000,at=0.3s"
    done = run(script, mode, "--no-record", "--set", f"backend.kind={backend}", "--fault", away)
    assert done.code == 4, done.err
    assert "Traceback" not in done.err
    assert json.loads(done.out)["ended_by"] == "jump"
    assert not (tmp_path / "runs").exists()


def test_a_fault_that_trips_a_paced_run_leaves_its_black_box(script: Script, tmp_path: Path) -> None:
    done = run(script, "--fault", STOP)
    assert done.code == 4, done.err
    assert "STOP was sent to the device" in " ".join(done.err.split())
    assert "Traceback" not in done.err
    (folder,) = (tmp_path / "runs").iterdir()
    assert (folder / "black_box.csv").stat().st_size > 0
    assert json.loads((folder / "summary.json").read_text())["ended_by"] == "device_fault"
