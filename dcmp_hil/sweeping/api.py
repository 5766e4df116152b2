"""The function `sweep` of the Python API: many runs of a rig, from spec to table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.plugins.named_class import find_named
from dcmp_hil.sweeping.executor import CLUSTER
from dcmp_hil.sweeping.local_executor import InProcess, Processes, cores
from dcmp_hil.sweeping.preparation import prepare
from dcmp_hil.sweeping.result import SweepResult
from dcmp_hil.sweeping.spec import SweepSpec
from dcmp_hil.sweeping.spec_file import load_spec, spec_from
from dcmp_hil.sweeping.sweep import SweepRun

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from dcmp_hil.sweeping.executor import Executor
    from dcmp_hil.sweeping.sweep import Progress

_WORTH_PROCESSES_S = 4.0  # s of work: a process takes one to start


def sweep(
    spec: str | Path | Mapping[str, Any] | SweepSpec,
    *,
    out: Path | None = None,
    workers: int | None = None,
    scheduler: str = "",
    plain: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> SweepResult:
    """Run a sweep and return its table.

    Parameters
    ----------
    spec
        Path of a sweep's file, or its tables, such as ``{"rig": "bench-1khz", "duration_s": 10.0,
        "runs": 100, "draw": {"model.f1_rad_s2": {"normal": [1.3, 0.1]}}}``.
    out
        Folder of the parts; what is there already is not run again. None keeps everything in memory.
    workers
        Number of processes; None for one a core, or none at all for a few seconds of work.
    scheduler
        Address of a Dask scheduler, whose workers then run the sweep.
    plain
        Whether every run is made by the plain loop.
    progress
        Called at the start and whenever runs are finished.

    Returns
    -------
    SweepResult
        Table, quantiles, worst runs. The bits depend neither on workers nor on where they are.

    Raises
    ------
    ConfigError
        If the spec does not fit the rig, or the results cannot be kept.
    BackendError
        If no worker or no scheduler can be had.
    """
    if isinstance(spec, SweepSpec):
        checked = spec
    else:
        checked = load_spec(spec) if isinstance(spec, str | Path) else spec_from(spec, "spec")
    prepared = prepare(checked, str(spec) if isinstance(spec, str | Path) else "spec", plain=plain)
    executor = executor_for(prepared.cpu_s, workers, scheduler)
    run = SweepRun(prepared, executor, out, together=bool(scheduler))
    for one in run:
        if progress is not None:
            progress(one)
    return SweepResult(checked, run.table(), out)


def executor_for(cpu_s: float, workers: int | None, scheduler: str) -> Executor:
    """Return what runs a sweep of so much work (s of CPU time).

    Raises
    ------
    ConfigError, BackendError
        If there is no such scheduler.
    """
    if scheduler:
        cluster: Executor = find_named(CLUSTER, "--scheduler")(scheduler)
        return cluster
    count = workers or (1 if cpu_s < _WORTH_PROCESSES_S else cores())
    return InProcess() if count == 1 else Processes(count)
