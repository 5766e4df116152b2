"""`python -m tools.host_endings`: end real hosts in every way that leaves them a last word."""

from __future__ import annotations

import argparse
import json
import re
import signal
import statistics
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import State
from sim_backend.board.virtual_device import VirtualDevice
from tools.hosts import ATTEMPTS_MAX, WAIT_TIMEOUT_S, is_driven, start_host, wait

if TYPE_CHECKING:
    import subprocess

OFF_US, USUAL_US, GONE_S = 50_000, 3_000, 2.0
"""Until 0 V, each and the median: a period until the loop looks, one for its 0 V, one until it is applied."""
_WATCHDOG_MS = 50  # of no matter here, and a busy computer is not to meet it
_PERIOD_US = 1_000
_GAP_MAX_US = 10_000
"""Between two ticks of its device. More explains a wrong end: after 20 ms a host takes it for dead."""
_ENDING_DOUBT_MAX_US = 5_000
_RAISE_TIME_S = 1.2  # s, device time at which a host's own part raises

_PLUGIN_SOURCE = f'''
import time
from pathlib import Path

import dcmp_hil.loop

class Wrong(BaseException):
    """Not even an Exception."""

class _Raises:
    def __init__(self, setting, what="ValueError"):
        self._what = {{"ValueError": ValueError, "Wrong": Wrong}}.get(what)
        self._says = what

    def _look(self, t):
        if t >= {_RAISE_TIME_S}:
            waited = Path("/proc/self/schedstat").read_text().split()[1]
            Path("deed").write_text(f"{{time.monotonic_ns()}} {{waited}}")
            if self._what is not None:
                raise self._what("on purpose")
            if self._says == "the loop":
                dcmp_hil.loop.make = None
                return 0.0
            return self._says

class Controller(_Raises):
    def update(self, reference, state):
        self._t = getattr(self, "_t", 0.0) + 1e-3
        pull = 4000.0 * (reference.position - state.position) + 130.0 * (reference.velocity - state.velocity)
        said = self._look(self._t)
        return (pull - state.disturbance) / 5.4 if said is None else said

class Observer(_Raises):
    def __init__(self, setting, what="ValueError"):
        from dcmp_hil.control.observers.super_twisting import SuperTwisting
        super().__init__(setting, what)
        self._real = SuperTwisting(setting)

    def update(self, sample):
        self._look(sample.t)
        return self._real.update(sample)
'''
"""A user's own observer and controller, which go wrong; they write down when."""


class Way(NamedTuple):
    """A way to end a host."""

    code: int  # with which it must leave
    number: signal.Signals | None = None  # sent to it
    overrides: tuple[str, ...] = ()  # with which it ends by itself
    left: tuple[str, str] = ("IDLE", "NONE")  # state and fault of the device, afterwards


_TRIPPED = 4, ("FAULT", "STOPPED")  # what a class of the user's own does wrong is a trip
_BROKEN = 1, ("IDLE", "NONE")


def _part_of(section: str, kind: str, what: str, end: tuple[int, tuple[str, str]]) -> Way:
    code, left = end
    overrides = (f"{section}.kind=goes_wrong:{kind}", f'{section}.options={{what = "{what}"}}')
    return Way(code, None, overrides, left)


WAYS = {
    "Ctrl-C": Way(0, signal.SIGINT),
    "SIGTERM": Way(143, signal.SIGTERM),
    "SIGHUP": Way(129, signal.SIGHUP),
    "controller: Exception": _part_of("controller", "Controller", "ValueError", _TRIPPED),
    "controller: BaseException": _part_of("controller", "Controller", "Wrong", _TRIPPED),
    "observer: Exception": _part_of("observer", "Observer", "ValueError", _TRIPPED),
    "observer: BaseException": _part_of("observer", "Observer", "Wrong", _TRIPPED),
    "controller: no voltage": _part_of("controller", "Controller", "no voltage", _TRIPPED),
    "the loop itself": _part_of("controller", "Controller", "the loop", _BROKEN),
}


