"""Lines that are slow, silent for a while, or on another carrier: what a run says of them."""

from __future__ import annotations

import os
import threading
import time
import tty
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Health
from tests.cli.test_wire_errors import device, only_line, path_of, start
from tests.device.line import line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Cli = Callable[..., Outcome]

pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.mark.parametrize("each_way_ms", [5, 8, 16, 30, 60, 150])
def test_slow_line_is_refused_with_its_true_round_trip(cli: Cli, each_way_ms: int) -> None:
    fault = f"wire.delay:ms={each_way_ms},at=boot"
    board = ("--set", "backend.kind=sim-board")
    outcome = cli(
        "run", "--fast", "--duration", "1", "--viewer", "none", "--no-record", "--fault", fault, *board
    )
    assert outcome.code == 3
    words = only_line(outcome)
    told = float(words.partition("an answer takes ")[2].split()[0])
    assert 2 * each_way_ms <= told <= 2 * each_way_ms + 3
    assert ("latency timer" in words) == (2 * each_way_ms < 35)


def test_slower_than_is_waited_for_is_said_as_that(cli: Cli) -> None:
    board = ("--set", "backend.kind=sim-board", "--fault", "wire.delay:ms=300,at=boot")
    outcome = cli("run", "--fast", "--duration", "1", "--viewer", "none", "--no-record", *board)
    assert outcome.code == 3
    assert "more than 400 ms" in only_line(outcome)


@pytest.mark.sampled
@pytest.mark.parametrize("way", ["both", "up", "down"])
@pytest.mark.parametrize("seed", range(4))
def test_line_that_damages_too_much_to_arm_is_told_as_that(cli: Cli, way: str, seed: int) -> None:
    noise = ("--fault", f"wire.noise:rate=0.03,way={way},at=boot", "--set", f"sim.seed={seed}")
    board = ("--set", "backend.kind=sim-board", "--viewer", "none", "--no-record")
    outcome = cli("run", "--fast", "--duration", "1", *board, *noise)
    assert outcome.code in {3, 4}
    assert "damage" in outcome.err
    assert "cable" in outcome.err


@contextmanager
def health_only(carrier: str) -> Iterator[str]:
    """Say nothing but HEALTH, ten times a second and more."""
    encode = cobs.encode if carrier == "cobs" else slcan.encode
    with line(encode(pack(Health._make([0] * len(Health._fields))))) as far:
        yield far.path


def test_health_alone_is_not_called_silence(cli: Cli) -> None:
    with health_only("cobs") as path:
        outcome = start(cli, path, "backend.boot_wait_s=0.5")
    assert outcome.code == 3
    words = only_line(outcome)
    assert "HEALTH arrives, but no SAMPLE" in words
    assert "nothing arrives" not in words


def test_board_that_boots_when_its_port_is_opened_can_be_used(script: Callable[..., Finished]) -> None:
    """It says nothing for 1.5 s, then runs: the wait of 0.5 s that there was once ended before."""
    with device() as pump:
        pump.silent.set()
        wake = threading.Timer(1.5, pump.silent.clear)
        wake.start()
        sets = ("--set", f"backend.port={path_of(pump)}", "--set", "backend.boot_wait_s=30")
        options = ("--duration", "0.3", "--no-record", "--viewer", "none", "--no-control")
        began = time.monotonic()
        done = script("run", "bench-serial", *sets, *options)
        wake.join()
    assert time.monotonic() - began > 1.5
    assert "nothing arrives" not in done.err
    assert "ended by" in done.out


def test_samples_from_before_the_boot_are_ignored(cli: Cli) -> None:
    """What the line still carried is heard; then the board boots, silent, for a second and a half."""
    with device() as pump:
        hear, waking = pump.board.receive, threading.Timer(1.5, pump.silent.clear)

        def reset_once(data: bytes) -> None:
            if not waking.is_alive() and not waking.finished.is_set():
                pump.silent.set()
                pump.board.reset()
                waking.start()
            else:
                hear(data)

        pump.board.receive = reset_once  # type: ignore[method-assign]
        outcome = start(cli, path_of(pump), "backend.boot_wait_s=30")
        waking.join()
    assert "does not answer" not in outcome.err
    assert "ended by" in outcome.out


@pytest.mark.parametrize(
    ("carrier", "rig", "key", "hint"),
    [
        ("slcan", "bench-serial", "backend.port", "backend.interface=slcan --set backend.channel="),
        ("cobs", "bench-can", "backend.channel", "backend.kind=serial --set backend.port="),
    ],
)
def test_wrong_carrier_is_told_by_run_and_monitor(
    cli: Cli, carrier: str, rig: str, key: str, hint: str
) -> None:
    with device(carrier=carrier) as pump:
        path = path_of(pump)
        sets = ["--set", f"{key}={path}", "--set", "backend.boot_wait_s=0.5"]
        sets += ["--set", "backend.interface=slcan"] if rig == "bench-can" else []
        ran = cli("run", rig, *sets, "--duration", "0.1", "--no-record", "--viewer", "none")
        seen = cli("monitor", rig, *sets, "--duration", "0.5")
    assert ran.code == 3
    assert f"{hint}{path}" in only_line(ran)
    assert seen.code == 0
    assert f"{hint}{path}" in seen.err


@pytest.mark.parametrize("rig", ["bench-serial", "bench-can"])
def test_noise_has_no_hint_of_a_carrier(cli: Cli, rig: str) -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    path, ending = os.ttyname(slave), threading.Event()

    def babble() -> None:
        while not ending.wait(0.01):
            os.write(master, b"\x5a" * 40 + b"\0\r")

    thread = threading.Thread(target=babble)
    thread.start()
    key = "backend.port" if rig == "bench-serial" else "backend.channel"
    more = ["--set", "backend.interface=slcan"] if rig == "bench-can" else []
    try:
        outcome = cli("monitor", rig, "--set", f"{key}={path}", *more, "--duration", "0.3")
    finally:
        ending.set()
        thread.join()
        os.close(master)
        os.close(slave)
    assert "another carrier" not in outcome.err
