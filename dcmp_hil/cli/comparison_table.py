"""The table of observers side by side, as `run --compare` and `replay --compare` print it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from dcmp_hil.comparison import ObserverComparison, ObserverFigures

_NAME_WIDTH_MAX = 18  # characters; a longer name folds, a number does not
_WHOLE_MIN = 1000.0  # larger numbers are shown without decimals
_COLUMNS = (
    "v error\nrad/s",
    "w error\nrad/s²",
    "v lag\nms",
    "v noise\nrad/s",
    "w noise\nrad/s²",
    "TV\nV/s",
    "cost\nµs",
    "ratio",
)
_JUDGED = {
    "truth": "errors against the truth",
    "zero_phase": "errors against the zero-phase reference",
    "none": "no reference for the errors",
}


def comparison_table(comparison: ObserverComparison) -> Group:
    """Return a table with a row for each observer; what is known of none of them has no column."""
    first, last = comparison.window_s or (0.0, 0.0)
    judged = _JUDGED[comparison.reference]
    table = Table(
        title=Text(f"observers on the same samples, {first:.2f} to {last:.2f} s; {judged}"),
        title_justify="left",
        title_style="",
        header_style="dim",
        box=None,
        padding=(0, 1, 0, 0),
    )
    names = [f"{one.observer} *" if one.closes_loop else one.observer for one in comparison.observers]
    table.add_column("", overflow="fold", min_width=min(_NAME_WIDTH_MAX, max(map(len, names))))
    rows = [_numbers(one) for one in comparison.observers]
    known = [
        place for place, numbers in enumerate(zip(*rows, strict=True)) if any(n is not None for n in numbers)
    ]
    for place in known:
        table.add_column(_COLUMNS[place], justify="right", style="bold", no_wrap=True)
    for name, numbers in zip(names, rows, strict=True):
        table.add_row(Text(name), *(_number(numbers[place]) for place in known))
    return Group("", table, Text(_legend(comparison), style="dim"))


def _numbers(one: ObserverFigures) -> tuple[float | None, ...]:
    """Return the numbers of an observer, in the order of `_COLUMNS`."""
    lag = one.velocity_lag_s
    return (
        one.velocity_error_rms_rad_s,
        one.disturbance_error_rms_rad_s2,
        None if lag is None else 1e3 * lag,
        one.velocity_noise_rad_s,
        one.disturbance_noise_rad_s2,
        one.voltage_tv_V_s,
        one.cost_us,
        one.cost_ratio,
    )


def _legend(comparison: ObserverComparison) -> str:
    """Return what the short names of the columns mean."""
    loop = "* closes the loop. " if any(one.closes_loop for one in comparison.observers) else ""
    return (
        f"{loop}v: velocity, w: disturbance. Errors and noise are RMS values,\n"
        f"noise above {comparison.cutoff_hz:g} Hz. TV: total variation of the voltage, sent (*) or "
        "demanded.\n"
        "Cost: of one step, and as a ratio to super_twisting."
    )


def _number(value: float | None) -> str:
    if value is None:
        return "none"
    return f"{value:.0f}" if abs(value) >= _WHOLE_MIN else f"{value:.3g}"