class Ending(NamedTuple):
    """End of a host, and the device's reaction; times by the firmware's clock."""

    way: str
    off_us: int  # from the deed to 0 V
    gone_s: float  # from the deed until the process was gone; wall
    exit_code: int
    state: str  # of the device, afterwards
    fault: str  # that it kept
    kept: list[str]  # files in the run's folder that have something in them
    said: str  # the last line on stderr
    doubt_us: int  # by which off_us may be less
    waited_us: int  # of off_us: ready to run, and its computer ran something else
    late_us: int  # of off_us, at most: by which a tick of its device came too late
    pressed_s: float  # of gone_s: a process was ready to run on that computer and had to wait
    gap_us: int  # the longest between two ticks of its device, until it was gone
    tries: int  # hosts that were started for it: one that was ill timed does not count

    @property
    def own_us(self) -> int:
        """Time that the host itself took, at least, us."""
        return self.off_us - self.doubt_us - self.waited_us - self.late_us

    @property
    def well_timed(self) -> bool:
        """Whether its instants are known, and no device that stood still explains what is wrong."""
        return self.doubt_us <= _ENDING_DOUBT_MAX_US and not (self.wrong and self.gap_us > _GAP_MAX_US)

    @property
    def own_gone_s(self) -> float:
        """Time of the host's end without the waits of a busy computer, at least, s."""
        return self.gone_s - self.pressed_s

    @property
    def wrong(self) -> list[str]:
        """Requirements that the result violates."""
        code, left = WAYS[self.way].code, WAYS[self.way].left
        return [
            *([f"0 V after {1e-3 * self.own_us:.1f} ms"] if self.own_us > OFF_US else []),
            *([f"gone after {self.own_gone_s:.1f} s"] if self.own_gone_s > GONE_S else []),
            *([f"code {self.exit_code}: {self.said}"] if self.exit_code != code else []),
            *([f"{self.state} with {self.fault}"] if (self.state, self.fault) != left else []),
            *([f"kept only {self.kept}"] if not {"summary.json", "run.rrd"} <= {*self.kept} else []),
        ]


def end(name: str) -> Ending:
    """Run a real host with a virtual device, end the host, and return the result."""
    reasons = []
    for tries in range(1, ATTEMPTS_MAX + 1):
        with (
            tempfile.TemporaryDirectory() as place,
            VirtualDevice(load_rig("bench-1khz"), clock=MonotonicClock()) as device,
        ):
            folder = Path(place)
            (folder / "goes_wrong.py").write_text(_PLUGIN_SOURCE)
            device.start()
            host = _start(device.port, WAYS[name], folder)
            try:
                ending = _end(device, host, name, folder) if is_driven(device, host) else None
                if ending is not None and ending.well_timed:
                    return ending._replace(tries=tries)
                reasons.append(f"{ending.wrong}, {ending.gap_us} us" if ending else "ended by itself")
            finally:
                host.kill()
                host.communicate(timeout=WAIT_TIMEOUT_S)
    raise RuntimeError(f"no host of {ATTEMPTS_MAX} counts, this computer is too busy: {'; '.join(reasons)}")


def _start(port: str, way: Way, folder: Path) -> subprocess.Popen[bytes]:
    sets = [word for override in way.overrides for word in ("--set", override)]
    sets += ["--set", f"backend.watchdog_ms={_WATCHDOG_MS}"]
    length = "30" if way.number == signal.SIGINT else "0"  # the shorter one leaves a picture, too
    return start_host(port, "--duration", length, *sets, folder=folder)


def _end(device: VirtualDevice, host: subprocess.Popen[bytes], name: str, folder: Path) -> Ending | None:
    """End it and look; None if it ended by itself before."""
    clock, way, deed = MonotonicClock(), WAYS[name], folder / "deed"
    if way.number is not None:
        deed.write_text(f"{clock.now_ns()} {_waited_ns(host)}")
        host.send_signal(way.number)
    wait(lambda: not device.output.enable, "the amplifier is off")
    if not deed.exists():
        return None
    waited_ns, pressed_us = _waited_ns(host), _pressed_us()
    at_ns, before_ns = map(int, deed.read_text().split())
    late_us = max(0, device.longest_gap_us(at_ns) - _PERIOD_US)
    deed_us, doubt_us = device.clock_us(at_ns)
    off = next(output for output in reversed(tuple(device.log)) if output.enable or output.voltage_mV)
    off_us = next(o.since_us for o in tuple(device.log) if o.since_us > off.since_us and not o.voltage_mV)
    said = host.communicate(timeout=WAIT_TIMEOUT_S)[1].decode().strip().splitlines()
    gone_s = 1e-9 * (clock.now_ns() - at_ns)
    files = [file for file in folder.glob("runs/*/*") if file.stat().st_size]
    return Ending(
        way=name,
        off_us=off_us - deed_us,
        gone_s=gone_s,
        exit_code=host.returncode,
        state=State(device.output.state).name,
        fault=Fault(device.output.fault).name,
        kept=sorted(file.name for file in files),
        said=said[-1] if said else "",
        doubt_us=doubt_us,
        waited_us=(waited_ns - before_ns) // 1000,
        late_us=late_us,
        pressed_s=1e-6 * (_pressed_us() - pressed_us),
        gap_us=device.longest_gap_us(at_ns),
        tries=1,
    )


