"""A8: a fault that the device keeps is not cleared by the next start.

What attacks: a restart loop, or a colleague who starts a run without a look. What is promised: every latched
fault is named at the start that clears it; STOP by a person, the amplifier's own protection, what the board
found wrong with itself, and a fault that is not named wait for `--clear`; boots, the cause of the reset and
the fault before it are read at every start, and shown by `ports -v`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.device.boot_history import History
from dcmp_hil.device.links.serial import SerialLink
from dcmp_hil.errors import OpenError
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.session import Session
from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import (
    FaultReport,
    Parameter,
    ParameterValue,
    SampleReport,
    State,
    Stop,
    StopReason,
)
from sim_backend.board.virtual_device import VirtualDevice
from tests.contract.benches import Bench, on_bench
from tests.contract.hooks import on_way_down
from tests.contract.lies import lying
from tests.firmware.core_library import compiler
from tests.helpers import bench as bench_rig
from tests.live.processes import until

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.wire.messages import Message
    from tests.installed import Finished


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    compiler()


def _latch(bench: Bench, reason: StopReason, code: int = Fault.STOPPED) -> None:
    """Leave the board in a fault, which it calls `code`."""
    bench.board.tick()
    bench.board.receive_frame(*pack(Stop(reason)))
    assert bench.board.state == State.FAULT

    def lie(message: Message) -> Message:
        if isinstance(message, FaultReport):
            return message._replace(code=code)
        if isinstance(message, SampleReport) and message.state == State.FAULT:
            return message._replace(fault_class=min(code, 7))
        return message

    if code != Fault.STOPPED:
        on_way_down(bench, lying(lie))


_WAIT = [
    (StopReason.PERSON, Fault.STOPPED, "Find out who and why"),
    (StopReason.SUPERVISOR, Fault.BREAK_INPUT, "Look at motor current"),
    (StopReason.SUPERVISOR, Fault.INTERNAL, "firmware/README.md"),
    (StopReason.SUPERVISOR, 77, "--clear"),
]


@pytest.mark.parametrize(("reason", "code", "remedy"), _WAIT)
def test_fault_of_a_person_is_kept_however_often_a_run_is_started(
    reason: StopReason, code: int, remedy: str
) -> None:
    with on_bench("sim-board can") as bench:
        _latch(bench, reason, code)
        for _ in range(5):
            with pytest.raises(OpenError, match=r"start once with --clear") as refused:
                bench.make().__enter__()
            assert remedy in str(refused.value)
            assert bench.board.state == State.FAULT


@pytest.mark.parametrize(("reason", "code", "_"), _WAIT)
def test_fault_of_a_person_is_cleared_and_named_when_a_person_says_so(
    reason: StopReason, code: int, _: str
) -> None:
    with on_bench("sim-board can") as bench:
        _latch(bench, reason, code)
        backend = bench.make()
        assert isinstance(backend, DeviceBackend)
        backend.clear = True
        with backend:
            assert bench.board.state == State.RUN
            (remark,) = backend.remarks
    assert "of an earlier run, which was cleared" in remark


def test_fault_that_a_program_left_is_cleared_and_named() -> None:
    with on_bench("sim-board can") as bench:
        _latch(bench, StopReason.SUPERVISOR)
        with bench.device() as backend:
            (remark,) = backend.remarks
    assert remark.startswith("The device was in fault STOPPED of an earlier run, which was cleared")


def test_past_of_a_device_is_told_at_every_start() -> None:
    told = {
        Parameter.BOOT_COUNT: 12,
        Parameter.RESET_CAUSE: 4,
        Parameter.LAST_FAULT: int(Fault.BREAK_INPUT),
        Parameter.LAST_FAULT_DETAIL: 3,
    }

    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id in told:
            return message._replace(value=told[Parameter(message.id)])
        return message

    with on_bench("sim-board can") as bench:
        on_way_down(bench, lying(lie))
        with bench.device() as backend:
            assert (
                "boot 12, reset by watchdog, fault before that: BREAK_INPUT (detail 3)" in backend.described
            )
            first, second = backend.remarks
    assert first.startswith("The device was reset by its watchdog.")
    assert second.startswith("The device's newest fault before this boot was BREAK_INPUT, detail 3")


@pytest.mark.parametrize(
    ("past", "sentence"),
    [
        (History(3, 1, 0, 0), "boot 3, reset by power, fault before that: none"),
        (History(None, None, None, None), "boot not told, reset by not told, fault before that: not told"),
        (History(0, 99, 200, -1), "boot 0, reset by cause 99, fault before that: code 200 (detail -1)"),
    ],
)
def test_past_is_a_sentence_for_any_report_of_a_device(past: History, sentence: str) -> None:
    assert past.sentence == sentence


def test_run_has_the_option_in_every_way_to_start_one(
    script: Callable[..., Finished], tmp_path: Path
) -> None:
    with VirtualDevice(bench_rig(), clock=MonotonicClock()) as device:
        device.start()
        looked = script("ports", "-v", device.port)
        assert "boot 1, reset by power, fault before that: none" in looked.out
        _send_stop(device.port)
        until(lambda: device.output.state == State.FAULT, "it stopped")
        options = (
            "bench-serial",
            "--set",
            f"backend.port={device.port}",
            "--duration",
            "1",
            "--viewer",
            "none",
        )
        refused = script("run", *options)
        assert refused.code == 3
        assert "Then start once with --clear" in refused.err
        assert not (tmp_path / "runs").exists()
        assert device.output.state == State.FAULT
        cleared = script("run", *options, "--clear", "--json", "figures.json")
    assert "was in fault STOPPED of an earlier run, which was cleared" in cleared.err
    assert any(
        "cleared" in trouble for trouble in json.loads((tmp_path / "figures.json").read_text())["troubles"]
    )


def _send_stop(port: str) -> None:
    link = SerialLink(port, 1_000_000)
    link.open()
    try:
        assert link.receive(60.0) is not None  # the device has seen that its line is up
        link.send(pack(Stop(StopReason.PERSON)))
    finally:
        link.close()


def test_session_takes_it_as_well() -> None:
    assert Session(bench_rig(), fast=True, duration=0.1, clear=True) is not None
