"""The faults of one run, switched on and off period by period."""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING, Any

from dcmp_hil.values import UNKNOWN_TRUTH
from sim_backend.board.board import Board
from sim_backend.faults.fault_model import FaultContext
from sim_backend.faults.faulty_link import FaultyLink
from sim_backend.faults.firmware import Start, WrongClock
from sim_backend.faults.host import HostFault
from sim_backend.faults.listener import FaultListener
from sim_backend.faults.plant_fault import FaultyEncoder, FaultyPlant, PlantFault
from sim_backend.faults.stages import FaultyBackend, FaultyController, FaultyObserver
from sim_backend.faults.wire import WireFault

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Estimate, Sample, Truth
    from sim_backend.encoder import Encoder
    from sim_backend.faults.fault_model import FaultModel, RigFacts
    from sim_backend.faults.fault_spec import FaultSpec
    from sim_backend.faults.wire import Way
    from sim_backend.pacer import Pacer
    from sim_backend.plant import Plant


class Timer:
    """When a fault is on.

    Parameters
    ----------
    fault
        With its time.
    effect
        Of it.
    period
        s.
    """

    def __init__(self, fault: FaultSpec, effect: FaultModel, period: float) -> None:
        self.effect = effect
        self.began: int | None = None  # tick
        self._when = fault.at if callable(fault.at) else None
        self._first = 0.0 if callable(fault.at) else _ticks(fault.at, period)
        self._length = _ticks(fault.for_, period)

    def look(self, moment: FaultContext) -> None:
        """Activate or deactivate the fault according to the time."""
        if self.began is None:
            if self._when(moment) if self._when else moment.tick >= self._first:
                self.began = moment.tick
                self.effect.on = True
                self.effect.begin()
        elif self.effect.on and moment.tick - self.began >= self._length:
            self.effect.on = False
            self.effect.end()


def _ticks(time: float | str, period: float) -> float:
    """Return an instant or a length in periods: whole numbers are, other numbers are seconds."""
    if isinstance(time, str):
        return -math.inf  # `boot`
    return time if isinstance(time, int) or math.isinf(time) else round(time / period)


