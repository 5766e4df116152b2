"""Host and device as one machine with a line that loses, doubles and reorders, searched exhaustively."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.safety.supervisor import TRANSITIONS, Phase, PhaseEvent
from tests.stateful.device_model import Command, Device, Rules, State

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

SMALL = Rules(arming=2, oldest=1, watchdog=2)
OUR_SESSION, OTHER_SESSION = 1, 2  # sessions
OFF, CLEARING, CLEARED, ARMING, BYE = "off", "clearing", "cleared", "arming the device", "bye"
_POWERED = (Phase.PROBING, Phase.ENGAGING, Phase.RUNNING, Phase.STOPPING)
_ENDS = (Phase.STOPPING, Phase.TRIPPED)
_DEPTH = 2  # commands on the line
_STRANGE = [
    Command(OTHER_SESSION),
    Command(OTHER_SESSION, volts=True),
    Command(OTHER_SESSION, flag=""),
    Command(OTHER_SESSION, flag="clear"),
]
_HEALTHY_PERIODS = 60  # periods


class Pair(NamedTuple):
    """Everything that decides what happens next, and one thing to judge it by."""

    device: Device
    host: str = OFF
    line: tuple[Command, ...] = ()
    told: State | None = None  # a SAMPLE on its way
    silent: int = 0  # periods since a command was accepted, with any effect


class Model:
    """The two together.

    Parameters
    ----------
    rules
        The device's.
    table
        The host's.
    deaf
        Whether the host overlooks that the device has left RUN: an error to find.
    """

    def __init__(
        self,
        rules: Rules = SMALL,
        table: Mapping[Phase, Mapping[PhaseEvent, Phase]] = TRANSITIONS,
        *,
        deaf: bool = False,
    ) -> None:
        self.rules, self.table, self._deaf = rules, table, deaf

    def start(self) -> Pair:
        """Return the pair after power-on."""
        return Pair(self.rules.boot())

    def following(self, pair: Pair) -> Iterator[tuple[str, Pair]]:
        """Yield every possible event and the pair after it."""
        yield from self._time(pair)
        yield from self._line(pair)
        yield from self._host(pair)
        yield from self._others(pair)

    def _time(self, pair: Pair) -> Iterator[tuple[str, Pair]]:
        oldest = self.rules.oldest + 1
        line = tuple(command._replace(age=min(command.age + 1, oldest)) for command in pair.line)
        silent = min(pair.silent + 1, SMALL.watchdog + 2)
        for limit in (False, True):
            device = self.rules.tick(pair.device, limit=limit)
            yield "tick", Pair(device, pair.host, line, device.state, silent)

    def _line(self, pair: Pair) -> Iterator[tuple[str, Pair]]:
        for place, command in enumerate(pair.line):
            rest = pair.line[:place] + pair.line[place + 1 :]
            yield "lost", pair._replace(line=rest)
            heard = self._heard(pair, command)
            yield f"heard {command}", heard._replace(line=rest)
            yield f"heard {command}", heard  # and once more, later
        if pair.told is not None:
            yield "lost", pair._replace(told=None)

    def _heard(self, pair: Pair, command: Command) -> Pair:
        accepted = self.rules.accepts(self.rules.guard(pair.device), command)
        device = self.rules.command(pair.device, command)
        return pair._replace(device=device, silent=0 if accepted else pair.silent)

    def _host(self, pair: Pair) -> Iterator[tuple[str, Pair]]:
        if pair.host == OFF:
            device = self.rules.hello(pair.device, OUR_SESSION)
            if device.owner == OUR_SESSION:
                yield "start", pair._replace(device=device, host=CLEARING, line=(), told=None)
            return
        yield "the host dies", pair._replace(host=OFF)
        if pair.told is not None:
            for host, command in self.answers(pair.host, pair.told):
                line = tuple(sorted({*pair.line, command})) if len(pair.line) < _DEPTH else pair.line
                yield "host", pair._replace(host=host, line=line, told=None)

    def answers(self, host: str, told: State) -> Iterator[tuple[str, Command]]:
        """Return what a host may do about a SAMPLE: where it is then, and what it says."""
        if host == CLEARING:
            yield (
                (CLEARED, Command(OUR_SESSION, flag=""))
                if told == State.FAULT
                else (ARMING, Command(OUR_SESSION))
            )
        elif host == CLEARED:
            yield (
                (ARMING, Command(OUR_SESSION))
                if told == State.IDLE
                else (CLEARED, Command(OUR_SESSION, flag="clear"))
            )
        elif host == ARMING:
            yield (Phase.ARMING if told == State.RUN else ARMING), Command(OUR_SESSION)
        elif host == BYE:
            yield OFF, Command(OUR_SESSION, flag="release")
        else:
            yield from self._supervised(Phase(host), told)

    def _supervised(self, phase: Phase, told: State) -> Iterator[tuple[str, Command]]:
        if phase is Phase.TRIPPED:
            yield BYE, Command(OUR_SESSION, flag="")
        events = self.table[phase]
        if told != State.RUN and not self._deaf and PhaseEvent.FAULT in events:
            phases = [events[PhaseEvent.FAULT]]
        else:
            phases = [phase, *dict.fromkeys(events.values())]
        for following in phases:
            for volts in (False, True) if following in _POWERED else (False,):
                yield following, Command(OUR_SESSION, volts=volts)

    def _others(self, pair: Pair) -> Iterator[tuple[str, Pair]]:
        rules, device = self.rules, pair.device
        for name, after in (
            ("stop", rules.stop(device)),
            ("corruption", rules.corrupt(device)),
            ("unplugged", rules.link(device, up=False)),
            ("plugged in", rules.link(device, up=True)),
            ("lapse", rules.lapse(device)),
            ("their HELLO", rules.hello(device, OTHER_SESSION)),
        ):
            yield name, pair._replace(device=after)
        yield "reset", pair._replace(device=rules.boot())
        if device.owner:
            for command in _STRANGE:
                yield f"heard {command}", self._heard(pair, command)


def violation(before: Pair, event: str, after: Pair) -> str | None:
    """Return what does not hold of a step; None if all does."""
    return (
        _output_violation(event, after)
        or _state_violation(before.device, event, after.device)
        or _command_violation(before, event, after)
        or _host_violation(before, event, after)
    )


def _output_violation(event: str, after: Pair) -> str | None:
    device = after.device
    if (device.out or device.asked) and device.state != State.RUN:
        return "a voltage outside RUN"
    if device.state == State.RUN and event == "tick" and after.silent > SMALL.watchdog:
        return "RUN, and no host has been heard"
    return None


def _state_violation(was: Device, event: str, device: Device) -> str | None:
    if was.state == State.FAULT and device.state not in (State.FAULT, State.BOOT):
        cleared = event.startswith("heard") and "flag='clear'" in event and "volts=False" in event
        if not (was.lowered and cleared):
            return "a fault is left without the owner's edge"
    if device.state == State.RUN != was.state:
        if was.state != State.ARMING:
            return "RUN without ARMING"
        if was.counted + 1 < SMALL.arming:
            return "RUN after too few commands"
    return None


def _command_violation(before: Pair, event: str, after: Pair) -> str | None:
    accepted = after.silent == 0 and before.silent and event.startswith("heard")
    if accepted and ("age=2" in event or f"session={before.device.owner}," not in event):
        return "a command that is too old, or a stranger's, is accepted"
    return None


def _host_violation(before: Pair, event: str, after: Pair) -> str | None:
    if event != "host":
        return None
    live = after.host in set(Phase) - {Phase.TRIPPED}
    if live and before.told != State.RUN:
        return "the host goes on, and the device has said that it is not in RUN"
    if before.host == Phase.TRIPPED and after.host not in (Phase.TRIPPED, BYE):
        return "TRIPPED is left"
    new = set(after.line) - set(before.line)
    if any(command.volts for command in new) and after.host not in _POWERED:
        return "a voltage without authority"
    order = list(Phase)
    if (
        before.host in order
        and after.host in order
        and order.index(Phase(after.host)) < order.index(Phase(before.host))
    ):
        return "the host goes back"
    return None


def search(model: Model) -> tuple[set[Pair], str | None]:
    """Return every state that can be reached, or those up to the first step that does not hold, and why."""
    start = model.start()
    seen, waiting = {start}, [start]
    for pair in waiting:
        for event, after in model.following(pair):
            wrong = violation(pair, event, after)
            if wrong is not None:
                return seen, f"{wrong}: {pair}, {event}, {after}"
            if after not in seen:
                seen.add(after)
                waiting.append(after)
    return seen, None


def stuck(model: Model, pairs: set[Pair]) -> Pair | None:
    """Return a state from which a new host on a healthy line does not get to RUNNING, if there is one."""
    tried: set[Device] = set()
    for pair in pairs:
        device = model.rules.tick(model.rules.link(model.rules.lapse(pair.device), up=True))
        if device not in tried:
            tried.add(device)
            if not _reaches(model, device):
                return pair
    return None


def _reaches(model: Model, device: Device) -> bool:
    rules = model.rules
    for _ in range(rules.watchdog + 2):  # the host before is silent, and its session lapses
        device = rules.tick(device)
    device, host = rules.hello(rules.lapse(device), OUR_SESSION), CLEARING
    for _ in range(_HEALTHY_PERIODS):
        device = rules.tick(device)
        answers = [answer for answer in model.answers(host, device.state) if answer[0] not in _ENDS]
        if not answers:
            return False
        host, command = answers[-1]  # as far on as can be, with a voltage
        device = rules.command(device, command)
        if host == Phase.RUNNING and device.state == State.RUN and device.asked:
            return True
    return False
