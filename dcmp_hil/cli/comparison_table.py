"""The table of observers side by side, as `run --compare` and `replay --compare` print it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from dcmp_hil.comparison import ObserverComparison, ObserverFigures

_COLUMN_WIDTH_MIN = 9  # characters: a name folds, a number does not
_JUDGED = {
    "truth": "errors against the truth",
    "zero_phase": "errors against the zero-phase reference",
    "none": "no reference for the errors",
}


def comparison_table(comparison: ObserverComparison) -> Group:
    """Return a table with a column for each observer; what is known of none of them has no row."""
    first, last = comparison.window_s or (0.0, 0.0)
    judged = _JUDGED[comparison.reference]
    table = Table(
        title=Text(f"observers on the same samples, {first:.2f} to {last:.2f} s; {judged}"),
        title_justify="left",
        title_style="",
        box=None,
        padding=(0, 2, 0, 0),
    )
    table.add_column("", no_wrap=True)
    for one in comparison.observers:
        name = f"{one.observer} (in the loop)" if one.closes_loop else one.observer
        table.add_column(
            Text(name), justify="right", style="bold", overflow="fold", min_width=_COLUMN_WIDTH_MIN
        )
    table.add_column(style="dim")
    lines = [_lines(one, comparison) for one in comparison.observers]
    for cells in zip(*lines, strict=True):
        values = [value for _, value, _ in cells]
        if any(value is not None for value in values):
            what, _, unit = cells[0]
            table.add_row(what, *("none" if value is None else f"{value:.3g}" for value in values), unit)
    return Group("", table)


def _lines(one: ObserverFigures, comparison: ObserverComparison) -> list[tuple[str, float | None, str]]:
    """Return what the lines are called, the numbers of one observer, and their units."""
    above, lag = f"above {comparison.cutoff_hz:g} Hz", one.velocity_lag_s
    return [
        ("velocity error, RMS", one.velocity_error_rms_rad_s, "rad/s"),
        ("disturbance error, RMS", one.disturbance_error_rms_rad_s2, "rad/s²"),
        ("velocity, late by", None if lag is None else 1e3 * lag, "ms"),
        (f"velocity {above}", one.velocity_noise_rad_s, "rad/s"),
        (f"disturbance {above}", one.disturbance_noise_rad_s2, "rad/s²"),
        ("voltage, variation", one.voltage_tv_V_s, "V/s"),
        ("cost of a step", one.cost_us, "µs"),
        ("cost / super_twisting", one.cost_ratio, ""),
    ]
