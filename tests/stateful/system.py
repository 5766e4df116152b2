"""Host backend, supervisor, wire, firmware and plant, a period at a time, with faults switched on and off."""

from __future__ import annotations

import functools
import math
import random
import secrets
from typing import TYPE_CHECKING, NamedTuple
from unittest.mock import patch

from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.errors import DcmpError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import State, Stop
from sim_backend.board.board import Board
from sim_backend.faults.fault_spec import FaultSpec
from sim_backend.faults.plan import FaultPlan
from sim_backend.pacer import Pacer
from tests.helpers import bench
from tests.stateful.host import Host
from tests.stateful.judge import Judge

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.wire.messages import Message
    from sim_backend.faults.fault_model import FaultModel
    from sim_backend.faults.faulty_link import FaultyLink

FAULTS = {
    "wire.drop": {"p": 1.0, "way": "up"},
    "wire.dup": {"p": 1.0},
    "wire.delay": {"ms": 5, "way": "up"},
    "wire.reorder": {"p": 0.5, "depth": 4},
    "wire.flip": {"p": 0.5, "bits": 2},
    "wire.truncate": {"p": 0.3},
    "wire.insert": {"p": 0.3},
    "wire.garbage": {"p": 0.3},
    "wire.hold": {"ms": 30},
    "wire.blackhole": {"p": 1.0, "way": "down"},
    "wire.unplug": {},
    "plant.enc_stuck": {},
    "plant.enc_jump": {"counts": 3000, "times": 3, "every": 2},
    "plant.enc_glitch": {"counts": 500, "times": 3},
    "plant.shove": {"rad_s2": 400.0},
}
"""The faults that can be injected, by kind."""

_TICKING = ("wire.unplug",)  # they do something in every tick
_SEQUENCE_MASK = 0x1FFF
_LEASE_TICKS = 600  # after which a session lapses
_QUIET_TICKS = 60  # after which nothing of an earlier fault is on its way any more
_REST_PERIODS, _WAIT_PERIODS_MAX = 50, 400
_REPEAT_PERIODS = 60  # periods in which a healthy start must have full authority
_NEAR_RAD = 3.0  # rad
_COUNT_RAD = 2.0 * math.tau / 4096  # rad


class Start(NamedTuple):
    """Where the device's counters begin."""

    us: int = 0
    tick: int = 0
    encoder: int = 0


@functools.cache
def rig_at(count: int) -> Rig:
    """Return the bench rig for an encoder that begins there."""
    zero = (count + (1 << 23)) % (1 << 24) - (1 << 23)
    return bench("backend.kind=sim-board", f"encoder.zero={zero}", "sim.engine=python")  # see _unwind


