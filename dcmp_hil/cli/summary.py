"""The tables that end a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from dcmp_hil.telemetry.statistics import BOUNDS_US
from dcmp_hil.wire.link_diagnosis import DeviceCounters

if TYPE_CHECKING:
    from rich.console import RenderableType

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.friction_findings import FrictionFindings
    from dcmp_hil.telemetry.statistics import DurationHistogram, Percentiles

_BAR_CHARS = " ▁▂▃▄▅▆▇█"
_UNITS = ((1e-6, "s"), (1e-3, "ms"), (1.0, "µs"))
_TWO_DECIMALS_MIN = 0.005  # smaller numbers would be 0.00
_WHOLE_MIN_US = 10_000.0  # longer durations are shown without decimals
_HOW_OFTEN = (
    "how often: a bar for each range of durations, up to 1, 2, 5, 10, 20, 50 ... µs,",
    "from the first range with a cycle to the last; its height is logarithmic.",
)


def summary_table(rig: Rig, result: Result, ended_by: str) -> Group:
    """Return tables of the figures (name, value, unit) and of the durations (one quantile a column)."""
    start, stop = result.summary.window_s
    title = Text.assemble((rig.name, "bold"), f"  {start:.2f} to {stop:.2f} s, ended by {ended_by}")
    return Group(title, "", _figures(result), *_engine(result), *_durations(result), *_refusals(result))


def _figures(result: Result) -> Table:
    figures = result.summary
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(justify="right", style="bold", no_wrap=True)
    table.add_column(style="dim", no_wrap=True)
    judge = "true position" if figures.velocity_error_rms_rad_s is not None else "encoder"
    for what, value, unit in (
        ("tracking error, RMS", _number(figures.tracking_rms_rad, 1e3), f"mrad, by the {judge}"),
        ("tracking error, max", _number(figures.tracking_max_rad, 1e3), "mrad"),
        ("velocity error, RMS", _number(figures.velocity_error_rms_rad_s), "rad/s"),
        ("velocity error, max", _number(figures.velocity_error_max_rad_s), "rad/s"),
        ("disturbance error, RMS", _number(figures.disturbance_error_rms_rad_s2), "rad/s²"),
        ("voltage, peak", _number(figures.voltage_peak_V), "V"),
        ("voltage, total variation", _number(figures.voltage_tv_V_s), "V/s"),
        ("periods", str(figures.periods), f"{figures.late_periods} late, by half a period and more"),
        ("speed", _number(figures.realtime_factor), "x real time"),
    ):
        if value:  # what is not known has no row: the errors of an estimate on a device, for one
            table.add_row(what, value, unit)
    for row in _friction(figures.friction):
        table.add_row(*row)
    if result.link is not None:
        for row in _link(result):
            table.add_row(*row)
    if result.outliers:
        table.add_row("[yellow]wrong counts", str(result.outliers), "samples left out, as if they were lost")
    if result.dropped:
        table.add_row("[yellow]lost to telemetry", str(result.dropped), "periods, in no figure above")
    return table


def _engine(result: Result) -> list[RenderableType]:
    """Return why a run in virtual time was not in the core, if it was not."""
    reason = result.engine_reason
    return [Text(f"the loop of the host ran it, not the core: {reason}", style="dim")] if reason else []


def _friction(found: FrictionFindings | None) -> list[tuple[str, str, str]]:
    """Return the rows of an observer that finds friction: how much, and how often it let go of its model."""
    if found is None:
        return []
    times, t = found.let_go, found.largest_distrust_t_s
    largest = "" if t is None else f"{'' if times == 1 else 'largest '}at {t:.1f} s"
    rows = [("let go of the model", str(times), f"time{'s' * (times != 1)}{', ' * bool(largest)}{largest}")]
    if found.found_rad_s2 is not None and found.deviation_rad_s2 is not None:
        value = f"{found.found_rad_s2:.2f} ± {_deviation(found.deviation_rad_s2)}"
        rows.insert(0, ("friction", value, f"rad/s² (model {found.model_rad_s2:.3g})"))
    return rows


def _deviation(value: float) -> str:
    """Return a deviation to two decimals, or to one digit where that is more."""
    return f"{value:.2f}" if value >= _TWO_DECIMALS_MIN else f"{value:.1g}"


def _link(result: Result) -> list[tuple[str, str, str]]:
    """Return the rows of a link; what was warned of in yellow."""
    link, shares = result.link, {concern.cause: concern.share for concern in result.link_concerns}
    causes = set(shares)
    assert link is not None  # noqa: S101 - the caller looked
    device = link.device or DeviceCounters()
    damaged = f"frames here, {_at_least(device, 'crc_errors')} at the device"
    rows = [
        (
            _told("samples lost", {"samples_lost"} & causes),
            str(link.lost),
            f"{link.stale} late or twice, {link.skipped} skipped",
        ),
        (
            _told("commands missed", {"commands_lost"} & causes),
            str(link.missed),
            f"periods, {link.late} late here",
        ),
        (
            _told("damaged", {"commands_damaged", "samples_damaged"} & causes),
            str(link.corrupt),
            damaged,
        ),
    ]
    if link.limited:
        rows.append(("commands limited", str(link.limited), "clamped or slewed by the device"))
    if "device_clock" in causes:
        rows.append(("[yellow]device's clock", f"{1e2 * shares['device_clock']:+.2f}", "% fast"))
    if result.device_end and result.device_end.fault:
        rows.append(("[yellow]device's end", result.device_end.fault, "the fault that it keeps"))
    return rows


def _told(what: str, causes: set[str]) -> str:
    return f"[yellow]{what}" if causes else what


def _at_least(device: DeviceCounters, name: str) -> str:
    return f"{getattr(device, name)}{' or more' if name in device.full else ''}"


def _durations(result: Result) -> list[RenderableType]:
    """Return the table of durations, without those that say nothing: virtual time has no lateness."""
    figures = result.summary
    durations = [
        ("period", figures.period_us, figures.period_histogram),
        ("lateness", figures.lateness_us, figures.lateness_histogram),
        ("sample to command", figures.compute_us, figures.compute_histogram),
    ]
    told = [(what, values, histogram) for what, values, histogram in durations if _varies(values)]
    if not told:
        return []
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    rows = [(what, *_quantiles(values), _bars(histogram)) for what, values, histogram in told]
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]  # only bars may be cut off
    table.add_column("µs", no_wrap=True, min_width=widths[0])
    for quantile, width in zip(("p50", "p99", "p99.9", "max"), widths[1:], strict=False):
        table.add_column(quantile, justify="right", no_wrap=True, min_width=max(width, len(quantile)))
    table.add_column("how often", no_wrap=True, style="dim")
    for row in rows:
        table.add_row(*row)
    return ["", table, *(Text(line, style="dim") for line in _HOW_OFTEN)]


def _varies(values: Percentiles) -> bool:
    """Return whether durations were measured: NaN is none, and those of the virtual clock are the same."""
    return values.max > 0.0 and values.max != values.p50


def _quantiles(values: Percentiles) -> list[str]:
    return [
        f"{v:.{0 if v >= _WHOLE_MIN_US else 1}f}" for v in (values.p50, values.p99, values.p999, values.max)
    ]


def _bars(histogram: DurationHistogram) -> str:
    """Draw counts on a logarithmic scale, a character a bar, between the first bound and the last."""
    if not histogram.counts:
        return ""
    most = math.log1p(max(histogram.counts))
    bars = "".join(_BAR_CHARS[math.ceil(8 * math.log1p(count) / most)] for count in histogram.counts)
    first, last = (_bound(histogram.up_to_us[place]) for place in (0, -1))
    return f"{first} {bars} {last}"


def _bound(up_to_us: float) -> str:
    """Return a bound with its unit, such as `≤500 µs`."""
    if math.isinf(up_to_us):
        return f">{1e-6 * BOUNDS_US[-1]:g} s"
    scale, unit = next((one for one in _UNITS if up_to_us >= 1.0 / one[0]), _UNITS[-1])
    return f"≤{scale * up_to_us:g} {unit}"


def _refusals(result: Result) -> list[Text]:
    """Return one line for each request of real time that the system did not grant."""
    refused = [grant for grant in result.grants if not grant.granted]
    lines = [
        Text.assemble((grant.what, "yellow"), f" was not granted: {grant.refusal}.") for grant in refused
    ]
    return [Text(), *lines] if lines else []


def _number(value: float | None, scale: float = 1.0) -> str:
    """Return a figure; nothing where it is not known."""
    return "" if value is None or math.isnan(value) else f"{scale * value:.4g}"
