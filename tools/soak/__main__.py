"""`make soak-long`, `make soak`: hours of a run's data by rate, or an hour by the wall clock.

What must hold: no process grows by 0.2 MB or more a simulated minute after the first five, all of them
together take 500 MB at most, and no period is lost.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from tools.soak.by_rate import soak
from tools.soak.real import real


def main() -> None:
    """Run the soak, print its figures, and report violations."""
    parser = argparse.ArgumentParser(prog="python -m tools.soak", description=__doc__)
    parser.add_argument(
        "--minutes", type=float, default=480.0, help="of simulated time; in less than 30 noise is a slope"
    )
    parser.add_argument("--speed", type=float, default=200.0, help="times real time, at most")
    parser.add_argument(
        "--history", default="64MiB", help="that the dashboard's server keeps for late viewers"
    )
    parser.add_argument("--leak", type=float, default=0.0, help="MB a simulated minute, to see it found")
    parser.add_argument("--real", action="store_true", help="`dcmp-hil run`, by the wall clock")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if options.real:
            soaked = real(options.minutes, folder)
        else:
            soaked = soak(options.minutes, options.speed, folder, options.history, options.leak)
    sys.stdout.write(json.dumps(soaked.document()) + "\n")
    if faults := soaked.faults():
        sys.exit("; ".join(faults))


if __name__ == "__main__":
    main()
