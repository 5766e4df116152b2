"""Rung D: the bench board's own program, unmodified, on the machine; its host is the real backend."""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.clock import SimulatedClock
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Parameter, State
from sim_backend.board import Board
from sim_backend.sim_board import SimBoardBackend
from tests.helpers import bench
from tests.target.machine.board import TargetBoard
from tests.target.machine.system import STACK_TOP_OF_BOARD, System
from tools.record import RecordLink, image, record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from dcmp_hil.values import Sample

STILL = ("model.eta_rad_s2=0.0", "model.eta_amplitude_rad_s2=0.0")  # no disturbance that depends on the time
CARRIERS = ("cobs", "slcan", "can")
COUNT_RAD = 2 * math.pi / 4096
WATCHDOG_US, IWDG_US, FAST_US, TICK_US = 20_000.0, 50_000.0, 2_000.0, 1_000.0
TICK_IRQ, LINK_IRQ, BREAK_PIN = 29, 6, 12
CYCLES_A_MS = 168_000
CONFIG = {
    "counts_per_rev": 4096, "period_us": 1000, "voltage_limit_mV": 10_000, "slew_mV_per_ms": 0,
    "watchdog_ms": 20, "speed_limit_counts_s": 32_768, "travel_limit_counts": 16_384, "node": 0,
}  # fmt: skip


class Rung:
    """A board that a host drives."""

    def __init__(self, board: TargetBoard, host: SimBoardBackend) -> None:
        self.board, self.system, self.host = board, board.system, host
        self.k = 0

    def drive(self, periods: int, volts: Callable[[int, Sample], float] = lambda *_: 1.0) -> list[Sample]:
        """Answer so many samples."""
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
def rung(f405: Path, carrier: str = "cobs", *, kind: str = "dac", **options: object) -> Iterator[Rung]:
    """Arm a board over a carrier."""
    rig = bench("backend.kind=sim-board", f"backend.carrier={carrier}", *STILL)
    board = TargetBoard(f405 / f"bench_f405_{kind}.elf", rig, carrier, **options)
    host = SimBoardBackend(rig, SimulatedClock(), board)  # type: ignore[arg-type]
    host.__enter__()
    yield Rung(board, host)
    assert board.system.misuse == []


def sine(k: int, sample: Sample) -> float:
    return 6.0 * math.sin(0.02 * k) - 20.0 * sample.position


def never_on(system: System, since_us: float) -> bool:
    """Whether ENABLE was low and the motor without voltage from then on."""
    return all(not on and mV == 0.0 for t, on, mV in system.pins_seen if t > since_us) and not system.enable


def said_of(system: System, parameter: Parameter) -> int:
    """Ask a board that boots over its serial line."""
    from dcmp_hil.wire import cobs
    from dcmp_hil.wire.codec import pack, unpack
    from dcmp_hil.wire.messages import ParameterGet, ParameterValue

    receiver = cobs.Receiver()
    system.usart.sent.clear()
    system.usart.hear(cobs.encode(pack(ParameterGet(parameter), 0)))
    system.run_for(3000.0)
    said = [unpack(frame, 0) for frame in receiver.feed(bytes(system.usart.sent))]
    return next(message.value for message in said if isinstance(message, ParameterValue))


def state_of(system: System) -> State:
    """Read the state that a booted board's newest sample shows."""
    from dcmp_hil.wire import cobs
    from dcmp_hil.wire.codec import unpack
    from dcmp_hil.wire.messages import SampleReport

    system.usart.sent.clear()
    system.run_for(3000.0)
    said = [unpack(frame, 0) for frame in cobs.Receiver().feed(b"\0" + bytes(system.usart.sent))]
    return State([message.state for message in said if isinstance(message, SampleReport)][-1])


# ------------------------------------------------------------------------------------------- closed loop


