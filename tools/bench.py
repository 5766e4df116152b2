"""`make bench`: what things cost, as a table and as JSON; ratios are taken within one run."""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import load_rig, loop, run, simulate
from dcmp_hil.assembly import assemble
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.paper import PaperObserver
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Cycle, Sample
from tools.bench_core import core_ratios
from tools.bench_lanes import BARS, LaneCosts, lane_costs
from tools.bench_lateness import Lateness, lateness, period_us
from tools.bench_observers import RATIO_MAX, observer_costs
from tools.bench_simulate import simulate_costs
from tools.bench_telemetry import Endurance, endurance, record_us
from tools.bench_wire import codec_us, round_trips

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import Observer

_ROUND_COUNT = 7


@dataclass(frozen=True, slots=True)
class Row:
    """One measured figure: the median of some rounds, and their range."""

    what: str
    median: float
    low: float
    high: float
    unit: str
    goal: str


class _NoTelemetry:
    """Telemetry off, and a stop that is never requested."""

    requested = False

    def record(self, cycle: Cycle) -> None:
        """Ignore the cycle: telemetry is off."""


def _row(what: str, unit: str, goal: str, measure: Callable[[], float]) -> Row:
    return _row_of(what, [measure() for _ in range(_ROUND_COUNT)], unit, goal)


def _row_of(what: str, values: Sequence[float], unit: str, goal: str) -> Row:
    return Row(what, statistics.median(values), min(values), max(values), unit, goal)


def _line_factor(rig: Rig, *, telemetry: bool, seconds: float = 20.0) -> float:
    """Device time over CPU time of the whole loop, in virtual time."""
    line, _ = assemble(rig, SimulatedClock(), [], in_line=True)
    if not telemetry:
        line = replace(line, telemetry=_NoTelemetry())
    with line.backend:
        began = time.process_time()
        loop.run(line, seconds, _NoTelemetry())
        return seconds / (time.process_time() - began)


def _whole_factor(rig: Rig, seconds: float = 20.0) -> float:
    """Device time over CPU time of `run()` by the loop: figures and all columns kept."""
    began = time.process_time()
    simulate(rig, seconds, plain=True)
    return seconds / (time.process_time() - began)


def _step_us(make: Callable[[], Observer]) -> float:
    """Cost of one observer step on a quantised sine, us."""
    count = 2 * math.pi / 4096
    samples = [Sample(1e-3 * k, count * round(math.sin(5e-4 * k) / count), 1.0) for k in range(20_000)]
    update = make().update
    began = time.process_time()
    for sample in samples:
        update(sample)
    return 1e6 * (time.process_time() - began) / len(samples)


def _odd_step_us(setting: ObserverContext) -> float:
    """Cost of one step of the default observer where the device's clock is 5 % off, us."""
    samples = [Sample(1.05e-3 * k, 1e-3 * (k % 7), 1.0) for k in range(4000)]
    update = SuperTwisting(setting).update
    began = time.process_time()
    for sample in samples:
        update(sample)
    return 1e6 * (time.process_time() - began) / len(samples)


def _command_s(*arguments: str) -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - our own
    return time.perf_counter() - began


