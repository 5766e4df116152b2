"""Time that the wire costs: encoding, a round trip to the native firmware, and a plain echo."""

from __future__ import annotations

import os
import statistics
import subprocess
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import serial

from dcmp_hil import load_rig
from dcmp_hil.device.links.serial import SerialLink
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import Drive, Parameter, ParameterGet, ParameterValue, SampleReport
from sim_backend.board.virtual_device import VirtualDevice

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_TRIPS_PER_ROUND = 300
_ROUND_COUNT = 15
_ANSWER_TIMEOUT_S = 1.0
_ECHO_SOURCE = """
#define _GNU_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>
int main(void)
{
    char bytes[256];
    struct termios raw;
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    grantpt(master);
    unlockpt(master);
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    puts(ptsname(master));
    fflush(stdout);
    struct pollfd waiting[2] = {{.fd = master, .events = POLLIN}, {.fd = 0, .events = POLLIN}};
    while (poll(waiting, 2, -1) > 0 && !waiting[1].revents) {
        const ssize_t length = read(master, bytes, sizeof bytes);
        if (length <= 0 || write(master, bytes, (size_t)length) != length) {
            return 1;
        }
    }
    return 0;
}
"""


def codec_us() -> float:
    """Cost of a DRIVE from message to bytes and a SAMPLE from bytes to message, us."""
    drive = Drive(1234, 77, True, False, False, 4711, 20)
    sample = cobs.encode(pack(SampleReport(123_456, -1234, 88, 3, False, False, 0)))
    receiver, count = cobs.CobsDecoder(), 20_000
    began = time.process_time()
    for _ in range(count):
        cobs.encode(pack(drive))
        unpack(receiver.feed(sample)[0])
    return 1e6 * (time.process_time() - began) / count


def round_trips() -> tuple[list[float], list[float]]:
    """Return round trips in us: medians of batches, firmware and echo in turn."""
    firmware, echo = [], []
    with _device() as to_firmware, _echo() as to_echo:
        for _ in range(_ROUND_COUNT):
            firmware.append(_batch(to_firmware))
            echo.append(_batch(to_echo))
    return firmware, echo


def _batch(trip: Callable[[], None]) -> float:
    times = []
    for _ in range(_TRIPS_PER_ROUND):
        began = time.perf_counter()
        trip()
        times.append(time.perf_counter() - began)
    return 1e6 * statistics.median(times)


@contextmanager
def _device() -> Iterator[Callable[[], None]]:
    """Ask the native firmware for a parameter, through the project's own link, message to message."""
    with VirtualDevice(load_rig("bench-1khz"), clock=SimulatedClock()) as device:
        device.run_ticks(1)
        link = SerialLink(device.port, 1_000_000)
        link.open()
        try:

            def trip() -> None:
                link.send(pack(ParameterGet(Parameter.PERIOD_US)))
                while (frame := link.receive(_ANSWER_TIMEOUT_S)) is not None:
                    if isinstance(unpack(frame), ParameterValue):
                        return
                raise TimeoutError("the firmware does not answer")

            yield trip
        finally:
            link.close()


@contextmanager
def _echo() -> Iterator[Callable[[], None]]:
    """Send as many bytes through plain pyserial, to a program that sends them back."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder) / "echo.c", Path(folder) / "echo"
        source.write_text(_ECHO_SOURCE, "utf-8")
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, "-O2", "-o", program, source], check=True)  # noqa: S603 - our own
        with subprocess.Popen(  # noqa: S603 - our own
            [program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as peer:
            assert peer.stdout is not None  # noqa: S101 - it was asked for
            with serial.Serial(peer.stdout.readline().strip(), 1_000_000, timeout=_ANSWER_TIMEOUT_S) as port:
                question = cobs.encode(pack(ParameterGet(Parameter.PERIOD_US)))
                answer = cobs.encode(pack(ParameterValue(Parameter.PERIOD_US, 1000, 0)))

                def trip() -> None:
                    port.write(answer)  # as many bytes as the longer of the two ways
                    if len(port.read(len(answer))) < len(question):
                        raise TimeoutError("the echo does not answer")

                yield trip
            peer.terminate()