@pytest.mark.parametrize("carrier", CARRIERS)
def test_closed_loop_is_that_of_the_core(f405: Path, carrier: str, figure: Callable[[str], None]) -> None:
    rig = bench("backend.kind=sim-board", f"backend.carrier={carrier}", *STILL)
    with SimBoardBackend(rig, SimulatedClock(), Board(rig, carrier=carrier)) as backend:
        core = []
        for k in range(300):
            core.append(backend.read())
            backend.write(sine(k, core[-1]))
    with rung(f405, carrier) as target:
        seen = target.drive(300, sine)
        target.host.__exit__(None, None, None)
        assert not target.system.enable
    assert [sample.t for sample in seen] == [sample.t for sample in core]
    furthest = max(abs(a.position - b.position) for a, b in zip(seen, core, strict=True))
    assert furthest <= 2 * COUNT_RAD  # the DAC's steps of 5 mV are all that is different
    assert max(abs(sample.voltage) for sample in seen) > 2.0
    stack = STACK_TOP_OF_BOARD - target.system.lowest_stack
    figure(
        f"rung D over {carrier}: stack {stack} B deep, {furthest / COUNT_RAD:.0f} counts from the core alone"
    )
    assert stack < 2048


@pytest.mark.parametrize("seed", range(3))
def test_interrupts_anywhere_change_nothing(f405: Path, seed: int) -> None:
    with rung(f405, "cobs", preempt=seed) as target:
        seen = target.drive(100, sine)
    with rung(f405, "cobs") as calm:
        expected = calm.drive(100, sine)
    assert [(s.t, s.position, s.voltage) for s in seen] == [(s.t, s.position, s.voltage) for s in expected]
    assert target.system.faults == []


@pytest.mark.parametrize("carrier", CARRIERS)
def test_tick_costs_a_tenth_of_a_millisecond_at_most(
    f405: Path, carrier: str, figure: Callable[[str], None]
) -> None:
    with rung(f405, carrier) as target:
        before = target.system.instructions
    with rung(f405, carrier, exact=True) as target:
        target.drive(5, sine)
        target.system.cpu.counts.clear()
        ticks, before = target.board.ticks, target.system.instructions
        target.drive(20, sine)
        ticks = target.board.ticks - ticks
        handlers = sum(sum(counts) for counts in target.system.cpu.counts.values()) / ticks
        longest = max(target.system.cpu.counts[16 + TICK_IRQ])
        everything = (target.system.instructions - before) / ticks
    figure(
        f"rung D over {carrier}: {handlers:.0f} instructions a period in interrupts "
        f"({longest} in the longest tick), {everything:.0f} in all, of {CYCLES_A_MS} cycles"
    )
    assert everything < 0.1 * CYCLES_A_MS


# ------------------------------------------------------------------------------------------- the way there


@pytest.mark.parametrize("kind", ["dac", "pwm"])
@pytest.mark.parametrize("carrier", CARRIERS)
def test_nothing_reaches_the_motor_before_it_is_armed(f405: Path, kind: str, carrier: str) -> None:
    with rung(f405, carrier, kind=kind) as target:
        armed = next(t for t, on, _ in target.system.pins_seen if on)
        assert all(mV == 0.0 for t, on, mV in target.system.pins_seen if t < armed)
        assert armed > 10_000.0  # the tenth DRIVE
        target.drive(3)
        assert target.system.amplifier_mV == pytest.approx(1000.0, abs=5.0)


def test_bridge_turns_either_way(f405: Path) -> None:
    with rung(f405, kind="pwm") as target:
        target.drive(3, lambda *_: -2.5)
        assert target.system.amplifier_mV == pytest.approx(-2500.0, abs=2.0)
        target.drive(3, lambda *_: 10.0)
        assert target.system.amplifier_mV == pytest.approx(10_000.0, abs=2.0)


# ------------------------------------------------------------------------------------------- what may happen


@pytest.mark.parametrize("carrier", CARRIERS)
def test_silence_is_0_V_after_the_watchdog_and_a_tick(f405: Path, carrier: str) -> None:
    with rung(f405, carrier) as target:
        target.drive(20)
        last = target.system.now_us  # the DRIVE goes out now, and takes a moment on the wire
        off = target.run_until_off(2 * WATCHDOG_US)
    assert WATCHDOG_US < off - last <= WATCHDOG_US + TICK_US + 500.0


