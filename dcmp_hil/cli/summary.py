"""The table that ends a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.session import Result
    from dcmp_hil.telemetry.statistics import Percentiles


def summary_table(rig: Rig, result: Result, ended_by: str) -> Table:
    """Lay the figures out: what, value, unit."""
    figures = result.summary
    start, stop = figures.window_s
    table = Table(
        title=f"{rig.name}: {start:.2f} to {stop:.2f} s, ended by {ended_by}",
        title_justify="left",
        show_header=False,
        box=None,
        padding=(0, 2, 0, 0),
    )
    table.add_column()
    table.add_column(justify="right", style="bold")
    table.add_column(style="dim")
    truth = "against the true state" if figures.velocity_error_rms_rad_s is not None else "by the encoder"
    for what, value, unit in (
        ("tracking error, RMS", _number(figures.tracking_rms_rad, 1e3), f"mrad, {truth}"),
        ("tracking error, max", _number(figures.tracking_max_rad, 1e3), "mrad"),
        ("velocity error, RMS", _number(figures.velocity_error_rms_rad_s), "rad/s"),
        ("velocity error, max", _number(figures.velocity_error_max_rad_s), "rad/s"),
        ("disturbance error, RMS", _number(figures.disturbance_error_rms_rad_s2), "rad/s²"),
        ("voltage, peak", _number(figures.voltage_peak_V), "V"),
        ("voltage, total variation", _number(figures.voltage_tv_V_s), "V/s"),
        ("periods, late", f"{figures.periods}, {figures.late_periods}", "late: by more than half a period"),
        ("period p50 / p99 / p99.9 / max", _quantiles(figures.period_us), "µs"),
        ("lateness p50 / p99 / p99.9 / max", _quantiles(figures.lateness_us), "µs"),
        ("speed", f"{figures.realtime_factor:.4g}", "x real time"),
    ):
        table.add_row(what, value, unit)
    if result.dropped:
        table.add_row("[yellow]periods lost to telemetry", str(result.dropped), "in no figure above")
    return table


def _number(value: float | None, scale: float = 1.0) -> str:
    return "unknown" if value is None else f"{scale * value:.4g}"


def _quantiles(values: Percentiles) -> str:
    return " / ".join(f"{v:.1f}" for v in (values.p50, values.p99, values.p999, values.max))
