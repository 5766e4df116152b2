"""The host's table of states, searched exhaustively: what must hold, and that the search would notice."""

from __future__ import annotations

import copy
from itertools import product

import pytest

from dcmp_hil.safety.supervisor import TRANSITIONS, Phase, PhaseEvent

Table = dict[Phase, dict[PhaseEvent, Phase]]
Path = tuple[Phase, ...]

ORDER = [
    Phase.ARMING, Phase.PROBING, Phase.SETTLING, Phase.ENGAGING, Phase.RUNNING, Phase.STOPPING,
]  # fmt: skip


def table() -> Table:
    return {phase: dict(events) for phase, events in TRANSITIONS.items()}


def paths(of: Table) -> list[Path]:
    """Return every way from ARMING on that visits no phase twice but the last."""
    found: list[Path] = []
    open_: list[Path] = [(Phase.ARMING,)]
    while open_:
        path = open_.pop()
        found.append(path)
        for following in set(of[path[-1]].values()):
            if path.count(following) == 0:
                open_.append((*path, following))
            else:
                found.append((*path, following))
    return found


def violations(of: Table) -> list[str]:
    """Return the requirements that a table violates."""
    every = paths(of)
    wrong = []
    if of[Phase.TRIPPED]:
        wrong.append("something leads out of TRIPPED")
    wrong += [
        f"a fault does not lead from {phase} to TRIPPED"
        for phase in Phase
        if phase is not Phase.TRIPPED and of[phase].get(PhaseEvent.FAULT) is not Phase.TRIPPED
    ]
    wrong += [
        f"a concern does not end {phase}"
        for phase in ORDER[:-1]
        if of[phase].get(PhaseEvent.CONCERN) not in (Phase.STOPPING, Phase.TRIPPED)
    ]
    if set(of[Phase.STOPPING].values()) != {Phase.TRIPPED}:
        wrong.append("STOPPING leads elsewhere than to TRIPPED")
    wrong += [
        f"{phase} has no voltage to shrink"
        for phase in Phase
        if Phase.STOPPING in of[phase].values() and phase not in (Phase.ENGAGING, Phase.RUNNING)
    ]
    for path in every:
        steps = [phase for phase in path if phase is not Phase.TRIPPED]
        places = [ORDER.index(phase) for phase in steps]
        if places != sorted(set(places)):
            wrong.append(f"it goes back: {path}")
        if Phase.RUNNING in path and not {Phase.SETTLING, Phase.ENGAGING} <= set(path):
            wrong.append(f"full authority without settling and ramp: {path}")
    reached = {phase for path in every for phase in path}
    wrong += [f"{phase} is never reached" for phase in Phase if phase not in reached]
    wrong += [
        f"{event} leads from {phase}, and nothing else may lead to full authority"
        for phase, event in product(Phase, PhaseEvent)
        if of[phase].get(event) is Phase.RUNNING and event is not PhaseEvent.ENGAGED
    ]
    return wrong


def test_table_holds_what_it_must() -> None:
    assert violations(table()) == []


SEEDED = {
    "out of TRIPPED": (Phase.TRIPPED, PhaseEvent.ARMED, Phase.PROBING),
    "straight to RUNNING": (Phase.ARMING, PhaseEvent.ARMED_UNPROBED, Phase.RUNNING),
    "no settling after the probe": (Phase.PROBING, PhaseEvent.PROBED, Phase.ENGAGING),
    "no ramp": (Phase.SETTLING, PhaseEvent.SETTLED, Phase.RUNNING),
    "a fault that only starts again": (Phase.ENGAGING, PhaseEvent.FAULT, Phase.SETTLING),
    "back to the probe": (Phase.RUNNING, PhaseEvent.SETTLED, Phase.PROBING),
    "a concern that is forgotten": (Phase.STOPPING, PhaseEvent.STOPPED, Phase.RUNNING),
    "a concern that only starts again": (Phase.ENGAGING, PhaseEvent.CONCERN, Phase.SETTLING),
    "an orderly end without authority": (Phase.PROBING, PhaseEvent.CONCERN, Phase.STOPPING),
}


@pytest.mark.parametrize("error", SEEDED, ids=str)
def test_search_finds_a_seeded_error(error: str) -> None:
    phase, event, following = SEEDED[error]
    changed = copy.deepcopy(table())
    changed[phase][event] = following
    assert violations(changed)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.TRIPPED])
def test_search_finds_a_fault_that_leads_nowhere(phase: Phase) -> None:
    changed = table()
    del changed[phase][PhaseEvent.FAULT]
    assert violations(changed)
