"""Every state of host, device and line, 118,285 of them; and errors that the search finds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.safety.supervisor import TRANSITIONS, Phase, PhaseEvent
from tests.stateful.device_model import NEXT, Command, Device, Rules, State
from tests.stateful.pair import SMALL, Model, search, stuck

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.stateful.device_model import Table

pytestmark = pytest.mark.untraced


def test_no_state_of_the_two_breaks_a_rule() -> None:
    model = Model()
    pairs, wrong = search(model)
    assert wrong is None
    assert {pair.host for pair in pairs} >= set(Phase)
    assert {pair.device.state for pair in pairs} == set(State)
    assert len(pairs) > 100_000, f"only {len(pairs)} states"
    assert stuck(model, pairs) is None, f"of {len(pairs)} states"


def _with(event: str, state: State, following: State) -> Table:
    row = list(NEXT[event])
    row[state] = following
    return NEXT | {event: tuple(row)}


class OldCommands(Rules):
    """Takes a command of any age."""

    def accepts(self, device: Device, command: Command) -> bool:
        return super().accepts(device, command._replace(age=min(command.age, self.oldest)))


class Strangers(Rules):
    """Takes a command of every session."""

    def accepts(self, device: Device, command: Command) -> bool:
        return super().accepts(device, command._replace(session=device.owner))


class NoWatchdog(Rules):
    """Holds a voltage for ever."""

    def expired(self, device: Device) -> bool:  # noqa: ARG002
        return False


class KeepsVoltage(Rules):
    """Does not cut the voltage when it leaves RUN."""

    def event(self, device: Device, event: str) -> Device:
        return super().event(device, event)._replace(asked=device.asked, out=device.out)


class NoEdge(Rules):
    """Clears a fault at the first command that says so."""

    def classify(self, device: Device, command: Command, *, close: bool) -> str:
        return super().classify(device._replace(lowered=True), command, close=close)


def _host(phase: Phase, event: PhaseEvent, following: Phase) -> Mapping[Phase, Mapping[PhaseEvent, Phase]]:
    changed = {here: dict(events) for here, events in TRANSITIONS.items()}
    changed[phase][event] = following
    return changed


SIZES = (SMALL.arming, SMALL.oldest, SMALL.watchdog)
SEEDED = {
    "a fault ends by itself": Model(Rules(*SIZES, _with("tick", State.FAULT, State.IDLE))),
    "release clears a fault": Model(Rules(*SIZES, _with("release", State.FAULT, State.IDLE))),
    "one command arms": Model(Rules(*SIZES, _with("arm", State.IDLE, State.RUN))),
    "no watchdog": Model(NoWatchdog(*SIZES)),
    "the watchdog is a period late": Model(Rules(2, 1, 3)),
    "old commands are taken": Model(OldCommands(*SIZES)),
    "strangers' commands are taken": Model(Strangers(*SIZES)),
    "the voltage stays": Model(KeepsVoltage(*SIZES)),
    "clear without its edge": Model(NoEdge(*SIZES)),
    "the host is deaf": Model(deaf=True),
    "TRIPPED is left": Model(table=_host(Phase.TRIPPED, PhaseEvent.ARMED, Phase.PROBING)),
    "a fault only starts again": Model(table=_host(Phase.RUNNING, PhaseEvent.FAULT, Phase.SETTLING)),
    "an orderly end that is forgotten": Model(table=_host(Phase.STOPPING, PhaseEvent.STOPPED, Phase.RUNNING)),
}


@pytest.mark.sampled
@pytest.mark.parametrize("error", SEEDED, ids=str)
def test_search_finds_a_seeded_error(error: str) -> None:
    assert search(SEEDED[error])[1] is not None


STUCK = {
    "a fault is for ever": Model(Rules(*SIZES, _with("clear", State.FAULT, State.FAULT))),
    "it never arms": Model(Rules(*SIZES, _with("arm last", State.ARMING, State.ARMING))),
    "it never settles": Model(table=_host(Phase.SETTLING, PhaseEvent.SETTLED, Phase.SETTLING)),
}


@pytest.mark.sampled
@pytest.mark.parametrize("error", STUCK, ids=str)
def test_search_finds_a_state_without_a_way_to_run(error: str) -> None:
    model = STUCK[error]
    faulty = model.rules.stop(model.rules.tick(model.rules.boot()))
    assert stuck(model, {model.start()._replace(device=faulty)}) is not None
