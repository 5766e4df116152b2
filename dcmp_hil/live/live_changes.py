"""The loop's side of live changes: one look a period, and a change that no voltage shows as a step."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple, Protocol, cast

from dcmp_hil.ipc.mailbox import APPLIED, BELL_WORD, FAILED, LOWERING, Answer
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.safety.supervisor import Phase
from dcmp_hil.values import ChangeData, Event, EventKind, PhaseData

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.control.change import Change
    from dcmp_hil.control.controllers import Controller
    from dcmp_hil.control.observers import Observer
    from dcmp_hil.control.trajectory import Trajectory
    from dcmp_hil.ipc.mailbox import Mailbox
    from dcmp_hil.safety.chatter import Chatter

GAIN_RAMP_TIME_S = 0.25  # s, over which gains go from old to new
_PHASE_NUMBERS = {phase.value: place for place, phase in enumerate(Phase)}
_LISTED_CHANGES_MAX = 1000  # changes that the summary lists
_EVERY_CYCLE = -1  # no number of the bell: there is something to do every cycle
_OTHER_HANDLERS = (
    "Something in this process sets or blocks signals that end a run ({names}); they end it as before. Take "
    "the calls of signal.signal and pthread_sigmask out of the class of your own, or have the library leave "
    "signals alone (rclpy: init(signal_handler_options=SignalHandlerOptions.NO))."
)


class Changes(Protocol):
    """Protocol of the changes that are applied between two cycles."""

    def apply(self, t: float) -> None:
        """Apply what waits, between the period of device time `t` (s) and the next."""
        ...


class NoChanges:
    """Nothing ever changes."""

    def apply(self, t: float) -> None:
        """Do nothing: no changes are accepted."""


class LiveChanges:
    """Applies the changes that clients put into a mailbox.

    Gains are ramped, an observer keeps its estimates, a reference keeps position, velocity and acceleration:
    the voltage has no step.

    Parameters
    ----------
    mailbox
        One number of it is looked at every cycle.
    trajectory, controller, observer
        What is changed; a controller or observer of one's own never is.
    delay
        s, from a sample to the instant at which its command acts.
    notify
        Told of every change.
    stop
        Asked for the end where the mailbox says STOP.
    chatter
        Told what variation of the voltage is expected afterwards.

    Attributes
    ----------
    made
        What was changed, in words, up to the first thousand.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        trajectory: Trajectory,
        controller: Controller,
        observer: Observer,
        *,
        delay: float,
        notify: Callable[[Event], None],
        stop: StopRequest | None = None,
        chatter: Chatter | None = None,
    ) -> None:
        self._mailbox, self._words = mailbox, mailbox.words
        self._trajectory, self._controller, self._observer = trajectory, controller, observer
        self._delay = delay
        self._notify, self._chatter = notify, chatter
        self._stop = stop or StopRequest()
        self._seen = mailbox.words[BELL_WORD]
        self._number = mailbox.asked
        self._handlers = mailbox.handlers_asked
        self._refused = False
        self._ramp: _Ramp | None = None
        self._news: deque[str] = deque()
        self.made: list[str] = []

    def apply(self, t: float) -> None:
        """Apply what waits, between the period of device time `t` (s) and the next."""
        if self._words[BELL_WORD] != self._seen:
            self._look(t)

    def event(self, event: Event) -> None:
        """Pass an event on; a new phase is shown in the mailbox."""
        if isinstance(event.data, PhaseData):
            self._mailbox.tell_phase(_PHASE_NUMBERS[event.data.phase])
        self._notify(event)

    def warn(self, sentence: str) -> None:
        """Ask the loop to report a warning; called from another thread."""
        self._news.append(sentence)
        self._seen = _EVERY_CYCLE

    def _look(self, t: float) -> None:
        bell = self._words[BELL_WORD]  # before the rest: what comes meanwhile rings again
        if asked_by := self._mailbox.take_stop():
            self._stop.ask(asked_by)
        if self._mailbox.handlers_asked != self._handlers:
            self._handlers = self._mailbox.handlers_asked
            self._keep_handlers(t)
        number = self._mailbox.asked
        if number != self._number:
            self._number = number
            self._take(number, t)
        if self._ramp is not None and self._ramp.over(t):
            self._ramp = None
        self._seen = bell if self._ramp is None else _EVERY_CYCLE
        while self._news:
            self._notify(Event(t, "WARN", EventKind.CONTROL, self._news.popleft()))

    def _keep_handlers(self, t: float) -> None:
        """Restore the signal handlers; report once that others were set."""
        self._stop.reinstall()
        if self._stop.refused and not self._refused:
            self._refused = True
            names = ", ".join(sorted(number.name for number in self._stop.refused))
            self._notify(Event(t, "WARN", EventKind.CONTROL, _OTHER_HANDLERS.format(names=names)))

    def _take(self, number: int, t: float) -> None:
        try:
            change = self._mailbox.take()
            if change is None:
                return
            what = self._make(change, t)
        except Exception as error:  # noqa: BLE001 - with any content of the slot, the run goes on
            self._mailbox.reply(number, Answer(FAILED, t))
            sentence = f"a change could not be applied: {error!r}"
            self._notify(Event(t, "WARN", EventKind.CONTROL, sentence))
            return
        self._mailbox.reply(number, Answer(what, t))
        if what == APPLIED:
            sentence = f"{change.words}, applied at t = {t:.3f} s"
            self._notify(Event(t, "INFO", EventKind.CHANGE, sentence, ChangeData(change.values)))
            if len(self.made) < _LISTED_CHANGES_MAX:
                self.made.append(sentence)

    def _make(self, change: Change, t: float) -> int:
        if change.reference is not None:
            if self._trajectory.lowering:
                return LOWERING
            self._trajectory.change(t + self._delay, change.reference)
        if change.tuning is not None:
            cast("_Tuned", self._observer).retune(change.tuning)
        if change.gains is not None:
            self._ramp = _Ramp(cast("_Geared", self._controller), change.gains, t)
        if change.variation is not None and self._chatter is not None:
            self._chatter.expect(change.variation)
        return APPLIED


class _Tuned(Protocol):
    """An observer whose settings have tunable keys: a tuning is sent to no other."""

    def retune(self, tuning: object) -> None: ...


class _Geared(Protocol):
    """A controller whose settings have gains: gains are sent to no other."""

    gains: NamedTuple


class _Ramp:
    """Gains on their way."""

    def __init__(self, controller: _Geared, wanted: NamedTuple, t: float) -> None:
        self._controller, self._wanted, self._t0 = controller, wanted, t
        self._from = controller.gains

    def over(self, t: float) -> bool:
        """Set the gains of device time `t`, s; tell whether they are the wanted ones."""
        s = min(max((t - self._t0) / GAIN_RAMP_TIME_S, 0.0), 1.0)
        between = (a + s * (b - a) for a, b in zip(self._from, self._wanted, strict=True))
        self._controller.gains = self._wanted._make(between) if s < 1.0 else self._wanted
        return s == 1.0
