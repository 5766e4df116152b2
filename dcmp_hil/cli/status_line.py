"""The live status line of a run, as wide as the terminal allows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rich.cells import cell_len
from rich.live import Live
from rich.text import Text

from dcmp_hil.cli.console import print_sentence, take_width
from dcmp_hil.telemetry.statistics import Durations
from dcmp_hil.values import PhaseData

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

_WARNING_STYLE = "yellow"
_GAP = "  "
_NEVER_LEFT_OUT = 0
_FIRST_LEFT_OUT = 5


class Field(NamedTuple):
    """One value of the status line.

    Parameters
    ----------
    rank
        The field with the largest rank is left out first, one with rank 0 never.
    long, short
        The value with its name and unit, in words and abbreviated.
    bare
        Without a unit; for terminals that are too narrow for anything else.
    """

    rank: int
    long: str
    short: str
    bare: str = ""


def fitted(fields: Sequence[Field], columns: int) -> str:
    """Return the fields in a line of at most `columns` columns, if those of rank 0 fit.

    The names are words where all fields fit but the one that is left out first; else they are abbreviated,
    and fields are left out.
    """
    long = [field.long for field in fields]
    if _columns(long) <= columns:
        return _GAP.join(long)
    long = [field.long for field in fields if field.rank < _FIRST_LEFT_OUT]
    if _columns(long) <= columns:
        return _GAP.join(long)
    for least in range(_FIRST_LEFT_OUT, _NEVER_LEFT_OUT, -1):
        short = [field.short for field in fields if field.rank < least]
        if _columns(short) <= columns:
            return _GAP.join(short)
    return _GAP.join(field.bare for field in fields if field.rank == _NEVER_LEFT_OUT)


def _columns(parts: Sequence[str]) -> int:
    return cell_len(_GAP.join(parts))


class StatusLine:
    """A sink that shows the newest cycle on one line, and events above it.

    Parameters
    ----------
    console
        Where to; nothing live is drawn unless it is a terminal, events are printed anyway.
    period
        s, nominal, to tell which samples are late.
    """

    def __init__(self, console: Console, period: float) -> None:
        self._console = console
        self._period = period
        self._phase = ""
        self._late = 0
        self._lateness = Durations()
        self._live: Live | None = None

    def block(self, block: Block) -> None:
        """Show the last of these periods."""
        self._late += int((block["lateness"] > 0.5 * self._period).sum())
        if not self._console.is_terminal:
            return
        self._lateness.add(block["lateness"])
        if self._live is None:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        take_width(self._console)
        line = fitted(self._fields(block), self._console.width)
        self._live.update(Text(line, no_wrap=True, overflow="crop"), refresh=True)

    def event(self, event: Event) -> None:
        """Print warnings; remember the phase. An error is the run's end, which says it itself, once."""
        if isinstance(event.data, PhaseData):
            self._phase = event.data.phase
        elif event.level == "WARN":
            print_sentence(self._console, Text(f"{event.t:8.3f} s  {event.text}", style=_WARNING_STYLE))

    def close(self) -> None:
        """Remove the status line; the summary follows."""
        if self._live is not None:
            self._live.stop()

    def _fields(self, block: Block) -> tuple[Field, ...]:
        lateness = self._lateness.percentiles()
        t, position, voltage = (float(block[name][-1]) for name in ("t", "position", "voltage_sent"))
        error, w = f"{1e3 * block.tracking_error[-1]:+7.2f}", float(block["disturbance_estimate"][-1])
        if math.isnan(block.tracking_error[-1]):  # nothing is tracked yet
            error = f"{'-':>7}"
        late = f"late {self._late}"
        return (
            Field(1, f"{t:8.2f} s", f"{t:8.2f} s"),
            Field(3, f"{self._phase:8}", f"{self._phase:8}"),
            Field(4, f"position {position:+7.3f} rad", f"pos {position:+7.3f} rad"),
            Field(0, f"error {error} mrad", f"err {error} mrad", f"err {error.strip()}"),
            Field(2, f"voltage {voltage:+6.2f} V", f"u {voltage:+6.2f} V"),
            Field(0, f"w {w:+7.2f} rad/s²", f"w {w:+7.2f} rad/s²", f"w {w:+.2f}"),
            Field(0, late, late, late),
            Field(5, f"lateness {lateness.p99:.0f} µs p99, {lateness.max:.0f} max", ""),
        )
