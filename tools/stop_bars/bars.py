"""Cases of STOP, the result of one STOP, and the table of many."""

from __future__ import annotations

import re
import signal
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

HOSTILE = Path(__file__).parents[2] / "tests/attacks/hostile/controllers.py"
ZERO_TIME_MAX_S = 1.1
"""s, from STOP until the device is at 0 V."""
SIGNALS = {"SIGINT": signal.SIGINT, "SIGTERM": signal.SIGTERM, "SIGHUP": signal.SIGHUP}
WAYS = ("stop", "panel", "Ctrl-C", "terminal", *SIGNALS)
"""`dcmp-hil stop`; the page's STOP; Ctrl-C in a terminal; a closed terminal; a signal to the run alone."""
STUCK = ("SwallowsForEver", "BlocksInC", "Sleeps", "BusyLoop", "BusyLoopDeaf", "ForksThenBlocks")
"""Their loop stands still once they have turned bad."""
KINDS = (
    *("Good", "HandlersSet", "HandlersSetEachPeriod", "SignalsIgnored", "SignalsIgnoredInC"),
    *("SignalsBlocked", "Swallows", "Forks", "Worker", "Threads"),
    *STUCK,
)
REQUIRED = ("HandlersSet", "SignalsIgnored", "Swallows", "Forks", "BlocksInC", "BusyLoop")


class Bar(NamedTuple):
    """Result of one STOP."""

    kind: str
    way: str
    zero_s: float  # from STOP to 0 V, by the firmware's clock
    answer_s: float  # from STOP to its answer, by wall; to the run's last words, or its end, after a signal
    said: str  # the answer, where there is one
    ended_by: str  # of summary.json
    exit_code: int  # of the run
    wrong: tuple[str, ...]  # what is not as it must be


def table(bars: Sequence[Bar]) -> str:
    """Return the figures as Markdown."""
    head = (
        "| controller | way | n | 0 V after, ms: median | max | told after, ms: median | max "
        "| ended by | code | wrong |"
    )
    rows = [head, re.sub("[^|]+", "---", head)]
    for kind, way in sorted({(bar.kind, bar.way) for bar in bars}):
        these = [bar for bar in bars if (bar.kind, bar.way) == (kind, way)]
        zero, told = [1e3 * bar.zero_s for bar in these], [1e3 * bar.answer_s for bar in these]
        cells = (
            kind, way, len(these), f"{statistics.median(zero):.0f}", f"{max(zero):.0f}",
            f"{statistics.median(told):.0f}", f"{max(told):.0f}",
            ", ".join(sorted({bar.ended_by for bar in these})),
            ", ".join(sorted({str(bar.exit_code) for bar in these})), sum(bool(bar.wrong) for bar in these),
        )  # fmt: skip
        rows.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(rows)