@pytest.mark.parametrize("lsi_hz", [17_000.0, 32_000.0, 47_000.0])
@pytest.mark.parametrize("stuck", ["tick", "link", "main"])
def test_stuck_task_is_reset_by_the_chips_own_watchdog(f405: Path, stuck: str, lsi_hz: float) -> None:
    """T08 and IWDG: whoever stops working, the motor is off within 50 ms, the board comes back disarmed."""
    with rung(f405, lsi_hz=lsi_hz) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.cpu.masked |= {"tick": {TICK_IRQ}, "link": {LINK_IRQ}, "main": set()}[stuck]
        target.system.starved = stuck == "main"
        off = target.run_until_off(2 * IWDG_US)
        assert off - began <= IWDG_US
        target.system.run_until(began + 2 * IWDG_US)
        resets = [(t, cause) for t, cause in target.system.resets if t > began]
        assert resets[0][1] == "watchdog"
        assert resets[0][0] - began <= IWDG_US
        target.system.cpu.masked.clear()
        target.system.starved = False
        target.system.run_for(40_000.0)
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.RESET_CAUSE) == 4
        assert state_of(target.system) is State.IDLE


def test_bus_off_is_0_V_within_2_ms_and_comes_back_disarmed(f405: Path) -> None:
    """W13 on CAN."""
    with rung(f405, "can") as target:
        target.drive(20)
        began = target.system.now_us
        target.system.can.go_bus_off(5_000.0)
        off = target.run_until_off(WATCHDOG_US)
        assert off - began <= FAST_US
        target.board.transmit_frames()
        target.system.run_for(120_000.0)
        frames = target.board.transmit_frames()
        assert never_on(target.system, off)
    faults = [data for number, data in frames if number == 0x030]
    assert {data[0] for data in faults} == {Fault.LINK_DOWN}
    assert any(number == 0x040 and data[6] & 7 == State.FAULT for number, data in frames)


def test_frames_that_nobody_acknowledges_are_given_up(f405: Path) -> None:
    with rung(f405, "can") as target:
        target.system.can.on_sent = lambda _: False
        target.system.run_for(30_000.0)
        heard: list[bytes] = []

        def hear(frame: tuple[int, bytes]) -> bool:
            heard.append(frame[1])
            return True

        target.system.can.on_sent = hear
        target.system.run_for(1_500.0)
        newest = target.board.ticks - 1
        samples = [data for data in heard if len(data) == 8]
        assert (newest - samples[0][5]) % 256 <= 2, "what was said first was old"


@pytest.mark.parametrize(("what", "speed"), [("speed", 60_000.0), ("travel", 30_000.0)])
def test_shove_is_stopped_within_2_ms_of_the_limit(f405: Path, what: str, speed: float) -> None:
    """P04: the arm is turned from outside, too fast or too far."""
    with rung(f405) as target:
        target.drive(20, lambda *_: 0.5)
        began, start = target.system.now_us, target.board.pins.count()
        target.board.turned = lambda now: start + int(1e-6 * speed * max(now - began, 0.0))
        limit_us = 0.0 if what == "speed" else 1e6 * 16_384 / speed
        seen = target.drive(20 + int(1e-3 * limit_us), lambda *_: 0.5)
        off = next(t for t, on, _ in target.system.pins_seen if t > began and not on)
        assert off - began - limit_us <= 2 * FAST_US  # a median of three ticks, and where in a tick it began
        assert off - began > limit_us
    assert seen[-1].fault == Fault[f"OVER_{what.upper()}"]


def test_break_input_cuts_the_bridge_without_software(f405: Path) -> None:
    with rung(f405, kind="pwm") as target:
        target.drive(20)
        assert target.system.amplifier_mV > 900.0
        target.system.gpio["B"].outside &= ~(1 << BREAK_PIN)
        target.system.pwm.look_at_break()
        assert target.system.amplifier_mV == 0.0  # before a single instruction
        assert target.drive(5)[-1].fault == Fault.BREAK_INPUT
        assert not target.system.enable
        target.system.gpio["B"].outside |= 1 << BREAK_PIN
        assert target.drive(5)[-1].fault == Fault.BREAK_INPUT  # until somebody clears it
        assert not target.system.enable


