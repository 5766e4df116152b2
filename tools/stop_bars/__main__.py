"""`python -m tools.stop_bars`: STOP against controllers that are bad to their run, timed at the device."""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tools.stop_bars.attack import attack
from tools.stop_bars.bars import KINDS, REQUIRED, WAYS, table


def main() -> int:
    """Attack, print; 1 if a bound was broken."""
    parser = argparse.ArgumentParser(prog="python -m tools.stop_bars", description=__doc__)
    parser.add_argument("--n", type=int, default=100, help="STOPs for each kind of controller (default: 100)")
    parser.add_argument("--kind", action="append", choices=KINDS, help="only this one; may be repeated")
    parser.add_argument("--way", action="append", choices=WAYS, help="only this one; may be repeated")
    parser.add_argument("--required", action="store_true", help="only the six kinds that CI asks for")
    parser.add_argument("--jobs", type=int, default=1, help="at a time (default: 1)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the table goes as well")
    asked = parser.parse_args()
    ways = asked.way or WAYS
    kinds = asked.kind or (REQUIRED if asked.required else KINDS)
    jobs = [(kind, ways[k % len(ways)]) for kind in kinds for k in range(asked.n)]
    with ThreadPoolExecutor(asked.jobs) as pool:
        bars = []
        for bar in pool.map(lambda job: attack(*job), jobs):
            bars.append(bar)
            sys.stderr.write(
                f"{len(bars)}/{len(jobs)} {bar.kind}, {bar.way}: {'; '.join(bar.wrong) or 'well'}\n"
            )
    said = table(bars) + "\n"
    wrong = [f"{bar.kind}, {bar.way}: {'; '.join(bar.wrong)}\n" for bar in bars if bar.wrong]
    sys.stdout.write(said + "".join(wrong))
    if asked.markdown:
        asked.markdown.write_text(said, encoding="utf-8")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
