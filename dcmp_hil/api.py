"""The function `run` of the Python API: one run of a rig, from rig to result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.errors import DcmpError
from dcmp_hil.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.sink_factories import SinkMaker


def simulate(
    rig: Rig,
    duration: float | None = None,
    *,
    window_from: float = 0.0,
    sinks: Sequence[Sink | SinkMaker] = (),
    faults: Iterable[object] = (),
    compare: Sequence[str] = (),
    plain: bool = False,
) -> Result:
    """Run a simulated rig in virtual time, as fast as the arithmetic: a thousand times real time at 1 kHz.

    The result is that of `run(rig, duration=duration, fast=True)`, which does the same: whole cycles are
    computed in the compiled core where it can do all that the rig asks for, else in the loop of the host.
    `Result.engine` tells which of them it was, and `Result.engine_reason` why. Both give the same bits.

    Parameters
    ----------
    rig
        From `load_rig`, a simulated one.
    duration
        s of device time; None takes the rig's own `run.duration_s`.
    window_from, sinks, faults, compare
        As for `run`.
    plain
        Whether the loop of the host runs also where the core could.

    Returns
    -------
    Result
        Columns, summary and events.

    Raises
    ------
    ConfigError, TripError, DeadlineError, BackendError
        As `run` does.
    """
    session = Session(
        rig,
        duration=duration,
        fast=True,
        window_from=window_from,
        sinks=sinks,
        faults=faults,
        compare=compare,
        plain=plain,
    )
    return _result_of(session)


def run(
    rig: Rig,
    *,
    duration: float | None = None,
    fast: bool = False,
    window_from: float = 0.0,
    sinks: Sequence[Sink | SinkMaker] = (),
    faults: Iterable[object] = (),
    clear: bool = False,
    compare: Sequence[str] = (),
) -> Result:
    """Run a rig and return its cycles as columns and its figures.

    Parameters
    ----------
    rig
        From `load_rig`.
    duration
        s of device time; None takes the rig's own `run.duration_s`; 0 is until Ctrl-C.
    fast
        Virtual time instead of the wall's pace (simulated rig only); such runs repeat to the bit.
    window_from
        s, device time from which the summary's figures count.
    sinks
        Further sinks of the run, or better functions that make one, such as
        ``partial(RerunSink, rig=view_of(rig), record=Path("run.rrd"), viewer="spawn")``. In real time a
        function that can be pickled is called in the telemetry process, beside the loop; a sink that is there
        already runs on a thread of this process, which costs the loop its punctuality.
    faults
        What goes wrong on purpose on a simulated rig: texts as behind `dcmp-hil run --fault`, such as
        ``["wire.drop:p=0.2,at=3s,for=1s", "plant.shove:at=2s"]``, or objects
        ``FaultSpec("plant.shove", at=2.0, rad_s2=300)`` of `sim_backend.faults.fault_spec`, whose `at` may
        be a function of time and true state. Everything random in them follows from `sim.seed`. Faults of the
        wire and of the firmware need `backend.kind = "sim-board"`.
    clear
        Whether a fault of an earlier run that waits for a person is cleared; see `Session`.
    compare
        Kinds of observers, such as ``("kalman", "derivative")``, that run beside the loop on the same samples
        and act on nothing. Their estimates are further columns (``velocity_kalman_rad_s``);
        `dcmp_hil.comparison.compare_result` makes the table.

    Returns
    -------
    Result
        Columns, summary and events. After Ctrl-C: of what ran until then.

    Raises
    ------
    ConfigError
        If an argument does not fit the rig.
    TripError
        If the supervisor stopped the run; `.result` holds what there is of it, `.cycles` its last second.
    DeadlineError
        If `timing` enforces real time that is not granted, or ends a late run; with `.result`.
    BackendError
        If the device or the way to it fails; with `.result`.
    """
    session = Session(
        rig,
        duration=duration,
        fast=fast,
        window_from=window_from,
        sinks=sinks,
        faults=faults,
        clear=clear,
        compare=compare,
    )
    return _result_of(session)


def _result_of(session: Session) -> Result:
    """Run to the end; give the error that ends it its result."""
    try:
        session.run()
    except DcmpError as error:
        error.result = session.result()
        raise
    return session.result()