def test_board_without_a_crystal_says_so_and_does_not_arm(f405: Path) -> None:
    rig = bench("backend.kind=sim-board", *STILL)
    board = TargetBoard(f405 / "bench_f405_dac.elf", rig, crystal=False)
    board.system.run_for(60_000.0)
    assert state_of(board.system) is State.FAULT
    assert never_on(board.system, 0.0)
    assert board.system.rcc.core_Hz() == 168e6
    assert board.system.misuse == []


def test_crystal_that_stops_in_a_run_resets_with_the_motor_off(f405: Path) -> None:
    with rung(f405) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.rcc.stop_crystal()
        off = target.run_until_off(IWDG_US)
        assert off - began <= FAST_US
        target.system.run_for(80_000.0)
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.LAST_FAULT) == Fault.INTERNAL
        assert said_of(target.system, Parameter.LAST_FAULT_DETAIL) == 32


def test_crash_puts_enable_low_and_is_remembered(f405: Path) -> None:
    with rung(f405) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.jump(0x3000_0000)
        off = target.run_until_off(FAST_US)
        assert off - began <= 1_000.0
        target.system.run_for(40_000.0)
        assert [cause for t, cause in target.system.resets if t > began] == ["software"]
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.RESET_CAUSE) == 3
        assert said_of(target.system, Parameter.LAST_FAULT_DETAIL) == 64


# ------------------------------------------------------------------------------------------- what it keeps


def test_boots_are_counted_across_resets(f405: Path) -> None:
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG, boot_count=41)))
    for cause, number in (("pin", 2), ("software", 3), ("power", 1)):
        system.run_for(20_000.0)
        system.reset(cause)
        system.run_for(20_000.0)
        assert said_of(system, Parameter.RESET_CAUSE) == number
    assert said_of(system, Parameter.BOOT_COUNT) == 41 + 4
    assert system.misuse == []


def test_full_sector_is_left_for_the_other(f405: Path) -> None:
    full = b"".join(record(CONFIG, sequence=n, boot_count=n) for n in range(1, 205))
    system = System(f405 / "bench_f405_dac.elf", full.ljust(16_384, b"\xff") + b"\0" * 16_384)
    system.run_for(400_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == 205
    assert system.flash.erased == 1
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == 206
    assert system.misuse == []


@pytest.mark.parametrize(
    ("kept", "detail"),
    [
        (b"", 2),
        (image(record(CONFIG | {"period_us": 20})), 16),
        (image(record(CONFIG | {"watchdog_ms": 60})), 16),
    ],
    ids=["blank", "a period that is too short", "a watchdog that is too long"],
)
def test_board_without_a_good_record_is_weak_and_in_fault(f405: Path, kept: bytes, detail: int) -> None:
    system = System(f405 / "bench_f405_dac.elf", kept)
    system.run_for(20_000.0)
    assert state_of(system) is State.FAULT
    assert said_of(system, Parameter.VOLTAGE_LIMIT_MV) == 1000
    assert said_of(system, Parameter.PERIOD_US) == 1000
    assert never_on(system, 0.0)
    assert system.flash.written == 0
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.LAST_FAULT) == Fault.INTERNAL
    assert said_of(system, Parameter.LAST_FAULT_DETAIL) == detail


@pytest.mark.parametrize("rate", [500_000, 2_000_000])
def test_line_runs_at_the_rate_of_the_record(f405: Path, rate: int) -> None:
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG, link=RecordLink.cobs, baud=rate)))
    system.usart.baud = rate
    system.run_for(20_000.0)
    assert said_of(system, Parameter.COUNTS_PER_REV) == 4096
    assert system.misuse == []


def test_edges_are_stamped_with_their_time(f405: Path) -> None:
    """The newest rising edge of A, by TIM5, whatever the interrupt does."""
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG)))
    system.run_until(20_000.0)
    system.encoder.turn(0)
    before = system.timers["TIM5"].now["CCR1"]
    at = system.timers["TIM5"].count()
    system.encoder.turn(8)
    assert system.timers["TIM5"].now["CCR1"] == at != before
    assert system.encoder.now["CCR1"] & 3 == system.encoder.count() & 3 or system.encoder.now["CCR1"] > 0