class System:
    """A board, and perhaps a host that runs it.

    Parameters
    ----------
    seed
        Of everything random in it.
    start
        Of the board's counters.
    """

    def __init__(self, seed: int = 0, start: Start = Start()) -> None:  # noqa: B008 - it is immutable
        self.clock, self.rng = SimulatedClock(), random.Random(seed)
        self.board = Board(
            rig_at(start.encoder), start_us=start.us, first_tick=start.tick, count_offset=start.encoder
        )
        self.judge = Judge(first_tick=start.tick, ticked=self._ticked)
        faults = [FaultSpec(kind, math.inf, **params) for kind, params in FAULTS.items()]  # type: ignore[arg-type]
        self.rig = rig_at(start.encoder)
        self._injector = FaultPlan(faults, seed).on(self.rig, self.judge, self.board)
        effects = (timer.effect for timer in self._injector.timers)
        self._effects: dict[str, FaultModel] = dict(zip(FAULTS, effects, strict=True))
        ticking = zip(FAULTS, tuple(self._injector.timers), strict=True)
        self._injector.timers[:] = [timer for kind, timer in ticking if kind in _TICKING]  # for speed
        self._ends: dict[str, int] = {}  # ticks of the board
        self._disturbed = -_QUIET_TICKS  # tick of the board at which the last fault was on
        self._plug_in()
        self.host: Host | None = None
        self.refused = ""  # why the last host could not open it

    @property
    def violations(self) -> list[str]:
        """Violations that were found so far."""
        return self.judge.violations

    @property
    def quiet(self) -> bool:
        """Whether what one side says reaches the other, and has for a while."""
        return self.board.tick_count - self._disturbed > _QUIET_TICKS

    def open(self, *, clear: bool = False) -> bool:
        """Let a host open the device, with --clear or without; False if it cannot, or one has it open."""
        if self.host is not None:
            return False
        backend = DeviceBackend(self.rig, self._plug_in(), self.clock)
        backend.clear = clear
        with patch.object(secrets, "randbelow", self.rng.randrange):
            try:
                backend.__enter__()
            except DcmpError as error:
                self.refused = str(error)
                return False
        self.host = Host(backend, self.judge, self.board.owner)
        return True

    def close(self, error: DcmpError | None = None) -> None:
        """Let it go, in an orderly way or for a reason."""
        if self.host is None:
            return
        backend, self.host = self.host.backend, None
        try:
            backend.__exit__(type(error) if error else None, error, None)
        except DcmpError:
            return
        if self.quiet and self.board.state == State.RUN:
            self.judge.note("the host has gone, and the device runs")

    def period(self, demand: float = 0.0) -> None:
        """Let the host have its period, or the board alone."""
        host = self.host
        if host is None:
            self.alone(1)
            return
        try:
            host.period(demand)
        except DcmpError as error:
            self.close(error)
            return
        if self.quiet:
            self._compare(host)
        over = host.over
        if over is not None:
            host.look_after_trip(demand)
            self.close(over.error())

    def alone(self, ticks: int) -> None:
        """Run the board while the host does nothing."""
        self._link.elapse(ticks)

    def inject_fault(self, kind: str, ticks: int) -> None:
        """Activate a fault for `ticks` ticks."""
        effect = self._effects[kind]
        self._ends[kind] = self.board.tick_count + ticks
        if not effect.on:
            effect.on = True
            effect.begin()

    def say(self, message: Message) -> None:
        """Send a message to the board from another host on the line."""
        self.inject(cobs.encode(pack(message, 0)))

    def stop(self, reason: int) -> None:
        """Send STOP from another host; it has to be obeyed at once."""
        self.inject(b"\0" + cobs.encode(pack(Stop(reason), 0)))
        board = self.board
        if board.state not in (State.BOOT, State.FAULT) or board.applied_mV or board.enable:
            self.judge.note(f"state {board.state}, {board.applied_mV} mV after STOP")

    def inject(self, piece: bytes) -> None:
        """Put bytes on the line to the board."""
        self.judge.heard(piece)
        self.board.receive(piece)

    def seq(self, age: int = 0) -> int:
        """Return the seq of a command that answers a SAMPLE of that age."""
        return (self.judge.newest - age) & _SEQUENCE_MASK

    def reset(self) -> None:
        """Press the board's button."""
        self.board.reset()
        self.judge.was_reset()

    def heal(self) -> None:
        """Let every fault end, the session lapse and the arm come to rest."""
        self.close()
        for kind in tuple(self._ends):
            self._end(kind)
        self.board.link(up=True)
        self.inject(b"\0")  # ends an unfinished frame on the line
        self.alone(_LEASE_TICKS)
        for _ in range(_WAIT_PERIODS_MAX):
            if self.board.truth().velocity == 0.0:
                break
            self.alone(_REST_PERIODS)
        if not abs(self.board.truth().position) < _NEAR_RAD:
            self._unwind()
            self.reset()  # the count went back by whole turns, which a running board would call jumps
        self.alone(_QUIET_TICKS + 1)

    def _unwind(self) -> None:
        """Bring back an arm that hangs whole turns away: travel counts from hanging, over a reset too."""
        pins = self.board.pins
        hanging = math.remainder(pins.truth.position, math.tau)
        pins.truth = pins.truth._replace(position=hanging)
        plant, _ = pins._healthy  # noqa: SLF001 - no part of the program moves an arm by hand
        plant._x1 = hanging  # type: ignore[attr-defined]  # noqa: SLF001

    def run_again(self) -> None:
        """Start as a person does after any removal of a fault: it must reach full authority, and obey."""
        self.heal()
        if not self.open(clear=True):
            self.judge.note(f"healed, it does not open: {self.refused}")
            return
        for _ in range(_REPEAT_PERIODS):
            self.period(0.2)
        host = self.host
        if host is None or not host.has_authority or self.board.state != State.RUN:
            self.judge.note(f"healed, it does not run: device {self.board.state}, fault {self.board.fault}")
        elif self.board.applied_mV != 200:
            self.judge.note(f"healed, {self.board.applied_mV} mV are put out where 200 were asked for")

    def _compare(self, host: Host) -> None:
        """What host and device know of each other, nothing being lost between them."""
        if host.over is not None:
            return
        if self.judge.told != State.RUN:
            self.judge.note(f"the device is in state {self.judge.told}, the host in {host.supervisor.phase}")
        sample, truth = host.sample, self.board.truth()
        if not abs(sample.position - truth.position) < _COUNT_RAD:
            self.judge.note(f"the arm is at {truth.position} rad, the host says {sample.position}")

    def _plug_in(self) -> FaultyLink:
        pace = Pacer(self.clock, self.rig.period)
        self._link = self._injector.attach(self.board, "cobs", pace)
        return self._link

    def _ticked(self) -> None:
        now = self.board.tick_count
        if self._ends:
            self._disturbed = now
            for kind in [kind for kind, end in self._ends.items() if now >= end]:
                self._end(kind)

    def _end(self, kind: str) -> None:
        del self._ends[kind]
        effect = self._effects[kind]
        effect.on = False
        effect.end()
