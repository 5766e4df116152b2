"""One cell of the matrix: a row of faults, a seed, a run in virtual time, and the oracle's judgement."""

from __future__ import annotations

import math
import random
import re
import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple
from unittest.mock import patch

import numpy as np

from dcmp_hil import load_rig
from dcmp_hil.errors import TripError
from dcmp_hil.session import Session
from dcmp_hil.values import Fault as Code
from dcmp_hil.wire.messages import State
from sim_backend.board.board import Board
from sim_backend.faults.fault_spec import FaultSpec
from sim_backend.faults.plan import FaultPlan
from tests.faults.oracle import Oracle

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config import Rig
    from sim_backend.faults.injector import Injector
    from tests.faults.rows import Row

_WHOLE = ((1.3, 1.6), 2.3)  # s: when the fault comes, and the end of the run
_SHORT = ((0.35, 0.65), 1.35)  # the same without probe and ramp, for faults that do not care for them
_CARELESS = ("wire.", "host.")
_AFTER_TICKS = 60  # ticks that the board goes on without a host
_LEASE_TICKS = 600  # ticks after which the device has forgotten its host
_REST_TICKS, _WAIT_TICKS_MAX = 200, 60  # ticks that the arm must rest; so many times
_FOLLOWS_WITHIN, _FOLLOWS_MRAD = 2.85, 5.0  # s: 0.85 of start, 2
_RIG = ("backend.kind=sim-board", "reference.soft_start_s=0.5")


class Verdict(NamedTuple):
    """Result of one run."""

    outcome: str
    right: bool  # the outcome is one of the row's
    reaction_ms: (
        float  # from the fault to 0 V, by the firmware's clock; NaN if it never was armed, or goes on
    )
    violations: tuple[str, ...]


class Bench(NamedTuple):
    """Rig, plan, board and oracle of a run before its start."""

    rig: Rig
    length: float  # s, device time
    again: Rig  # the rig of a start afterwards
    plan: FaultPlan
    board: Board
    oracle: Oracle


def judge(row: Row, seed: int, *, rearm: bool = False, make: type[Board] = Board) -> Verdict:
    """Run a row with a seed, and judge it; on request start again afterwards, without the fault."""
    bench = prepare(row, seed, make)
    injector = bench.plan.on(bench.rig, bench.oracle, bench.board)
    with same_session(seed):
        session = Session(bench.rig, duration=bench.length, fast=True, faults=injector)
        outcome = outcome_of(session)
        verdict = _verdict(bench, row, injector, session, outcome)
        if rearm and row.rearms:
            return verdict._replace(violations=verdict.violations + start_again(bench, seed))
    return verdict


def judge_plain(row: Row, seed: int) -> Verdict:
    """Do the same on the plain simulated rig, as far as there is something to judge."""
    bench = prepare(row, seed, Board, "backend.kind=sim")
    injector = bench.plan.on(bench.rig, bench.oracle)
    session = Session(bench.rig, duration=bench.length, fast=True, faults=injector)
    outcome = outcome_of(session)
    columns, at = session.result().columns, bench.plan.faults[0].at
    begins = at if isinstance(at, float) else 0.0
    times = columns["time_s"][np.isfinite(columns["time_s"])] if len(columns) else ()
    end = max(times, default=0.0)
    found = [*bench.oracle.violations]
    reaction = math.nan if row.bound_ms is None else 1e3 * (end - begins)
    if row.bound_ms is not None and not reaction <= row.bound_ms:
        found.append(f"the end came after {reaction:.1f} ms; the bound is {row.bound_ms}")
    peak = max(map(abs, columns["position_true_rad"]), default=0.0)
    if not peak <= row.most_rad:
        found.append(f"|x| reached {peak:.2f} rad; the envelope is {row.most_rad}")
    if outcome == "completed" and row.settled_mrad is not None:
        found += _unsettled(session, bench.length - 0.1, row.settled_mrad)
    return Verdict(outcome, outcome in row.right, reaction, tuple(found))


def prepare(row: Row, seed: int, make: type[Board], *overrides: str) -> Bench:
    """Make rig, plan, board and oracle of a cell; everything about them follows from the seed."""
    rng = random.Random(f"{row.name} {seed}")
    fault = FaultSpec.of(row.fault)
    drawn = not re.search("[:,]at=", row.fault)
    short = drawn and row.fault.startswith(_CARELESS)
    window, length = _SHORT if short else _WHOLE
    if drawn:
        fault.at = rng.uniform(*window)
    arguments = _start(fault)
    phase = f"sim.encoder_phase_counts={rng.random():.4f}"
    zero = (arguments.get("count_offset", 0) + (1 << 23)) % (1 << 24) - (1 << 23)
    said = (*_RIG, phase, f"encoder.zero={zero}", *row.overrides, *overrides)
    again = load_rig("bench-1khz", said)
    rig = load_rig("bench-1khz", (*said, "supervisor.start=immediate")) if short else again
    plan = FaultPlan([fault], seed)
    oracle = Oracle(first_tick=arguments.get("first_tick", 0))
    return Bench(rig, length, again, plan, make(rig, carrier="cobs", **arguments), oracle)