class Injector:
    """A plan at work in one run: everything of the rig that can go wrong, with its faults around it.

    Parameters
    ----------
    faults
        The plan's.
    seed
        The plan's.
    facts
        Of the rig.
    listener
        Told of what passes.
    board
        One that is there already; None makes a new one where there is a wire.
    """

    def __init__(
        self,
        faults: Sequence[FaultSpec],
        seed: int,
        facts: RigFacts,
        listener: FaultListener | None = None,
        board: Board | None = None,
    ) -> None:
        self.listener = listener or FaultListener()
        self.board = board
        self.timers: list[Timer] = []
        self._facts = facts
        self._boot: Start | None = None
        self._tick = 0
        self._open = False
        self._first_began: int | None = None
        self._truth: Callable[[], Truth] = lambda: UNKNOWN_TRUTH
        for place, fault in enumerate(faults):
            rng = random.Random(f"{seed} {place} {fault.kind}")  # noqa: S311 - it must repeat itself
            effect = fault.make(facts, rng)
            self.timers.append(Timer(fault, effect, facts.period))
            if isinstance(effect, Start):
                self._boot = effect
        effects = [timer.effect for timer in self.timers]
        self._wire = [effect for effect in effects if isinstance(effect, WireFault)]
        self._plant = [effect for effect in effects if isinstance(effect, PlantFault)]
        self._host = [effect for effect in effects if isinstance(effect, HostFault)]

    def backend(self, factory: Callable[..., Any], rig: Rig, clock: Clock) -> FaultyBackend:
        """Make a simulated backend, with its faults between the plant and the loop."""
        if self._facts.wired:
            board = self.board or Board(rig, carrier=self._facts.carrier, **self._start())
            return FaultyBackend(factory(rig, clock, board=board, link=self.attach), self)
        backend = FaultyBackend(factory(rig, clock, faults=self), self)
        for effect in self._host:
            effect.elapse = lambda seconds: clock.sleep_until_ns(clock.now_ns() + round(1e9 * seconds))
        self.listener.attached(None)
        self._look()
        return backend

    def observer(self, observer: Any) -> FaultyObserver:
        """Return an observer as it is with these faults."""
        return FaultyObserver(observer, self)

    def controller(self, controller: Any) -> FaultyController:
        """Return a controller as it is with these faults."""
        return FaultyController(controller, self)

    def _start(self) -> dict[str, int]:
        """Return how a board is to boot."""
        start = self._boot
        if start is None:
            return {}
        return {
            "start_us": round(start.number("us")),
            "first_tick": round(start.number("tick")),
            "count_offset": round(start.number("count")),
        }

    def attach(self, board: Board, carrier: str, pacer: Pacer) -> FaultyLink:
        """Inject the faults into a board; return the line to it."""
        self.board = board
        board.pins.inject(self)
        self._truth = board.truth
        link = FaultyLink(board, carrier, pacer, self)
        for effect in self._host:
            effect.elapse = lambda seconds: link.elapse(round(seconds / self._facts.period))
        for clock in (timer.effect for timer in self.timers):
            if isinstance(clock, WrongClock):
                clock.of = pacer, board.pins
        self.listener.attached(board)
        self._look()
        return link

    def plant(self, plant: Plant) -> Plant:
        """Return a plant as it is with these faults; without a board its time is that of the faults."""
        if self._facts.wired:
            return FaultyPlant(plant, self, ticking=False)
        faulty = FaultyPlant(plant, self, ticking=True)
        self._truth = lambda: faulty.truth
        return faulty

    def encoder(self, encoder: Encoder) -> Encoder:
        """Return an encoder as it is with these faults."""
        return FaultyEncoder(encoder, self) if self._plant else encoder

    def opened(self) -> None:
        """Call the first sample, which the host is about to read, that of tick 0."""
        self._tick, self._open = -1 if self._facts.wired else 0, True  # a board ticks first

    def tick(self) -> None:
        """Begin a period."""
        self._tick += 1
        self._look()
        for timer in self.timers:
            if timer.effect.on:
                timer.effect.tick(self.board)

    def _look(self) -> None:
        tick = self._tick if self._open else -(10**9)
        moment = FaultContext(tick, tick * self._facts.period, self._truth())
        for timer in self.timers:
            timer.look(moment)
        if self._first_began is None and self.board and any(timer.effect.on for timer in self.timers):
            self._first_began = self.board.tick_count

    @property
    def now(self) -> int:
        """Periods since the first sample."""
        return self._tick

    @property
    def first_began(self) -> int | None:
        """Ticks of the board, from its making, when the first fault began; None if none has, or no board."""
        return self._first_began

    def passed(self, piece: bytes, way: Way) -> list[bytes]:
        """Return the pieces that arrive at once after `piece` was sent."""
        pieces = [piece]
        for effect in self._wire:
            if effect.affects(way):
                pieces = [end for start in pieces for end in effect.change(start, way)]
        return pieces

    def released(self, way: Way) -> list[bytes]:
        """Return the delayed pieces that are due now."""
        return [piece for effect in self._wire for piece in effect.released(way)]

    @property
    def acting_on_plant(self) -> list[PlantFault]:
        """Return the plant faults that are active."""
        return [effect for effect in self._plant if effect.on]

    def sample(self, sample: Sample) -> Sample:
        """Return the sample that the loop gets."""
        for effect in self._host:
            if effect.on:
                sample = effect.sample(sample)
        return sample

    def estimate(self, estimate: Estimate) -> Estimate:
        """Return the estimate that the loop gets from its observer."""
        for effect in self._host:
            if effect.on:
                estimate = effect.estimate(estimate)
        return estimate

    def demand(self, demand: float) -> float:
        """Return the controller's voltage demand that the loop gets, V."""
        for effect in self._host:
            if effect.on:
                demand = effect.demand(demand)
        return demand
