"""The contract of a backend for two hosts at one device, and for a host that does not fit it."""

from __future__ import annotations

import threading
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError, LinkError, OpenError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire import protocol_hash
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Hello
from sim_backend.board.backend import SimBoardBackend
from tests.contract.benches import on_bench
from tests.contract.driving import at_rest, drive, wired

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.backend import Backend


def test_second_host_on_a_bus_is_refused_and_changes_nothing() -> None:
    with on_bench("can virtual") as bench, bench.device() as backend:
        drive(backend, 2.0, 5)
        with keep_driving(backend), pytest.raises(OpenError, match="another host") as caught:
            bench.device().__enter__()
        assert "\n" not in str(caught.value)
        assert drive(backend, 2.0, 3)[-1].voltage == 2.0


@pytest.mark.parametrize("kind", ["cobs pty", "slcan pty"])
def test_second_host_on_a_port_is_told_who_has_it(kind: str) -> None:
    with on_bench(kind) as bench, bench.device(), pytest.raises(OpenError, match="busy"):
        bench.make().__enter__()


@wired
def test_host_that_does_not_fit_gives_the_device_back_at_once(kind: str) -> None:
    with on_bench(kind) as bench:
        host = bench.device()
        fitting = host._config  # noqa: SLF001
        host._config = replace(fitting, counts_per_rev=2000)  # noqa: SLF001
        with pytest.raises(ConfigError, match="the rig says 2000, the device 4096"):
            host.__enter__()
        host._config = fitting  # noqa: SLF001
        with host:
            assert drive(host, 1.0, 3)[-1].voltage == 1.0


@wired
def test_other_protocol_is_refused_with_both_versions(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dcmp_hil.device.handshake.PROTOCOL_HASH", 0x12345678)
    monkeypatch.setattr("dcmp_hil.device.open_errors.PROTOCOL_HASH", 0x12345678)
    with on_bench(kind) as bench:
        with pytest.raises(OpenError) as caught:
            bench.make().__enter__()
        assert "12345678" in str(caught.value)
        assert f"{protocol_hash.PROTOCOL_HASH:08x}" in str(caught.value)
        assert at_rest(bench)


@contextmanager
def keep_driving(backend: Backend) -> Iterator[None]:
    """Keep one host alive, in a thread of its own, while another tries."""
    ending = threading.Event()

    def keep() -> None:
        while not ending.is_set():
            drive(backend, 2.0, 1)

    thread = threading.Thread(target=keep)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join(5.0)
        assert not thread.is_alive()


@pytest.mark.parametrize("slept", [560, 620, 680, 740])
def test_host_that_slept_does_not_take_another_hosts_run_for_its_own(slept: int) -> None:
    """It is suspended, the device faults, another host takes over: none of it looks like its own run."""
    with on_bench("sim-board can") as bench, ExitStack() as hosts:
        clock = SimulatedClock()
        first = SimBoardBackend(bench.rig, clock, bench.board)
        hosts.enter_context(first)
        drive(first, 1.0, 5)
        for _ in range(slept):  # no host answers: a fault, and the session lapses
            bench.board.tick()
            bench.board.transmit_frames()  # lost: the sleeper's buffer is full
        assert bench.board.owner == 0
        second = hosts.enter_context(SimBoardBackend(bench.rig, SimulatedClock(), bench.board))
        drive(second, 2.0, 50)
        clock.sleep_until_ns(int(1e6 * (slept + 100)))
        with pytest.raises(LinkError, match="stood still") as woken:
            first.read()
        first.write(-5.0)
        first.__exit__(LinkError, woken.value, None)
        drive(second, 2.0, 2)
        assert bench.board.applied_mV == 2000


@pytest.mark.parametrize("kind", ["sim-board can", "reference can"])
def test_an_identity_that_answers_another_host_is_not_believed(kind: str) -> None:
    """Another host's HELLO comes just before ours: its IDENTITY says owned, and means the other one."""
    with on_bench(kind) as bench:
        receive = bench.board.receive_frame
        meddled: list[int] = []

        def meddle(number: int, data: bytes) -> None:
            if number == 0x060 and not meddled:
                meddled.append(number)
                receive(*pack(Hello(0x4242, protocol_hash.PROTOCOL_HASH)))
            receive(number, data)

        bench.board.receive_frame = meddle  # type: ignore[method-assign]
        with pytest.raises(OpenError, match="another host"):
            bench.make().__enter__()
        assert meddled
        assert at_rest(bench)