def _rows() -> list[Row]:
    bench, coarse = load_rig("bench-1khz"), load_rig("bench-1khz", ["sim.step_us=500"])
    setting = ObserverContext(bench.model.values(), bench.period, bench.encoder.counts)
    return [
        _row(
            "loop in virtual time, telemetry off, plant step 200 us",
            "x",
            ">= 100",
            lambda: _line_factor(bench, telemetry=False),
        ),
        _row(
            "loop in virtual time, telemetry off, plant step 500 us",
            "x",
            ">= 100",
            lambda: _line_factor(coarse, telemetry=False),
        ),
        _row(
            "loop in virtual time, ring and black box on, 200 us",
            "x",
            "",
            lambda: _line_factor(bench, telemetry=True),
        ),
        _row("run() by the loop, figures and columns kept, 200 us", "x", "", lambda: _whole_factor(bench)),
        *_simulate_rows(),
        _row("super_twisting (R1), one step", "us", "<= 2", lambda: _step_us(lambda: SuperTwisting(setting))),
        _row(
            "super_twisting, a step 5 % off the period",
            "us",
            "<= 12",
            lambda: _odd_step_us(setting),
        ),
        _row("paper (R0), one step", "us", "", lambda: _step_us(lambda: PaperObserver(setting))),
        *_core_rows(),
        *_observer_rows(),
        _row(
            "sim-board: the same loop with wire and firmware, 200 us",
            "x",
            ">= 50",
            lambda: _line_factor(load_rig("bench-1khz", ["backend.kind=sim-board"]), telemetry=False),
        ),
        _row("encode a DRIVE and decode a SAMPLE, COBS", "us", "<= 2", codec_us),
        _row("one period on the host, bytes to bytes, with its record", "us", "<= 12", period_us),
        _row("of that, for telemetry: one period recorded", "us", "<= 2", record_us),
        *_wire_rows(),
        _row("dcmp-hil --help", "s", "<= 0.4", lambda: _command_s("-m", "dcmp_hil", "--help")),
        _row("python -c pass, the floor of that", "s", "", lambda: _command_s("-c", "pass")),
    ]


def _core_rows() -> list[Row]:
    """Compare a run on the core with the same run on the Python plant, taken in turn."""
    found = [core_ratios(step_us) for step_us in (200.0, 20.0)]
    return [
        _row_of(
            f"run() by the loop, the Python plant to the core, {one.step_us:g} us", one.ratios, "x", one.goal
        )
        for one in found
    ]


def _simulate_rows() -> list[Row]:
    """Compare whole runs in the core and in the loop, taken in turn."""
    found = simulate_costs()
    return [
        _row_of("simulate() by the loop, 30 s as shipped", found.loop, "x", ""),
        _row_of("simulate() in the core, 30 s as shipped", found.core, "x", found.goal),
        _row_of("ratio of the two", found.ratios, "x", ""),
    ]


def _observer_rows() -> list[Row]:
    """One step of every observer on the samples of one ride, taken in turn."""
    costs = observer_costs()
    return [
        *(_row_of(f"{kind}, one step on a ride", us, "us", "") for kind, us in costs.us.items()),
        _row_of("ratio, friction_kalman to super_twisting", costs.ratios, "x", f"<= {RATIO_MAX:g}"),
    ]


def _lane_rows(found: LaneCosts) -> list[Row]:
    """Rows of a sweep in lanes at one step of the plant."""
    at = f"lanes ({found.instruction_set}), plant step {found.bars.step_us:g} us"
    millions = [rate / 1e6 for rate in found.lanes_cycles_s]
    ratio, sweep = found.goals
    return [
        _row_of(f"{at}: cycles a CPU-second", millions, "1e6", ""),
        _row_of("ratio to the plain loop with the plant in Python", found.ratios, "x", ratio),
        _row_of("CPU time of 10,000 runs of 30 s at that rate", found.sweep_s, "s", sweep),
    ]


def _wire_rows() -> list[Row]:
    """Round trips over a pseudo terminal: the ratio is of medians of the same run, taken in turn."""
    firmware, echo = round_trips()
    ratios = [one / other for one, other in zip(firmware, echo, strict=True)]
    return [
        _row_of("round trip to the native firmware, message to message", firmware, "us", ""),
        _row_of("plain pyserial echo, as many bytes", echo, "us", ""),
        _row_of("ratio of the two", ratios, "x", "<= 2"),
    ]


