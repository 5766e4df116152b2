"""Sweeps from spec to table: the bits of single runs, kept parts, continued, damaged, refused."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil import ConfigError, load_rig, run, sweep
from dcmp_hil.errors import BackendError, TripError
from dcmp_hil.sweeping.engine import FIGURES
from dcmp_hil.sweeping.executor import SweepBlock
from dcmp_hil.sweeping.local_executor import InProcess, Processes
from dcmp_hil.sweeping.picture import draw_sweep
from dcmp_hil.sweeping.preparation import prepare
from dcmp_hil.sweeping.sweep import SweepRun
from tests.sweeping.specs import SMALL, row, spec

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

KD = "controller.kd_1_s"
LIMIT = "supervisor.disturbance_limit_rad_s2"


def small_parts(run: SweepRun) -> SweepRun:
    """Return a sweep whose parts have two runs each."""
    run.blocks = [SweepBlock(k, 2 * k, 2) for k in range(3)]
    return run


def started(folder: Path | None, executor: Any = InProcess, **changes: Any) -> SweepRun:
    """Return the small sweep in the plain loop, ready to run."""
    return small_parts(SweepRun(prepare(spec(**changes), "spec", plain=True), executor, folder))


def test_a_row_has_the_figures_of_run_and_a_trip_its_time_and_cause() -> None:
    result = sweep({**SMALL, "grid": {LIMIT: [50.0, 0.5]}, "runs": 1}, plain=True)
    rig = load_rig("bench-1khz", result.command(1).replace(" --set ", "\n").split("\n")[1:])
    with pytest.raises(TripError) as caught:
        run(rig, duration=0.3, fast=True)
    assert result.tripped.tolist() == [False, True]
    assert result.table.column("trip_cause")[1].as_py() == caught.value.reason
    assert result.table.column("trip_time_s")[1].as_py() == caught.value.cycles[-1].sample.t
    assert row(result.table, 1) == {name: getattr(caught.value.result.summary, name) for name in FIGURES}
    assert result.worst()[0].run == 1


def test_values_that_the_rules_refuse_are_rows_with_the_sentence() -> None:
    result = sweep(
        {**SMALL, "grid": {"controller.kp_1_s2": [4500.0, 9e5]}, "runs": 1, "draw": {}}, plain=True
    )
    assert result.refused.tolist() == [False, True]
    assert "the loop is" in result.table.column("refused")[1].as_py()
    assert math.isnan(result.table.column("tracking_rms_rad")[1].as_py())
    assert [one.run for one in result.worst()] == [0]


def test_faults_go_to_the_plain_loop() -> None:
    result = sweep({**SMALL, "faults": ["plant.shove:at=100ms,for=10ms"], "grid": {}, "runs": 1})
    assert result.table.column("engine").to_pylist() == ["plain"]
    (share,) = prepare(spec(faults=["plant.shove:at=100ms"]), "spec").shares
    assert share.reasons == ("Faults are injected, which lanes do not have.",)
    assert "--fault plant.shove:at=100ms,for=10ms" in result.command(0)


@pytest.fixture(scope="module")
def whole() -> Any:
    """The table of the small sweep, in one go."""
    return sweep(spec(), plain=True).table


def test_processes_give_the_bits_of_one_and_a_killed_one_changes_nothing(whole: Any) -> None:
    assert str(whole.to_pylist()) == str(_killed_once().to_pylist())


def _killed_once() -> Any:
    sweeping = started(None, _KillsOne(2))
    assert [one.runs for one in sweeping] == [0, 2, 4, 6]
    return sweeping.table()


class _KillsOne(Processes):
    """Kills a process when it has been given its first block."""

    def started(self, pid: int, block: SweepBlock, trial: int) -> None:
        import os
        import signal

        if block.number == 1 and trial == 1:
            os.kill(pid, signal.SIGKILL)


def test_a_block_whose_processes_die_again_and_again_ends_the_sweep() -> None:
    class KillsAll(_KillsOne):
        def started(self, pid: int, block: SweepBlock, trial: int) -> None:
            super().started(pid, block, min(trial, 1))

    with pytest.raises(BackendError, match=r"The process of runs 2 to 3 .* was ended by SIGKILL, 3 times"):
        list(started(None, KillsAll(1)))


def test_an_interrupted_sweep_continues_with_what_is_missing_or_damaged(tmp_path: Path, whole: Any) -> None:
    first: Iterator[Any] = iter(started(tmp_path))
    assert [next(first).runs for _ in range(3)] == [0, 2, 4]
    first.close()  # type: ignore[attr-defined]
    damaged = tmp_path / "part-000000.parquet"
    data = bytearray(damaged.read_bytes())
    data[len(data) // 8] ^= 1  # of a page, which has a checksum
    damaged.write_bytes(data)
    (tmp_path / ".part-000002.parquet.1").write_bytes(b"half a part of a killed one")
    again = started(tmp_path)
    assert [one.found for one in again] == [2, 2, 2]
    assert str(again.table().to_pylist()) == str(whole.to_pylist())
    assert [one.runs for one in started(tmp_path)] == [6]


def test_another_spec_is_refused_and_its_difference_named(tmp_path: Path) -> None:
    list(started(tmp_path))
    with pytest.raises(ConfigError, match=r"made for another sweep: seed differs\. Choose another --out"):
        started(tmp_path, seed=2)
    with pytest.raises(ConfigError, match=r"made for another sweep: rig\.controller\.kp_1_s2 differs"):
        started(tmp_path, set={"controller.kp_1_s2": 4400.0, **SMALL["set"]})


def test_two_sweeps_do_not_write_into_one_folder(tmp_path: Path) -> None:
    first = iter(started(tmp_path))
    next(first)
    with pytest.raises(ConfigError, match="another sweep writes into it"):
        list(started(tmp_path))


def test_a_full_disk_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: Any) -> None:
    monkeypatch.setattr("dcmp_hil.sweeping.sweep.room_for", lambda _: 1e3)
    with pytest.raises(ConfigError, match=r"the results take up to .* MB .* free there"):
        list(started(tmp_path / "small"))
    monkeypatch.undo()
    calls = iter((False, True))

    def fsync(_: int) -> None:
        if next(calls, False):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("dcmp_hil.sweeping.parts.os.fsync", lambda _: None)
    sweeping = iter(started(tmp_path))
    next(sweeping)
    next(sweeping)
    monkeypatch.setattr("dcmp_hil.sweeping.parts.os.fsync", fsync)
    next(calls)
    with pytest.raises(ConfigError, match=r"No space left on device. What is finished is kept\. Free"):
        next(sweeping)
    monkeypatch.undo()
    assert sorted(path.name for path in tmp_path.glob("*part-*")) == ["part-000000.parquet"]
    again = started(tmp_path)
    assert {one.found for one in again} == {2}
    assert str(again.table().to_pylist()) == str(whole.to_pylist())


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        (
            {"grid": {"controller.kp_1_s2": [4000.0, 5e5], KD: [100.0, 120.0]}, "draw": {}},
            "heat map",
        ),
        ({"draw": {"model.f0_1_s": {"uniform": [0.1, 0.2]}, **SMALL["draw"]}}, "tornado"),
        ({"grid": {}}, "distribution"),
    ],
)
def test_the_picture_follows_what_was_swept(changes: dict[str, Any], kind: str, tmp_path: Path) -> None:
    result = sweep({**SMALL, "duration_s": 0.05, "runs": 1 if kind == "heat map" else 3, **changes})
    assert draw_sweep(result, tmp_path / "sweep.png") == kind
    assert (tmp_path / "sweep.png").read_bytes()[1:4] == b"PNG"


@pytest.mark.usefixtures("needs_compiler")
def test_a_mixed_sweep_is_split_and_has_the_bits_of_the_plain_loop() -> None:
    tables = {**SMALL, "runs": 1, "grid": {"observer.kind": ["super_twisting", "kalman"]}}
    mixed, plain = sweep(tables), sweep(tables, plain=True)
    assert mixed.table.column("engine").to_pylist() == ["lanes", "plain"]
    figures = [*FIGURES, "tripped", "trip_cause"]
    assert mixed.table.select(figures).equals(plain.table.select(figures))
