"""A sweep on a real cluster: the same results where a worker dies, and every loss in one sentence."""

from __future__ import annotations

import os
import signal
import threading
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import sweep
from dcmp_hil.errors import BackendError, ConfigError, OpenError
from dcmp_hil.sweeping import cluster
from dcmp_hil.sweeping.cluster import DaskCluster
from dcmp_hil.sweeping.cluster_look import ClusterTimeouts
from dcmp_hil.sweeping.cluster_worker import Installed
from dcmp_hil.sweeping.engine import LANES, PLAIN
from dcmp_hil.sweeping.executor import SweepBlock
from dcmp_hil.sweeping.preparation import prepare
from dcmp_hil.sweeping.spec_file import spec_from
from tests.sweeping.cluster_work import HeldWork, die, fail, refuse
from tests.sweeping.dask_processes import ALLOWED_FAILURES, DaskProcesses, dask_processes, wait_until

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("distributed")
SPEC = {
    "rig": "bench-1khz",
    "duration_s": 0.2,
    "runs": 6,
    "set": {"sim.encoder_noise_counts": 0.3},
    "grid": {"supervisor.start": ["immediate", "engage"]},  # lanes take the first only
    "draw": {"sim.plant.f0_1_s": {"loguniform": [0.05, 0.5]}},
}
BLOCKS = [SweepBlock(number, 2 * number, 2) for number in range(6)]
QUICK = ClusterTimeouts(first_worker_s=0.3, new_worker_s=0.5, look_s=0.1)


def test_worker_killed_under_its_block_changes_nothing(tmp_path: Path) -> None:
    work = prepare(spec_from(SPEC, "spec"), "spec").work
    serial = [(block, work(block)) for block in BLOCKS]
    with dask_processes(tmp_path / "dask") as processes:
        processes.have(2)
        executor = DaskCluster(processes.address)
        assert executor.words == f"2 threads of 2 workers of Dask at {processes.address}"
        assert executor.workers == 2
        killer = threading.Thread(target=_kill, args=(tmp_path / "block-3",))
        killer.start()
        found = sorted(executor.run(HeldWork(work, str(tmp_path), waiting=3), BLOCKS))
        killer.join()
        dead = [worker.returncode for worker in processes.workers if worker.poll() is not None]
        table = sweep(SPEC, scheduler=processes.address).table
        with pytest.raises(BackendError, match=r"has lost its last worker, and no other came within 0\.5 s"):
            list(DaskCluster(processes.address, QUICK).run(die, BLOCKS[:1]))
    assert dead == [-signal.SIGKILL]
    assert repr(found) == repr(serial)  # every bit; NaN is not equal to itself
    assert {row.engine for _, rows in found for row in rows} == {LANES, PLAIN}
    assert repr(table.to_pydict()) == repr(sweep(SPEC, workers=1).table.to_pydict())
    assert sorted(file.name for file in tmp_path.iterdir()) == ["block-3", "dask"]


def _kill(mark: Path) -> None:
    wait_until(mark.exists, "no worker took that block")
    os.kill(int(mark.read_text()), signal.SIGKILL)


def test_every_loss_is_told_with_its_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = prepare(spec_from(SPEC, "spec"), "spec").work
    with dask_processes(tmp_path / "dask") as processes:
        with pytest.raises(OpenError, match=r"has no worker, and none came within 0\.3 s: start some with"):
            DaskCluster(processes.address, QUICK)
        processes.have(ALLOWED_FAILURES + 2)
        executor = DaskCluster(processes.address, QUICK)
        _other_versions(processes, executor, monkeypatch)
        _faults_of_the_work(executor)
        with pytest.raises(BackendError, match=r"2 workers in succession died while they had block 0 "):
            list(executor.run(die, BLOCKS[:1]))
        running = executor.run(HeldWork(work, str(tmp_path), waiting=1), BLOCKS)
        next(running)
        processes.scheduler.kill()
        with pytest.raises(BackendError, match="has gone, or is not reached any more"):
            list(running)
        with pytest.raises(OpenError, match=r"No Dask scheduler can be reached at .* \(Connection refused\)"):
            DaskCluster(processes.address, QUICK)


def _other_versions(processes: DaskProcesses, executor: DaskCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker with other numerics is refused at the first look, and by the block that it gets."""
    here = Installed("9.9", 3)
    with monkeypatch.context() as patch:
        patch.setattr(cluster, "installed", lambda: here)
        with pytest.raises(
            BackendError, match=r"has dcmp-hil .* with numerics 2, and this computer dcmp-hil 9\.9"
        ):
            DaskCluster(processes.address, QUICK)
    with monkeypatch.context() as patch:
        patch.setattr("dcmp_hil.sweeping.cluster_tasks.installed", lambda: here)
        with pytest.raises(BackendError, match=r"Install dcmp-hil 9\.9 there"):
            list(executor.run(refuse, BLOCKS[:1]))


def _faults_of_the_work(executor: DaskCluster) -> None:
    with pytest.raises(ConfigError, match="block 1: wrong") as wrong:
        list(executor.run(refuse, BLOCKS[1:2]))
    assert wrong.value.faults == ("block 1: wrong", "in two ways")
    with pytest.raises(
        BackendError, match=r"Block 5 \(runs 10 to 11\) failed on a worker \(ZeroDivisionError: 5\)"
    ):
        list(executor.run(fail, BLOCKS[5:6]))