def _lateness_rows(found: Lateness) -> list[Row]:
    """Rows of one rate: C, the loop, the loop with a recording; taken in turn."""
    at = f"{found.rate / 1e3:g} kHz, p99.9"
    return [
        _row_of(f"lateness at {at}, C clock_nanosleep", found.c, "us", ""),
        _row_of(f"lateness at {at}, the loop", found.ours, "us", ""),
        _row_of(f"lateness at {at}, recordings and dashboard on", found.recorded, "us", ""),
        Row("ratio of the medians, the loop to C", *found.ratio(found.ours), "x", found.goal),
        Row("ratio of the medians, all on, to C", *found.ratio(found.recorded), "x", found.goal),
        Row("ratio of the medians, all on to all off", *found.dashboard, "x", "<= 1.1"),
        _row_of("mean rate error", found.rate_error, "%", "+-0.01"),
        _row_of("drift", found.drift, "us/s", "0"),
    ]


def _endurance_rows(found: Endurance) -> list[Row]:
    """Rows of a long run at 10 kHz with recordings and dashboard."""
    at = f"{found.rate / 1e3:g} kHz, all on"
    return [
        _row_of(f"{at}: periods that telemetry lost", [found.dropped], "", "0"),
        _row_of(f"{at}: memory of its process, 256 of it history", found.resident_mb, "MB", "<= 500"),
        _row_of(f"{at}: run.mcap a minute", [found.mcap_mb_a_minute], "MB", ""),
        _row_of(f"{at}: run.rrd a minute", [found.rrd_mb_a_minute], "MB", ""),
    ]


def _figures(step_us: float) -> dict[str, float | None]:
    """Show that the figures of the default rig hold at the plant step that was timed."""
    overrides = ["supervisor.start=immediate", "sim.position_rad=-1.57", f"sim.step_us={step_us}"]
    figures = run(load_rig("bench-1khz", overrides), duration=30.13, fast=True, window_from=5.0).summary
    tracking = figures.tracking_rms_rad
    return {
        "plant_step_us": step_us,
        "tracking_rms_mrad": None if tracking is None else 1e3 * tracking,
        "velocity_error_rms_rad_s": figures.velocity_error_rms_rad_s,
        "disturbance_error_rms_rad_s2": figures.disturbance_error_rms_rad_s2,
        "voltage_tv_V_s": figures.voltage_tv_V_s,
    }


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, default=Path("bench.json"), metavar="FILE")
    parser.add_argument("--seconds", type=float, default=3.0, help="of each run that measures lateness")
    parser.add_argument("--rounds", type=int, default=10, help="of runs that measure lateness, in turn")
    parser.add_argument("--endurance", type=float, default=60.0, help="s at 10 kHz with all on; 0: none")
    asked = parser.parse_args()
    target: Path = asked.json
    rows = _rows()
    lanes = [lane_costs(bars) for bars in BARS]
    rows += [row for found in lanes for row in _lane_rows(found)]
    for rate in (1000.0, 10_000.0):
        rows += _lateness_rows(lateness(rate, asked.rounds, asked.seconds))
    if asked.endurance > 0.0:
        rows += _endurance_rows(endurance(seconds=asked.endurance))
    figures = [_figures(step) for step in (20.0, 200.0, 500.0)]
    write = sys.stdout.write
    write(f"{'':56}{'median':>10}{'min':>10}{'max':>10}  unit  goal\n")
    for row in rows:
        write(f"{row.what:56}{row.median:10.3f}{row.low:10.3f}{row.high:10.3f}  {row.unit:4}  {row.goal}\n")
    write("\n" + "".join(f"{found.verdict}\n" for found in lanes))
    write(
        "\nthe figures at these plant steps (theory: tracking < .28 mrad, v < .0075, w < .28, TV 60 to 80)\n"
    )
    for row_of_figures in figures:
        write("  ".join(f"{name} {value:.4g}" for name, value in row_of_figures.items()) + "\n")
    document = {"rows": [asdict(row) for row in rows], "figures": figures}
    target.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    write(f"\nwrote {target}\n")


if __name__ == "__main__":
    main()
