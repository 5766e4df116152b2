"""The `can` backend on interfaces of a real kernel: `interface = "socketcan"`."""

from __future__ import annotations

import errno
import json
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.links.can import CanLink
from dcmp_hil.errors import LinkError, OpenError
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import State
from tests.socketcan.bench import SHORT, WATCHDOG_MS, Bench, drive, drive_into
from tests.socketcan.interfaces import BUS_OFF, ERROR, bring_up, frame, raw_socket, take_down
from tools.hosts import wait

if TYPE_CHECKING:
    from pathlib import Path

BACKEND_EXIT_CODE = 3  # exit code
OFF_MS = WATCHDOG_MS + 5.0  # and a period
CLASSES = [1 << bit for bit in range(10) if 1 << bit != BUS_OFF]
TOLD = [b"sw096000\r", b"sp128000\r", b"e1a\r", b"e3bcs\r", b"e2oO\r", b"sa000000\r"]
"""What an adapter says of its bus: warning, passive, no acknowledge, bad bits, overruns, all is well."""

BOTH = pytest.mark.parametrize("kind", ["slcan", "vcan"])


def test_shipped_rig_runs_at_1_khz_over_the_kernels_own_slcan(tmp_path: Path) -> None:
    figures = tmp_path / "figures.json"
    with Bench(tmp_path, "slcan", rate_hz=1000) as bench:
        host = bench.start("--duration", "2", "--json", str(figures))
        assert host.wait() == 0, host.printed()
        output = bench.device.output
    assert (output.voltage_mV, output.enable, output.state, output.owner) == (0, 0, State.IDLE, 0)
    told = json.loads(figures.read_text())
    assert told["ended_by"] == "duration"
    # A device that catches up says two at once: what the host skipped is its scheduler's affair.
    assert {told["link"][name] for name in ("lost", "stale", "corrupt", "missed")} == {0}
    assert told["troubles"] == []


def test_run_ends_with_its_exit_code_when_the_bus_goes_off(tmp_path: Path) -> None:
    with Bench(tmp_path, "vcan") as bench, raw_socket(bench.name) as other:
        host = bench.drive()
        bench.since_us, _ = bench.device.clock_us()
        other.send(frame(ERROR | BUS_OFF))
        assert host.wait() == BACKEND_EXIT_CODE
        assert bench.off_after_ms() <= OFF_MS
    assert "vcan0: bus-off. The device goes to 0 V by itself. Check termination" in host.printed()
    assert "ip link set vcan0 down, then up" in host.printed()


def test_remedy_for_bus_off_is_one_when_the_kernel_took_the_interface_off_the_bus(tmp_path: Path) -> None:
    with Bench(tmp_path, "slcan") as bench:
        with pytest.raises(LinkError, match=rf"bus-off.*ip link set {bench.name} down, then up"):
            drive_into(bench, lambda: bench.adapter.tell(b"sb256256\r"))
        assert bench.off_after_ms() <= OFF_MS
        take_down(bench.name)
        bring_up(bench.name)
        wait(lambda: not bench.device.output.owner, "the device gives the host up")
        with bench.backend() as backend:
            drive(backend, SHORT)
            assert bench.device.output.state == State.RUN
        assert bench.is_off()


def test_run_goes_on_when_the_adapter_tells_of_errors_on_its_bus(tmp_path: Path) -> None:
    with Bench(tmp_path, "slcan") as bench:
        with bench.backend() as backend:
            for line in TOLD:
                bench.adapter.tell(line)
                drive(backend, SHORT)
                assert bench.device.output.state == State.RUN
        assert bench.is_off()


def test_run_goes_on_among_error_frames_and_frames_that_are_not_ours(tmp_path: Path) -> None:
    extended, remote = 0x8000_0000, 0x4000_0000
    with Bench(tmp_path, "vcan") as bench, raw_socket(bench.name) as other:
        with bench.backend() as backend:
            for flags in (*(ERROR | kind for kind in CLASSES), extended | 0x123, remote | 0x10, 0x7FF):
                for _ in range(20):
                    other.send(frame(flags))
                drive(backend, SHORT)
                assert bench.device.output.state == State.RUN
            counters = backend.counters
        assert (counters.lost, counters.corrupt) == (0, 20 * sum(kind & 0x98 != 0 for kind in CLASSES))
        assert bench.is_off()


@BOTH
def test_run_ends_by_the_firmwares_watchdog_when_the_interface_goes_down(tmp_path: Path, kind: str) -> None:
    with Bench(tmp_path, kind) as bench:
        with pytest.raises(LinkError, match=f"went down.*ip link set {bench.name} up") as caught:
            drive_into(bench, lambda: take_down(bench.name))
        assert bench.off_after_ms() <= OFF_MS
        assert bench.device.output.fault == Fault.HOST_SILENT
    assert not hasattr(caught.value, "__notes__")  # it is said once


def test_run_ends_when_the_adapter_is_pulled(tmp_path: Path) -> None:
    with Bench(tmp_path, "slcan") as bench:
        with pytest.raises(LinkError, match=r"the connection broke.*Look at adapter"):
            drive_into(bench, bench.adapter.pull)
        assert bench.off_after_ms() <= OFF_MS


@BOTH
def test_interface_that_is_down_is_refused_with_the_command_that_brings_it_up(
    tmp_path: Path, kind: str
) -> None:
    with Bench(tmp_path, kind) as bench:
        take_down(bench.name)
        with pytest.raises(OpenError, match=f"ip link set {bench.name} up"), bench.backend():
            pass


def test_interface_that_is_not_there_is_refused_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with Bench(tmp_path, "vcan") as bench:
        bench.name = "can7"
        with pytest.raises(OpenError, match=r"can7: there is no such interface"), bench.backend():
            pass
    assert not caplog.records  # python-can has something to say


def test_frames_are_dropped_without_waiting_when_none_is_read(tmp_path: Path) -> None:
    clock = MonotonicClock()
    with Bench(tmp_path, "slcan") as bench, raw_socket(bench.name) as other:
        link = CanLink(bench.settings, clock)
        link.open()
        bench.adapter.loosen()
        refusal = 0
        longest_ns = 0
        while not refusal:
            try:
                other.send(frame(0x7FF))
            except OSError as error:
                refusal = error.errno or 0
        for _ in range(100):
            began_ns = clock.now_ns()
            link.send((0x7FF, bytes(8)))
            longest_ns = max(longest_ns, clock.now_ns() - began_ns)
        assert refusal == errno.ENOBUFS
        assert longest_ns < 5e6
        link.close()
