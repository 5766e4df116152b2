"""The board in this process: the plain simulated rig with a firmware in between."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import (
    Hello,
    ParameterGet,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from dcmp_hil.wire.wrapping import unwrap
from sim_backend.backend import SimBackend
from sim_backend.board.board import Board
from tests.helpers import bench
from tests.sim_backend.board_host import Host

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.values import Truth

pytestmark = pytest.mark.usefixtures("needs_compiler")


def controller(k: int, position: float) -> float:
    """Return a voltage that the wire carries exactly, from what a host knows."""
    return round(1e3 * (6.0 * math.sin(0.05 * k) - 20.0 * position)) / 1e3


def on_the_board(host: Host, periods: int, mV_per_V: int = 1000, rad: float = math.tau / 4096) -> list[Any]:
    first, seen, count = host.arm(), [], 0
    sample = None
    for k in range(first, first + periods):
        if sample is not None:
            count = unwrap(count, sample.position_counts, 24)
        position = rad * count
        if sample is not None:
            seen.append((position, sample.voltage_mV / mV_per_V, host.board.truth()))
        host.drive(round(mV_per_V * controller(k, position)))
        sample = host.tick()
    return seen


def on_the_rig(overrides: tuple[str, ...], first: int, periods: int) -> list[Any]:
    seen = []
    with SimBackend(bench(*overrides), SimulatedClock()) as backend:
        position = 0.0
        for _ in range(first + 1):
            backend.read()
            backend.write(0.0)
        for k in range(first, first + periods):
            if k > first:
                sample = backend.read()
                position = sample.position
                seen.append((position, sample.voltage, backend.truth()))
            backend.write(controller(k, position))
    return seen


@pytest.mark.parametrize(
    "overrides",
    [
        (),
        ("sim.integrator=euler",),
        ("loop.rate_hz=250.0",),
        ("amplifier.voltage_limit_V=2.5",),
        ("amplifier.slew_V_s=500.0",),
        ("sim.encoder_noise_counts=2.0", "sim.seed=7"),
    ],
    ids=str,
)
def test_board_is_the_plain_simulated_rig_to_the_bit(overrides: tuple[str, ...]) -> None:
    board, rig = on_the_board(Host(*overrides), 400), on_the_rig(overrides, 11, 400)
    assert [sample[:2] for sample in board] == [sample[:2] for sample in rig]
    assert [sample[2][:2] for sample in board] == [sample[2][:2] for sample in rig]
    assert max(abs(sample[1]) for sample in board) > 2.0


@pytest.mark.parametrize("signs", [(1, -1), (-1, 1), (-1, -1)])
def test_host_that_knows_the_wiring_sees_no_difference(signs: tuple[int, int]) -> None:
    wiring = (f"encoder.sign={signs[0]}", f"amplifier.sign={signs[1]}")
    straight = on_the_board(Host(), 300)
    wired = on_the_board(Host(*wiring), 300, mV_per_V=1000 * signs[1], rad=signs[0] * math.tau / 4096)
    assert wired == straight


def test_amplifier_beyond_the_board_has_the_shortcomings_of_the_rig() -> None:
    # The board reports what it puts out; only the plant knows what became of it.
    overrides = ("sim.dead_zone_V=0.5", "sim.voltage_step_mV=200.0")

    def open_loop(step: Callable[[float], Truth]) -> list[Truth]:
        return [step(round(3e3 * math.sin(0.03 * k)) / 1e3) for k in range(200)]

    host = Host(*overrides)
    first = host.arm()

    def board(voltage: float) -> Truth:
        host.drive(round(1e3 * voltage))
        host.tick()
        return host.board.truth()

    with SimBackend(bench(*overrides), SimulatedClock()) as backend:

        def rig(voltage: float) -> Truth:
            backend.write(voltage)
            backend.read()
            return backend.truth()

        for _ in range(first + 1):
            backend.write(0.0)
            backend.read()
        plain = open_loop(rig)
    assert [truth[:2] for truth in open_loop(board)] == [truth[:2] for truth in plain]


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_carriers_carry_the_same_frames(carrier: str) -> None:
    frames, stream = Board(bench(), carrier="can"), Board(bench(), carrier=carrier)
    encode = cobs.encode if carrier == "cobs" else slcan.encode
    receiver = cobs.CobsDecoder() if carrier == "cobs" else slcan.SlcanDecoder()
    for k in range(250):
        for board in (frames, stream):
            board.tick()
        for message in (ParameterGet(k % 16), Hello(k, PROTOCOL_HASH)):
            frames.receive_frame(*pack(message, 0))
            stream.receive(encode(pack(message, 0)))
        assert receiver.feed(stream.transmit()) == list(frames.transmit_frames())
    assert receiver.corrupt == 0
    assert (stream.transmit(), frames.transmit_frames()) == (b"", [])


def test_slcan_commands_are_answered_before_the_next_tick() -> None:
    board = Board(bench(), carrier="slcan")
    board.receive(b"V\rN\r?\r")
    assert board.transmit() == b"V0101\rNDCMP\r\a"
    board.receive(b"C\r")
    board.tick()
    assert board.transmit() == b"\r"
