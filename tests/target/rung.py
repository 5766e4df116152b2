"""A board of rung D that a host drives, and what it can be asked."""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dcmp_hil.config import change_rig
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import ParameterGet, ParameterValue, SampleReport, State
from sim_backend.board.backend import SimBoardBackend
from tests.helpers import bench
from tests.target.machine.board import TargetBoard
from tools.boards import read_boards, released

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from dcmp_hil.values import Sample
    from dcmp_hil.wire.messages import Parameter
    from tests.target.machine.system import System
    from tools.boards import Board

BOARDS = read_boards()
RELEASED = released(BOARDS)
DAC, PWM = BOARDS["bench_f405_dac"], BOARDS["bench_f405_pwm"]
STILL = ("model.eta_rad_s2=0.0", "model.eta_amplitude_rad_s2=0.0")  # no disturbance that depends on the time
CARRIERS = ("cobs", "slcan", "can")
COUNT_RAD = 2 * math.pi / 4096
WATCHDOG_US, IWDG_US, FAST_US, TICK_US = 20_000.0, 50_000.0, 2_000.0, 1_000.0
TICK_IRQ, LINK_IRQ = 29, 6
CYCLES_A_MS = 168_000
CONFIG = {
    "counts_per_rev": 4096, "period_us": 1000, "voltage_limit_mV": 10_000, "slew_mV_per_ms": 0,
    "watchdog_ms": 20, "speed_limit_counts_s": 32_768, "travel_limit_counts": 16_384, "node": 0,
}  # fmt: skip


class Rung:
    """A board with a host that drives it."""

    def __init__(self, board: TargetBoard, host: SimBoardBackend) -> None:
        self.board, self.system, self.host = board, board.system, host
        self.k = 0

    def drive(self, periods: int, volts: Callable[[int, Sample], float] = lambda *_: 1.0) -> list[Sample]:
        """Answer `periods` samples with DRIVEs; return the samples."""
        seen = []
        for _ in range(periods):
            sample = self.host.read()
            seen.append(sample)
            self.host.write(volts(self.k, sample))
            self.k += 1
        return seen

    def run_until_off(self, most_us: float) -> float:
        """Let time pass without a host; return when ENABLE went low."""
        until = self.system.now_us + most_us
        while self.system.enable and self.system.now_us < until:
            self.system.run_for(20.0)
        assert not self.system.enable, "it is still on"
        assert self.system.amplifier_mV == 0.0
        return self.system.pins_seen[-1][0]


@contextmanager
def rung(
    f405: Path,
    carrier: str = "cobs",
    *,
    board: Board = DAC,
    supply_V: float = 10.0,
    overrides: Sequence[str] = (),
    **options: object,
) -> Iterator[Rung]:
    """Arm a board over a carrier; a PWM board has a supply."""
    rig = bench("backend.kind=sim-board", f"backend.carrier={carrier}", *STILL, *overrides)
    if board.amplifier == "pwm":
        rig = change_rig(rig, [f"amplifier.supply_V={supply_V}"])
        options.setdefault("supply_mV", 1e3 * supply_V)
    target = TargetBoard(f405 / f"{board.name}.elf", rig, carrier, board=board, **options)
    host = SimBoardBackend(rig, SimulatedClock(), target)  # type: ignore[arg-type]
    host.__enter__()
    yield Rung(target, host)
    assert target.system.misuse == []


def sine(k: int, sample: Sample) -> float:
    """Return a sinusoidal voltage for sample `k`, V."""
    return 6.0 * math.sin(0.02 * k) - 20.0 * sample.position


def never_on(system: System, since_us: float) -> bool:
    """Whether ENABLE was low and the motor without voltage from then on."""
    return all(not on and mV == 0.0 for t, on, mV in system.pins_seen if t > since_us) and not system.enable


def said_of(system: System, parameter: Parameter) -> int:
    """Ask a board that boots over its serial line."""
    receiver = cobs.CobsDecoder()
    system.usart.sent.clear()
    system.usart.hear(cobs.encode(pack(ParameterGet(parameter), 0)))
    system.run_for(3000.0)
    said = [unpack(frame, 0) for frame in receiver.feed(bytes(system.usart.sent))]
    return next(message.value for message in said if isinstance(message, ParameterValue))


def state_of(system: System) -> State:
    """Read the state that a booted board's newest sample shows."""
    system.usart.sent.clear()
    system.run_for(3000.0)
    said = [unpack(frame, 0) for frame in cobs.CobsDecoder().feed(b"\0" + bytes(system.usart.sent))]
    return State([message.state for message in said if isinstance(message, SampleReport)][-1])
