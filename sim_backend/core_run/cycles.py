"""The cycles of one run in the core: calls of its C, and what it needs in between."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.safety.diagnosis import window_samples
from dcmp_hil.safety.supervisor import Supervisor
from dcmp_hil.telemetry.row_batches import cycle_of
from sim_backend.core_run.parameters import parameters_of
from sim_backend.core_run.reference_rows import ReferenceRows
from sim_backend.core_run.words import CoreEnd, Words

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.loop import LoopStages, StopFlag
    from dcmp_hil.safety.polarity_check import MotorGain
    from dcmp_hil.telemetry.recorder import Recorder
    from dcmp_hil.trip_request import TripRequest
    from dcmp_hil.values import Reference, Sample
    from sim_backend.core_run.library import RunLibrary

_LOG_EVENTS = 256
_TICKS_AT_ONCE = 1 << 15
"""Ticks whose reference is made at once: 2 MB."""
_SPARE_TICKS = 64
_POSITION_ESTIMATE = 4  # place in a row


class CoreCycles:
    """Runs the cycles of a rig in the core; see `dcmp_hil.run_engine.Cycles`.

    Parameters
    ----------
    rig, stages
        That the engine does not refuse.
    recorder
        Takes rows and events.
    library
        The compiled core.
    """

    def __init__(self, rig: Rig, stages: LoopStages, recorder: Recorder, library: RunLibrary) -> None:
        supervisor = stages.supervisor
        assert isinstance(supervisor, Supervisor)  # noqa: S101 - others are refused
        self._rig, self._recorder, self._library = rig, recorder, library
        self._period = rig.period
        constants, structures = library.constants, library.structures
        self._width = constants["RUN_FIELDS"] + len(recorder.further)
        self._words = Words(rig, supervisor, constants)
        self._references = ReferenceRows(rig, structures["run_reference"])
        self._trajectory = Trajectory(rig.reference.source(), rig.reference.soft_start_s)
        self._parameters = parameters_of(rig, stages, library)
        self._state = np.empty(-(-library.state_bytes // 8))
        self._log = np.zeros(_LOG_EVENTS, structures["run_event"])
        self._progress = np.zeros(1, structures["run_progress"])
        self._rows = np.zeros(0, structures["run_reference"])
        self._block, self._filled = np.empty((0, self._width)), 0
        self._last = np.empty((0, self._width))  # rows, for a diagnosis
        self._kept = window_samples(rig.period) + 1
        self._lowers = False
        self._first_position = math.nan  # rad, estimated in the first cycle
        self._progress["began"] = math.inf
        library.begin(_address(self._state), _address(self._parameters))
        self._use(self._rows, 0)

    def run(self, until: float, stop: StopFlag) -> float:
        """Run cycles until `until` (s, device time); return the device time of the last sample, s.

        Raises
        ------
        TripError
            If the supervisor trips; 0 V has been sent by then.
        """
        progress, returns = self._progress, self._library.returns
        needs: dict[str, Callable[[], None]] = {
            "LOG_FULL": lambda: None,  # its events have been taken
            "BEGINS": self._begin,
            "ASKS": self._answer,
            "REFERENCES_USED": self._refer,
        }
        progress["until"], progress["fresh"] = until, 1
        while True:
            self._make_room()
            reason = returns[self._call()]
            if reason in needs:
                needs[reason]()
                continue
            self._deliver()
            if reason == "OVER":
                raise self._request().error()
            if reason == "REACHED" or (stop.requested and not self._is_stopping):
                return self._recorder.t

    def lower(self, t: float) -> None:
        """Let the reference go down to hanging from device time `t` (s) on."""
        if math.isinf(self._trajectory.began):
            self._trajectory.hold(self._first_position)
        self._trajectory.lower(t)
        self._lowers = True
        self._refer()

    @property
    def outliers(self) -> int:
        """Samples left out so far."""
        return int(self._progress["outliers"][0])

    @property
    def motor_gain(self) -> MotorGain | None:
        """Result of the polarity check; None without one, and before its end."""
        gain_known, gain, deviation = (self._number(name) for name in ("gain_known", "gain", "deviation"))
        return self._words.motor_gain(gain, deviation) if gain_known else None

    @property
    def _is_stopping(self) -> bool:
        """Whether the voltage is being led to 0 V."""
        return self._number("phase") == self._library.constants["RUN_STOPPING"]

    def _number(self, name: str) -> float:
        return float(self._progress[name][0])

    def _make_room(self) -> None:
        """Begin a new block where the last one is full."""
        if self._filled == len(self._block):
            self._block, self._filled = np.empty((self._recorder.room, self._width)), 0

    def _call(self) -> int:
        """Run cycles until the block is full, or something is needed; take the events."""
        progress, block, filled = self._progress, self._block, self._filled
        reason = self._library.cycles(
            _address(self._state),
            _address(progress),
            _address(self._rows),
            len(self._rows),
            _address(block) + filled * block.strides[0],
            len(block) - filled,
            _address(self._log),
            len(self._log),
        )
        self._filled += int(progress["rows"][0])
        for tick, code, a, b, _ in self._log[: progress["events"][0]].tolist():
            self._recorder.event(self._words.event(tick * self._period, code, a, b))
        return reason

    def _deliver(self) -> None:
        """Give the recorder the rows of the block."""
        rows, self._block, self._filled = self._block[: self._filled], self._block[:0], 0
        if not len(self._last):
            self._first_position = float(rows[0, _POSITION_ESTIMATE])
        self._last = np.concatenate((self._last, rows[-self._kept :]))[-self._kept :]
        self._recorder.extend(rows)

    def _begin(self) -> None:
        """Begin the trajectory, and make the reference from this cycle on."""
        self._trajectory.begin(self._number("began"), self._number("x0"))
        self._refer()

    def _refer(self) -> None:
        """Make the reference of the next ticks."""
        first = int(self._progress["tick"][0])
        left = self._number("until") / self._period - first
        ticks = range(first, first + int(min(max(left, 0.0) + _SPARE_TICKS, _TICKS_AT_ONCE)))
        if self._lowers:
            self._use(self._references.of_trajectory(ticks, self._trajectory), first)
        else:
            self._use(self._references.of_source(ticks, self._number("began")), first)

    def _use(self, rows: NDArray[np.void], first: int) -> None:
        """Let C take these rows, of ticks from `first` on."""
        progress, references, whole = self._progress, self._references, self._lowers
        self._rows = rows
        progress["first_row"], progress["whole"] = first, whole
        progress["has_now"], progress["has_middle"] = (
            whole or references.has_now,
            whole or references.has_middle,
        )

    def _answer(self) -> None:
        """Give the reference of the instant that C asks for."""
        asked = self._number("asked")
        found: Reference = (
            self._trajectory.at(asked)
            if self._lowers
            else self._references.source(asked - self._number("began"))
        )
        for name, value in zip(("answer_x", "answer_v", "answer_a"), found, strict=True):
            self._progress[name] = value

    def _request(self) -> TripRequest:
        """Return why the run is over."""
        cause = self._library.causes[int(self._progress["cause"][0])]
        t = int(self._progress["cause_tick"][0]) * self._period
        first, second, gain = (self._number(name) for name in ("first", "second", "gain"))
        end = CoreEnd(cause, t, first, second, gain, cycle_of(self._last[-1].tolist()), self._samples)
        request = self._words.request(end)
        return request._replace(orderly=bool(self._number("orderly")))

    def _samples(self) -> list[Sample]:
        """Return the last samples that the watching observer saw, as many as a diagnosis looks at."""
        rows = self._last if self._number("remembers") else self._last[:-1]
        return [cycle_of(row).sample for row in rows[1 - self._kept :].tolist()]


def _address(array: NDArray[np.void] | NDArray[np.float64]) -> int:
    """Return where an array begins, for C."""
    return int(array.ctypes.data)
