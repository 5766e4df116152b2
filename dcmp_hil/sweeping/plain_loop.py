"""The engine for everything that a rig may be: one run after another, each by the core or by the loop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Self

from dcmp_hil.errors import BackendError, DcmpError, DeadlineError, TripError
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.session import Session
from dcmp_hil.sweeping.engine import FIGURES, RunOutcome

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.statistics import Summary

FAILED = "error"
"""Cause of an end that was no trip: the device, or a class of the user's own, failed."""


class PlainLoop:
    """Runs one rig after another, each exactly as `dcmp_hil.run(rig, duration=..., fast=True)` does.

    Parameters
    ----------
    faults
        Faults that are injected into every run, as for `dcmp_hil.run`.
    plain
        Whether the loop of the host runs also where the core could.
    """

    def __init__(self, faults: Sequence[str] = (), *, plain: bool = False) -> None:
        self._faults, self._plain = tuple(faults), plain

    @staticmethod
    def refusal(rig: Rig) -> str:
        """Return nothing for a simulated rig, and for a backend of the user's own."""
        if rig.backend.simulated or not rig.backend.device:
            return ""
        return f'backend.kind: got "{rig.backend.kind}", a real device. Sweep a simulated one, "sim".'

    def run(self, rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
        """Run rigs for `duration_s` (s) of device time each."""
        return [self._run(rig, duration_s) for rig in rigs]

    def _run(self, rig: Rig, duration_s: float) -> RunOutcome:
        session = Session(
            rig,
            duration=duration_s,
            fast=True,
            keep_columns=False,
            stop=_Unstopped(),
            faults=self._faults,
            plain=self._plain,
        )
        tripped, time, cause = False, math.nan, ""
        try:
            session.run()
        except (TripError, DeadlineError, BackendError) as error:
            tripped, time, cause = True, _time_of(error, session), getattr(error, "reason", FAILED)
        figures = _figures(session.result().summary)
        return RunOutcome._make((*figures, tripped, time, cause))


class _Unstopped(StopRequest):
    """A request that no signal makes: Ctrl-C ends the sweep, and no run of it is shorter."""

    def __enter__(self) -> Self:
        """Leave the signals alone."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the signals alone."""


def _time_of(error: DcmpError, session: Session) -> float:
    """Return the device time of the last cycle, s."""
    cycles = getattr(error, "cycles", ())
    return float(cycles[-1].sample.t) if cycles else session.result().summary.window_s[1]


def _figures(summary: Summary) -> list[Any]:
    """Return the figures of a run in the order of `RunOutcome`."""
    values = (getattr(summary, name) for name in FIGURES)
    return [math.nan if value is None else value for value in values]