def _start(fault: FaultSpec) -> dict[str, int]:
    """Return how the board boots."""
    if fault.kind != "firmware.start":
        return {}
    names = {"us": "start_us", "tick": "first_tick", "count": "count_offset"}
    return {name: int(float(fault.params[key])) for key, name in names.items()}


def outcome_of(session: Session) -> str:
    """Run, and return in a word how it ended: `completed`, a trip's reason, a device's fault, or an error."""
    try:
        session.run()
    except TripError as trip:
        if trip.reason != "device_fault":
            return trip.reason
        return Code(trip.cycles[-1].sample.fault).name
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        return type(error).__name__
    return "completed"


def _verdict(bench: Bench, row: Row, injector: Injector, session: Session, outcome: str) -> Verdict:
    board, oracle = bench.board, bench.oracle
    goes_on = row.bound_ms is None
    _alone(bench, _AFTER_TICKS)
    reaction = math.nan if goes_on else _reaction(bench, injector)
    found = [*oracle.violations]
    if not goes_on and not reaction <= (row.bound_ms or 0.0):
        found.append(f"0 V after {reaction:.1f} ms; the bound is {row.bound_ms}")
    if not oracle.peak_rad <= row.most_rad:
        found.append(f"|x| reached {oracle.peak_rad:.2f} rad; the envelope is {row.most_rad}")
    if not oracle.peak_rad_s <= row.most_rad_s:
        found.append(f"|x'| reached {oracle.peak_rad_s:.2f} rad/s; the envelope is {row.most_rad_s}")
    if board.state == State.RUN or board.applied_mV:
        found.append(f"state {board.state}, {board.applied_mV} mV long after the host has gone")
    if outcome == "completed" and row.settled_mrad is not None:
        found += _unsettled(session, bench.length - 0.1, row.settled_mrad)
    return Verdict(outcome, outcome in row.right, reaction, tuple(found))


def _reaction(bench: Bench, injector: Injector) -> float:
    """Return how long it was to 0 V, ms; 0 if the amplifier was off already."""
    began = injector.first_began
    off = bench.oracle.off_at
    if began is None or not bench.oracle.ran:
        return 0.0
    return math.inf if off is None else max(0.0, 1e3 * bench.rig.period * (off - began))


def _alone(bench: Bench, ticks: int) -> int:
    """Let the board go on without a host; return for how long the arm has been at rest, ticks."""
    board, oracle, still = bench.board, bench.oracle, 0
    for _ in range(ticks):
        board.tick()
        oracle.said(board.transmit())
        oracle.fetched()
        still = still + 1 if board.truth().velocity == 0.0 else 0
    return still


def _unsettled(session: Session, since: float, most_mrad: float) -> list[str]:
    columns = session.result().columns
    error = np.abs(columns["tracking_error_mrad"][columns["time_s"] >= since])
    worst = float(np.max(error, initial=0.0))
    return [] if worst <= most_mrad and len(error) else [f"{worst:.1f} mrad off; {most_mrad} are allowed"]


def start_again(bench: Bench, seed: int) -> tuple[str, ...]:
    """Remove the fault, wait for the arm to rest, run again: it must follow within 2 s of RUNNING."""
    board, oracle = bench.board, bench.oracle
    board.link(up=True)
    healthy = FaultPlan(seed=seed).on(bench.again, oracle, board)
    session = Session(
        bench.again, duration=_FOLLOWS_WITHIN, fast=True, faults=healthy, clear=True
    )  # a person starts it, and from here on the plant is well
    before = len(oracle.violations)
    _alone(bench, _LEASE_TICKS)
    for _ in range(_WAIT_TICKS_MAX):
        if _alone(bench, _REST_TICKS) == _REST_TICKS:
            break
    outcome = outcome_of(session)
    found = oracle.violations[before:]
    if outcome != "completed":
        return tuple(f"again: {words}" for words in (outcome, *found))
    found += _unsettled(session, _FOLLOWS_WITHIN - 0.2, _FOLLOWS_MRAD)
    return tuple(f"again: {words}" for words in found)


@contextmanager
def same_session(seed: int) -> Iterator[None]:
    """Let the host choose the same sessions every time: their bytes decide what a flipped bit does."""
    rng = random.Random(seed)
    with patch.object(secrets, "randbelow", rng.randrange):
        yield
