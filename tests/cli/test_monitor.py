"""`dcmp-hil monitor`, against boards behind pseudo terminals and on buses."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.factory import open_backend
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from tests.cli.ports import SAMPLE, way_to
from tests.cli.test_wire_errors import device, only_line, path_of
from tests.contract.benches import PatientClock, on_bench
from tests.contract.driving import drive
from tests.device.line import line

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_monitor_writes_nothing(cli: Cli, carrier: str) -> None:
    said = (cobs if carrier == "cobs" else slcan).encode(pack(SAMPLE))
    with line(said) as far:
        outcome = cli("monitor", "--duration", "0.3", *way_to(far.path, carrier))
        assert far.heard() == b""
    assert "Sample" in outcome.out


def test_monitor_counts_what_was_damaged_on_slcan(cli: Cli) -> None:
    with line(b"t04\r") as far:
        outcome = cli("monitor", "--duration", "0.3", *way_to(far.path, "slcan"))
    assert outcome.code == 0
    found = re.search(r"0 messages, (\d+) damaged", outcome.err)
    assert found is not None, outcome.err
    assert int(found[1]) > 0


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_monitor_ends_with_the_code_of_its_signal(number: signal.Signals, code: int) -> None:
    with line(cobs.encode(pack(SAMPLE))) as far:
        command = [sys.executable, "-m", "dcmp_hil", "monitor", *way_to(far.path, "cobs")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()  # it is listening
            process.send_signal(number)
            _, err = process.communicate(timeout=30)
    assert process.returncode == code, err


def test_monitor_shows_samples_ten_times_a_second_or_all(cli: Cli) -> None:
    with device() as pump:
        where = ("monitor", "bench-serial", "--set", f"backend.port={path_of(pump)}", "--duration", "0.5")
        brief, everything = cli(*where), cli(*where, "--all")
        assert not pump.board.owner
    few, many = (outcome.out.count("Sample") for outcome in (brief, everything))
    assert 2 <= few <= 6 < many
    assert "IDLE" in brief.out
    assert "0 damaged" in brief.err


def test_monitor_decodes_both_sides_of_a_bus(cli: Cli) -> None:
    with on_bench("can virtual") as found:
        channel = found.rig.backend.channel  # type: ignore[union-attr]

        ending = threading.Event()

        def host() -> None:
            while not ending.is_set():
                with open_backend(found.rig, PatientClock()) as backend:
                    drive(backend, 1.0, 30)

        thread = threading.Thread(target=host)
        thread.start()
        try:
            outcome = cli(
                "monitor", "bench-can", "--all", "--duration", "4.0",
                "--set", "backend.interface=virtual", "--set", f"backend.channel={channel}",
            )  # fmt: skip
        finally:
            ending.set()
            thread.join(10.0)
    for word in (
        "Sample",
        "Drive",
        "Hello",
        "Identity",
        "ParameterValue",
        "PERIOD_US = 1000",
        "RUN",
        "ttl_ms 20",
    ):
        assert word in outcome.out


def test_monitor_of_a_rig_without_a_wire_says_what_it_can_watch(cli: Cli) -> None:
    outcome = cli("monitor", "bench-1khz")
    assert outcome.code == 2
    assert "no wire to listen to" in only_line(outcome)


@pytest.mark.parametrize("text", ["-3s", "-1e-9"])
def test_a_duration_below_0_is_refused_before_a_port_is_opened(cli: Cli, text: str) -> None:
    outcome = cli("monitor", f"--duration={text}", *way_to("/dev/no-such-port", "cobs"))
    assert outcome.code == 2
    said = f'error: --duration: got "{text}"; expected 0 (until Ctrl-C) or more, such as 10s or 2min.'
    assert only_line(outcome) == said
