"""`make encoders`: healthy runs and the reaction to faults, by the encoder's counts and the loop's rate."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from statistics import median
from typing import TYPE_CHECKING

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError, DcmpError
from dcmp_hil.session import Session
from tests import helpers
from tests.figures.detection import ENGAGED_AT_S, detect

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.helpers import FaultySim

COUNTS_PER_REV = (
    64,
    100,
    200,
    256,
    360,
    500,
    512,
    720,
    1000,
    1024,
    2000,
    2048,
    2500,
    4096,
    5000,
    8192,
    10_000,
    16_384,
    65_536,
)
RATES_HZ = (200, 500, 1000, 2000, 5000)
_FAULTS: tuple[tuple[str, type[FaultySim]], ...] = (
    ("E01 stuck encoder", helpers.StuckEncoder),
    ("P02 lost power", helpers.LostPower),
    ("P01 reversed in the run", helpers.Reversed),
    ("P01 reversed from rest, no probe", helpers.ReversedFromTheStart),
)


def healthy(counts: float, rate: float, *, seeds: int, duration: float) -> Counter[str]:
    """Run a healthy rig at several phases of the encoder; count how the runs ended."""
    ends: Counter[str] = Counter()
    for seed in range(seeds):
        try:
            rig = load_rig(
                "bench-1khz",
                [
                    f"encoder.counts_per_rev={counts}",
                    f"loop.rate_hz={rate}",
                    f"sim.seed={seed}",
                    f"sim.encoder_phase_counts={seed / seeds}",
                ],
            )
        except ConfigError:
            ends["refused"] += 1
            continue
        try:
            Session(rig, duration=duration, fast=True, keep_columns=False).run()
            ends["well"] += 1
        except DcmpError as error:
            ends[getattr(error, "reason", type(error).__name__)] += 1
    return ends


def reactions(counts: float, rate: float, *, seeds: int) -> Iterator[str]:
    """Yield a row of the table of docs/safety.md for each fault: median and longest time, true speed."""
    overrides = (f"encoder.counts_per_rev={counts}", f"loop.rate_hz={rate}")
    for name, backend in _FAULTS:
        found = detect(backend, *overrides, seeds=seeds)
        times = [each.time for each in found]
        if backend is helpers.Reversed:
            times = [each.tripped_at - each.fault_at for each in found]
        elif backend is helpers.ReversedFromTheStart:
            times = [each.tripped_at - ENGAGED_AT_S for each in found]
        speed = max(each.speed for each in found)
        typical, longest = 1e3 * median(times), 1e3 * max(times)
        yield f"| {counts} | {rate} | {name} | {typical:.0f} | {longest:.0f} | {speed:.1f} |"


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Print both tables; 1 if a healthy run did not end well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--counts", type=int, nargs="*", default=COUNTS_PER_REV)
    parser.add_argument("--rates", type=int, nargs="*", default=RATES_HZ)
    parser.add_argument(
        "--reactions", type=int, nargs="*", default=(256, 1024, 4096), help="counts, at 1 kHz"
    )
    arguments = parser.parse_args()
    failed = False
    for counts in arguments.counts:
        for rate in arguments.rates:
            ends = healthy(counts, rate, seeds=arguments.seeds, duration=7.0)
            failed |= not ends.keys() <= {"well", "refused"}
            _say(f"healthy: {counts} counts, {rate} Hz: {dict(ends)}")
    _say("| counts | Hz | fault | median ms | longest ms | true speed, rad/s |\n|---|---|---|---|---|---|")
    for counts in arguments.reactions:
        for row in reactions(counts, 1000, seeds=arguments.seeds):
            _say(row)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
