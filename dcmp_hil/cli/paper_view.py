"""The two tables of `dcmp-hil paper`, made to fit 80 columns."""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.paper import Misprint, Reproduction


class _Shown(NamedTuple):
    """Display of a quantity: its name, and a unit that keeps its figures short."""

    name: str
    unit: str
    scale: float = 1.0

    def number(self, value: float | None) -> str:
        return "-" if value is None else _plain(self.scale * value)

    def bounds(self, low: float, high: float) -> str:
        if low == 0.0:
            return f"< {self.number(high)}"
        return f"{_plain(self.scale * low, 5)}–{_plain(self.scale * high, 5)}"  # noqa: RUF001 - a range


_COLUMNS_SHOWN = {
    "voltage_at_start_V": _Shown("voltage at t = 0", "V"),
    "tracking_max_rad": _Shown("tracking error, max", "µrad", 1e6),
    "tracking_rms_rad": _Shown("tracking error, RMS", "µrad", 1e6),
    "velocity_error_max_rad_s": _Shown("velocity error, max", "mrad/s", 1e3),
    "disturbance_error_rms_rad_s2": _Shown("w error, RMS", "rad/s²"),
    "velocity_settled_s": _Shown("v error < 0.1 from", "s"),
    "voltage_peak_V": _Shown("voltage, peak", "V"),
    "damping": _Shown("damping coefficient", ""),
}


def reproduction_table(reproduction: Reproduction) -> Table:
    """Return the table of claims, results of the printed and corrected equations, and verdicts."""
    start, stop = reproduction.corrected.summary.window_s
    table = _table(f"The paper, reproduced: errors and peak from {start:g} to {stop:g} s")
    table.caption = "claimed: errors are orders of magnitude, the time is an upper bound"
    table.add_column("quantity", no_wrap=True)
    table.add_column("unit", style="dim", no_wrap=True)
    for heading in ("claimed", "printed\n(9)", "printed\n(10)", "corrected", "tolerance"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("pass", no_wrap=True)
    for row in reproduction.rows:
        shown = _COLUMNS_SHOWN[row.quantity]
        table.add_row(
            shown.name,
            shown.unit,
            *(shown.number(value) for value in (row.claimed, row.printed_eq9, row.printed_eq10)),
            Text(shown.number(row.corrected), "bold"),
            shown.bounds(row.low, row.high),
            _verdict(row.passed),
        )
    return table


def misprint_table(reproduction: Reproduction) -> Table:
    """Return a table of the error that each misprint causes."""
    table = _table("The misprints: what each costs")
    table.add_column("misprint → meant", no_wrap=True)
    table.add_column("quantity", no_wrap=True)
    table.add_column("unit", style="dim", no_wrap=True)
    for heading in ("printed", "expected", "corrected"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("pass", no_wrap=True)
    for _, group in groupby(reproduction.misprints, key=lambda one: one.equation):
        table.add_row(*_misprint_cells(list(group)))
    return table


def _misprint_cells(group: list[Misprint]) -> Iterator[Text]:
    """Make one row of what one misprint costs, a line for each quantity."""
    first = group[0]
    yield Text(f"{first.equation} {first.printed}\n→ {first.meant}")
    lines = (
        (
            Text(shown.name),
            Text(shown.unit),
            Text(shown.number(one.as_printed)),
            Text(shown.bounds(one.low, one.high)),
            Text(shown.number(one.corrected), "bold"),
            _verdict(one.passed),
        )
        for one in group
        for shown in (_COLUMNS_SHOWN[one.quantity],)
    )
    for cells in zip(*lines, strict=True):
        yield Text("\n").join(cells)


def _table(title: str) -> Table:
    return Table(
        title=title,
        title_justify="left",
        caption_justify="left",
        box=None,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )


def _plain(value: float, digits: int = 4) -> str:
    """Round to significant digits, never in the e notation that %g falls back to."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _verdict(passed: bool) -> Text:
    return Text("yes", "green") if passed else Text("no", "bold red")