def _pressed_us() -> int:
    """Return how long processes were ready to run here and had to wait, in all; 0 where it is not counted."""
    try:
        text = Path("/proc/pressure/cpu").read_text("utf-8")
    except OSError:
        return 0
    return int(text.split("total=")[1].split()[0])


def _waited_ns(host: subprocess.Popen[bytes]) -> int:
    """Return how long a host's loop has been ready to run and was not let, in all."""
    return int(Path(f"/proc/{host.pid}/schedstat").read_text().split()[1])


_HEAD = (
    "| ended by | n | 0 V after, ms: median | max | gone after, s: max | without what others took "
    "| kept from running, ms: max | device late, ms: max | code "
    "| device | wrong | started again |"
)


def median_us(endings: list[Ending], *, signalled: bool) -> float:
    """Return the median time to 0 V, us, of all ways with a signal, or of all others; 0 if there is none."""
    these = (e.own_us for e in endings if (WAYS[e.way].number is not None) == signalled)
    return statistics.median([*these] or [0])


def table(endings: list[Ending]) -> str:
    """Return the figures as Markdown."""
    rows = [_HEAD, re.sub("[^|]+", "---", _HEAD)]
    for name in WAYS:
        these = [ending for ending in endings if ending.way == name]
        if not these:
            continue
        off = [1e-3 * ending.off_us for ending in these]
        cells = (
            name, len(these), f"{statistics.median(off):.1f}", f"{max(off):.1f}",
            f"{max(ending.gone_s for ending in these):.1f}",
            f"{max(ending.own_gone_s for ending in these):.1f}",
            f"{max(1e-3 * ending.waited_us for ending in these):.1f}",
            f"{max(1e-3 * ending.late_us for ending in these):.1f}",
            ", ".join(sorted({str(ending.exit_code) for ending in these})),
            ", ".join(sorted({f"{ending.state} {ending.fault}" for ending in these})),
            sum(bool(ending.wrong) for ending in these), sum(ending.tries - 1 for ending in these),
        )  # fmt: skip
        rows.append(f"| {' | '.join(map(str, cells))} |")
    bounds = (
        f"bounds, by the firmware's clock: 0 V after {1e-3 * OFF_US:g} ms, the median after "
        f"{1e-3 * USUAL_US:g} ms, less what the host was kept from running and its device was late; "
        f"gone, without what others took, after {GONE_S:g} s"
    )
    return "\n".join([*rows, "", bounds])


def main() -> int:
    """Measure, print, write; 1 if a bound was broken."""
    parser = argparse.ArgumentParser(prog="python -m tools.host_endings", description=__doc__)
    parser.add_argument("--n", type=int, default=10, help="hosts of each way (default: 10)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go as well")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the table goes as well")
    asked = parser.parse_args()
    endings = [end(name) for name in WAYS for _ in range(asked.n)]  # one at a time: each is timed
    said = table(endings) + "\n"
    wrong = [f"{ending.way}: {', '.join(ending.wrong)}\n" for ending in endings if ending.wrong]
    usual_ms = {"signals": 1e-3 * median_us(endings, signalled=True)}
    usual_ms["errors"] = 1e-3 * median_us(endings, signalled=False)
    wrong += [f"{kind}: 0 V after {ms:.1f} ms\n" for kind, ms in usual_ms.items() if ms > 1e-3 * USUAL_US]
    sys.stdout.write(said + "".join(wrong))
    if asked.markdown:
        asked.markdown.write_text(said, encoding="utf-8")
    if asked.json:
        asked.json.write_text(json.dumps([e._asdict() for e in endings], indent=2) + "\n", "utf-8")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
