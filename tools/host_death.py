"""`python -m tools.host_death`: kill, stop and unplug real hosts; when the amplifier goes off."""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import statistics
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.values import Fault
from sim_backend.board.virtual_device import VirtualDevice
from tools.cable import Cable
from tools.hosts import ATTEMPTS_MAX, DOUBT_MAX_US, WAIT_TIMEOUT_S, is_driven, start_host, wait

if TYPE_CHECKING:
    import subprocess

OFF_TIME_MAX_US = 21_000  # watchdog and a period
DETECTION_TIME_MAX_US = 2_000  # where the device sees its line go down
COMMAND_AGE_MAX_US = 3_000  # how old a command may be that still counts
WAYS = {"SIGKILL": ("LINK_DOWN", (-9,)), "SIGSTOP": ("HOST_SILENT", (3, 4)), "unplug": ("LINK_DOWN", (3, 4))}
"""What the device must say, and with what the host may end: a stopped one goes on later, and finds out."""


_HEAD = (
    "| host | n | 0 V after, ms: median | max | after its last command: max | bound "
    "| after host or line was gone: max | bound "
    "| the device says | host's code | wrong | started again | doubt, ms |"
)


class Death(NamedTuple):
    """End of one host, and the device's reaction; times by the firmware's clock."""

    way: str
    off_us: int  # from the deed to 0 V
    silent_us: int  # from the last command that counted to 0 V: what the watchdog goes by
    fed_us: int  # from the deed to that command, which a busy computer may bring late; below 0: before it
    seen_us: int | None  # from the line going down to 0 V; None if it did not
    fault: str  # what the device says it was
    exit_code: int  # of the host
    doubt_us: int  # by which both may be less
    stayed_off: bool  # until the end, for anything that the host did
    tries: int  # hosts that were started for it: one that was late by itself, or ill timed, does not count

    @property
    def wrong(self) -> list[str]:
        """Requirements that the result violates."""
        fault, codes = WAYS[self.way]
        if self.way == "SIGKILL" and self.seen_us == 0 and self.fault == "HOST_SILENT":
            fault = "HOST_SILENT"  # a busy computer took longer to end the process than the watchdog takes
        fed_us, seen_us = self.fed_us - self.doubt_us, (self.seen_us or 0) - self.doubt_us
        silent = f"0 V {1e-3 * self.silent_us:.1f} ms after the last command"
        return [
            *([silent] if self.silent_us > OFF_TIME_MAX_US else []),
            *(
                [f"a command counted {1e-3 * fed_us:.1f} ms after the deed"]
                if fed_us > COMMAND_AGE_MAX_US
                else []
            ),
            *(
                [f"0 V {1e-3 * seen_us:.1f} ms after the line went down"]
                if seen_us > DETECTION_TIME_MAX_US
                else []
            ),
            *([f"the device says {self.fault}"] if self.fault != fault else []),
            *([f"the host ended with {self.exit_code}"] if self.exit_code not in codes else []),
            *([] if self.stayed_off else ["the amplifier came on again"]),
        ]


def die(way: str) -> Death:
    """Run a real host with a virtual device, separate them, and return the result."""
    for tries in range(1, ATTEMPTS_MAX + 1):
        with ExitStack() as stack:
            device = stack.enter_context(VirtualDevice(load_rig("bench-1khz"), clock=MonotonicClock()))
            device.start()
            cable = stack.enter_context(Cable(device.port)) if way == "unplug" else None
            host = start_host(cable.port if cable else device.port, "--duration", "0", "--no-record")
            try:
                if is_driven(device, host):
                    death = _part(device, host, way, cable)
                    if death.doubt_us <= DOUBT_MAX_US:
                        return death._replace(tries=tries)
            finally:
                host.kill()
                host.communicate(timeout=WAIT_TIMEOUT_S)
    raise RuntimeError(f"{ATTEMPTS_MAX} hosts ran into the watchdog by themselves: this computer is too busy")


def _part(device: VirtualDevice, host: subprocess.Popen[bytes], way: str, cable: Cable | None) -> Death:
    if cable is not None:
        cable.loosen()  # so that nothing is between the clock and the deed
    began_us, _ = device.clock_us()
    if cable is not None:
        cable.pull()
    else:
        host.send_signal(signal.Signals[way])
        os.waitid(os.P_PID, host.pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT)
    done_us, doubt_us = device.clock_us()  # it is done by now
    wait(lambda: not device.output.enable, "the amplifier is off")
    off = next(output for output in tuple(device.log) if output.fault and not output.enable)
    if way == "SIGSTOP":
        host.send_signal(signal.SIGCONT)
    code = host.wait(WAIT_TIMEOUT_S)
    since = [output for output in tuple(device.log) if output.since_us >= off.since_us]
    deed_us = done_us if way == "SIGSTOP" else began_us
    return Death(
        way=way,
        off_us=off.since_us - deed_us,
        silent_us=off.since_us - off.fed_us,
        fed_us=off.fed_us - deed_us,
        seen_us=None if way == "SIGSTOP" else max(0, off.since_us - (began_us if cable else done_us)),
        fault=Fault(off.fault).name,
        exit_code=code,
        doubt_us=doubt_us,
        stayed_off=not any(output.enable or output.voltage_mV for output in since),
        tries=1,
    )


def table(deaths: list[Death]) -> str:
    """Return the figures as Markdown; milliseconds of the firmware's clock."""
    rows = [_HEAD, re.sub("[^|]+", "---", _HEAD)]
    for way in WAYS:
        these = [death for death in deaths if death.way == way]
        off = [1e-3 * death.off_us for death in these]
        seen = [1e-3 * death.seen_us for death in these if death.seen_us is not None]
        if not these:
            continue
        line = (f"{max(seen):.1f}", f"{1e-3 * DETECTION_TIME_MAX_US:g}") if seen else ("", "")
        cells = (
            way, len(these), f"{statistics.median(off):.1f}", f"{max(off):.1f}",
            f"{1e-3 * max(death.silent_us for death in these):.1f}", f"{1e-3 * OFF_TIME_MAX_US:g}", *line,
            ", ".join(sorted({death.fault for death in these})),
            ", ".join(sorted({str(death.exit_code) for death in these})),
            sum(bool(death.wrong) for death in these), sum(death.tries - 1 for death in these),
            f"{1e-3 * max(death.doubt_us for death in these):.2f}",
        )  # fmt: skip
        rows.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(rows)


def main() -> int:
    """Measure, print, write; 1 if a bound was broken."""
    parser = argparse.ArgumentParser(prog="python -m tools.host_death", description=__doc__)
    parser.add_argument("--n", type=int, default=30, help="hosts of each way (default: 30)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go as well")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the table goes as well")
    asked = parser.parse_args()
    deaths = [die(way) for way in WAYS for _ in range(asked.n)]
    said = table(deaths) + "\n"
    wrong = [f"{death.way}: {', '.join(death.wrong)}\n" for death in deaths if death.wrong]
    sys.stdout.write(said + "".join(wrong))
    if asked.markdown:
        asked.markdown.write_text(said, encoding="utf-8")
    if asked.json:
        asked.json.write_text(json.dumps([death._asdict() for death in deaths], indent=2) + "\n", "utf-8")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
