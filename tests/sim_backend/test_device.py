"""The virtual device: a process behind a pseudo terminal, in plant time and in wall time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.factory import open_backend
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import (
    Health,
    Hello,
    Parameter,
    ParameterGet,
    ParameterValue,
    SampleReport,
    State,
    Stop,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from sim_backend.board.virtual_device import VirtualDevice
from tests.contract.benches import PatientClock
from tests.helpers import bench
from tests.sim_backend.terminal import PATIENT_MS, PATIENT_S, SESSION, arm, connected

if TYPE_CHECKING:
    from dcmp_hil.wire.messages import Message

pytestmark = pytest.mark.usefixtures("needs_compiler")

_STILL = ("model.eta_rad_s2=0.0", "model.eta_amplitude_rad_s2=0.0")  # no disturbance that depends on the time


def closed_loop(carrier: str) -> tuple[list[tuple[float, float, float]], int]:
    """Run a host against a device in plant time; return what the host saw."""
    rig = bench(*_STILL)
    seen = []
    with VirtualDevice(rig, link=carrier, patience_ms=PATIENT_MS) as device:
        way = (
            ("backend.kind=serial", f"backend.port={device.port}")
            if carrier == "cobs"
            else ("backend.kind=can", "backend.interface=slcan", f"backend.channel={device.port}")
        )
        device.start()
        with open_backend(bench(*_STILL, *way), PatientClock()) as backend:
            for k in range(1000):
                sample = backend.read()
                seen.append((sample.t, sample.position, sample.voltage))
                backend.write(6.0 * math.sin(0.02 * k) - 20.0 * sample.position)
        assert device.error is None
        return seen, device.output.state


def test_same_run_is_the_same_to_the_bit_over_every_carrier() -> None:
    (first, ended), (second, _), (third, _) = closed_loop("cobs"), closed_loop("cobs"), closed_loop("slcan")
    assert first == second == third
    assert max(abs(voltage) for _, _, voltage in first) > 2.0
    assert [round(1e3 * t) for t, _, _ in first] == list(range(1000))
    assert ended == State.IDLE


def test_answer_to_an_earlier_sample_is_none_to_the_newest() -> None:
    """Else a host that was late once while it armed is one tick behind for a whole run."""
    with VirtualDevice(bench(), patience_ms=PATIENT_MS) as device, connected(device) as host:
        device.start()
        host.say(Hello(SESSION, PROTOCOL_HASH))
        for _ in range(100):
            samples = [message for message in host.hear() if isinstance(message, SampleReport)]
            if samples and samples[-1].state == State.RUN:
                break
            if samples:
                host.seq = samples[-1].tick
                host.drive(0)  # the last one is for the tick before the one that was heard of last
        host.drive(0)
        assert not any(isinstance(message, SampleReport) for message in host.hear(0.1))
        host.seq += 1
        host.drive(0)
        assert any(isinstance(message, SampleReport) for message in host.hear())


def test_host_that_hangs_up_leaves_0_V_within_2_ms_of_the_firmware_s_clock(device: VirtualDevice) -> None:
    with connected(device) as host:
        arm(device, host)
        closed_us = device.now_us
    device.run_ticks(3)
    output = device.output
    assert (output.voltage_mV, output.enable, output.state) == (0, 0, State.FAULT)
    assert output.fault == Fault.LINK_DOWN
    assert output.since_us - closed_us <= 2000
    assert not output.link_up


def test_hang_up_is_told_without_a_tick(device: VirtualDevice) -> None:
    with connected(device) as host:
        arm(device, host)
    assert device.wait_for_change(PATIENT_S)
    assert device.output.unasked
    assert (device.output.voltage_mV, device.output.enable, device.output.fault) == (0, 0, Fault.LINK_DOWN)
    assert 0 <= device.output.since_us - device.now_us <= 1000  # its clock runs on, at most one period


def test_stop_and_disarming_act_between_two_ticks(device: VirtualDevice) -> None:
    with connected(device) as host:
        arm(device, host)
        host.seq = device.tick_count - 1
        host.drive(2000, arm=False)
        assert device.wait_for_change(PATIENT_S)
        assert (device.output.voltage_mV, device.output.state) == (0, State.IDLE)
        arm(device, host)
        host.say(Stop(3))
        assert device.wait_for_change(PATIENT_S)
        assert (device.output.voltage_mV, device.output.fault) == (0, Fault.STOPPED)
        before = device.truth().position
        device.run_ticks(1)
        assert abs(device.truth().position - before) < 1e-3


def test_last_words_of_a_host_are_heard_before_its_hang_up(device: VirtualDevice) -> None:
    with connected(device) as host:
        arm(device, host)
        host.say(Stop(2))
    device.run_ticks(3)
    assert (device.output.link_up, device.output.fault) == (False, Fault.STOPPED)


def test_next_host_finds_a_device_that_works(device: VirtualDevice) -> None:
    for _ in range(3):
        with connected(device) as host:
            device.run_ticks(1)
            assert device.output.link_up
            host.say(ParameterGet(Parameter.BOARD))
            answers = [
                message for message in host.hear() + host.hear() if isinstance(message, ParameterValue)
            ]
            assert answers == [ParameterValue(Parameter.BOARD, 2, 0)]
        device.run_ticks(50)
        assert not device.output.link_up


def test_parameters_are_answered_without_a_tick(device: VirtualDevice) -> None:
    with connected(device) as host:
        device.run_ticks(1)
        host.hear()
        host.say(ParameterGet(Parameter.PERIOD_US))
        assert host.hear() == [ParameterValue(Parameter.PERIOD_US, 1000, 0)]


def test_next_host_does_not_read_what_was_meant_for_the_last_one(device: VirtualDevice) -> None:
    with connected(device):
        device.run_ticks(100)
    device.run_ticks(100)
    with connected(device) as host:
        device.run_ticks(1)
        ticks = [getattr(message, "tick", None) for message in host.hear()]
    assert ticks == [200]


def test_silent_host_is_noticed_in_plant_time() -> None:
    with VirtualDevice(bench(), patience_ms=1) as device, connected(device) as host:
        device.run_ticks(1)
        host.say(Hello(SESSION, PROTOCOL_HASH))
        for _ in range(15):
            host.seq = device.tick_count - 1
            host.drive(0)
            device.run_ticks(1)
        assert device.output.state == State.RUN
        fed_us = device.now_us - 1000  # the last DRIVE came before the newest tick, and time stood still
        device.run_ticks(25)
        assert device.output.fault == Fault.HOST_SILENT
        silent_us = next(o.now_us for o in tuple(device.log) if o.state == State.FAULT) - fed_us
        assert 20_000 < silent_us <= 21_000


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_reader_that_is_too_slow_loses_whole_frames(carrier: str) -> None:
    with VirtualDevice(bench(), link=carrier, clock=SimulatedClock()) as device:
        with connected(device, carrier) as host:
            device.run_ticks(4000)
            heard: list[Message | None] = []
            while more := host.hear(0.05):
                heard += more
            device.run_ticks(110)
            heard += host.hear()
            while more := host.hear(0.05):
                heard += more
        assert host.receiver.corrupt == 0
        assert 100 < len(heard) < 4000
        assert [message.ring_overruns for message in heard if isinstance(message, Health)][-1] == 255


def test_port_speaks_slcan() -> None:
    with (
        VirtualDevice(bench(), link="slcan", clock=SimulatedClock()) as device,
        connected(device, "slcan") as host,
    ):
        device.run_ticks(1)
        host.read()
        host.write(b"V\rC\r")
        assert host.read() == b"V0101\r\r"
        device.run_ticks(1)
        assert host.read(0.05) == b""


def test_clock_of_the_firmware_wraps_unseen() -> None:
    with VirtualDevice(bench(), clock=SimulatedClock(), start_us=2**32 - 20_000) as device:
        with connected(device) as host:
            arm(device, host)
            for _ in range(30):
                host.seq = device.tick_count - 1
                host.drive(1000)
                host.hear()
                device.run_ticks(1)
        assert device.now_us < 100_000
        assert device.log[-1].state == State.RUN
