"""Evenly sampled rows behind stamps that are too coarse to tell, or that came late."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.common.number_range import number
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Column = NDArray[np.float64]

_REPEATED_STAMPS_SHARE_MAX = 0.05
"""Share of the rows whose stamp may repeat the one before in a clock that is fine otherwise."""
_STAMP_RESOLUTION_MAX_STEPS = 0.05  # of a step: stamps of that resolution are taken as they are
_AVERAGE_ROWS = 64  # rows that a period is averaged over
_SHORT_WINDOW_ROWS = 10
_PERIOD_ROWS_MIN = 8  # rows that tell a period
_PERIOD_TOLERANCE_SHARE = 0.02  # between a period that is told and the one that the stamps show
_LOST_ROW_STEP_PERIODS = 0.75  # of a period, by which the stamps move on where a row was lost
_COARSE_STEP_KINDS_MAX = 6  # of steps that a coarse clock shows
_STAMPS_MIN = 50  # that tell a period to a thousandth
_ROUNDING_S = 1e-6  # s
_TICKS_MAX = 1e15  # of them


class _Grid(NamedTuple):
    number: NDArray[np.float64]  # of each row's instant, shape (n,)
    period: float  # s
    spread: float  # s, between the largest and the smallest deviation of a stamp


def even_rows(time: Column, period: float | None, name: str, notes: list[str]) -> Column:
    """Return the instants of rows, s, shape (n,), rising.

    Parameters
    ----------
    time
        s, shape (n,): the stamps, none earlier than the one before.
    period
        s, of evenly sampled rows: then the stamps tell only which rows were lost. None: the stamps are taken,
        unless they are coarser than the rows.
    name
        Of the file and its column, for messages.
    notes
        What was done is added here.

    Raises
    ------
    ConfigError
        If the stamps contradict `period`, or repeat themselves in rows that are not evenly sampled.
    """
    if len(time) < _PERIOD_ROWS_MIN:
        return np.arange(len(time), dtype=np.float64) * period if period else _spread(time)
    if period is not None:
        return _told(time, period, name, notes)
    repeated = int(np.count_nonzero(np.diff(time) <= 0.0))
    if repeated >= _REPEATED_STAMPS_SHARE_MAX * len(time):
        return _coarse(time, repeated, name, notes)
    if repeated:
        notes.append(f"{repeated} of the stamps repeat the one before: their rows are spread up to the next.")
        return _spread(time)
    return _rounded(time, notes)


def _rounded(time: Column, notes: list[str]) -> Column:
    """Return the stamps, or an even grid that they were rounded from."""
    steps = np.diff(time)
    resolution = _resolution(steps)
    if resolution < _STAMP_RESOLUTION_MAX_STEPS * float(np.median(steps)):
        return time
    grid = _fit(time, resolution)
    multiple = grid.period / resolution
    # Near one step a longer one may be a lost row; near several of them it is the rounding only.
    unsure = abs(multiple - round(multiple)) < (
        _STAMP_RESOLUTION_MAX_STEPS if round(multiple) == 1 else _ROUNDING_S
    )
    if grid.spread > 1.1 * resolution + _ROUNDING_S or unsure:
        return time
    notes.append(_said(grid, f"The stamps are as coarse as {resolution:.4g} s"))
    return grid.number * grid.period


def _coarse(time: Column, repeated: int, name: str, notes: list[str]) -> Column:
    """Return the even grid behind stamps that many rows share."""
    steps = np.diff(time)
    resolution = float(np.quantile(steps[steps > 0.0], 0.95))
    grid = _fit(time, resolution)
    uneven = grid.spread > resolution + grid.period
    if uneven or time[-1] - time[0] < _STAMPS_MIN * resolution:
        why = "the rows are not evenly sampled by them" if uneven else "there are too few different ones"
        raise ConfigError(
            f"{name}: {repeated} of {len(time)} stamps repeat the one before, and {why}, so they do not tell "
            "when a row was taken. If the rows are evenly sampled, say so: --period T (by the stamps, about "
            f"{grid.period:.3g} s)."
        )
    notes.append(
        _said(grid, f"{repeated} of the stamps repeat the one before (they are {resolution:.4g} s apart)")
    )
    return grid.number * grid.period


def _told(time: Column, period: float, name: str, notes: list[str]) -> Column:
    """Return the even grid of a known period, with the rows left out that the stamps show to be lost."""
    steps = np.diff(time)
    repeated = int(np.count_nonzero(steps <= 0.0))
    late = 2.0 * float(np.quantile(np.abs(steps - np.median(steps)), 0.9))
    resolution = max(late, float(np.quantile(steps[steps > 0.0], 0.95)) if repeated else 0.0)
    few = time[-1] - time[0] < _STAMPS_MIN * resolution
    numbers = _numbered(time, period, resolution)
    off = time - period * numbers
    grid = _Grid(numbers, period, float(np.ptp(off))) if few else _fit(time, resolution, period)
    if abs(grid.period / period - 1.0) > _PERIOD_TOLERANCE_SHARE:
        raise ConfigError(
            f"{name}: by the stamps the rows are {grid.period:.4g} s apart, by --period {number(period)} s. "
            "Leave --period out, or say --time none: then the stamps do not count."
        )
    if grid.spread > resolution + grid.period:
        if repeated >= _REPEATED_STAMPS_SHARE_MAX * len(time):
            raise ConfigError(
                f"{name}: by the stamps the rows are not evenly sampled, {number(period)} s apart: they "
                f"differ from that by {grid.spread:.4g} s. Say --time none if the stamps do not count."
            )
        notes.append("The rows are not evenly sampled: the stamps are taken; --period tunes the observer.")
        return _spread(time)
    lost = int(grid.number[-1]) - len(time) + 1
    told = "no lost row" if not lost else "1 lost row" if lost == 1 else f"{lost} lost rows"
    notes.append(f"Evenly sampled, {number(period)} s (--period); the stamps show {told}.")
    return grid.number * period


def _fit(time: Column, resolution: float, told: float | None = None) -> _Grid:
    """Return the even grid that fits the stamps best."""
    window = min(_AVERAGE_ROWS, len(time) - 1)
    means = (time[window:] - time[:-window]) / window
    usual = float(np.median(means))
    near = np.abs(means - usual) <= (resolution + 0.5 * usual) / window
    # The mean is right where no row was lost, the smallest and the median step where some were.
    short = min(_SHORT_WINDOW_ROWS, len(time) - 1)
    fewest = float(np.quantile(time[short:] - time[:-short], 0.2)) / short
    mean = float(np.mean(means[near])) if near.any() else usual
    guesses = [mean, fewest, float(np.median(np.diff(time))), told or 0.0]
    grids = [_refined(time, guess, resolution) for guess in guesses if guess > 0.0]
    return min(grids, key=lambda grid: grid.spread)


def _refined(time: Column, period: float, resolution: float) -> _Grid:
    number = np.arange(len(time), dtype=np.float64)
    for _ in range(3):
        number = _numbered(time, period, resolution)
        period = float(np.polyfit(number, time, 1)[0])
    off = time - period * number
    return _Grid(number, period, float(np.max(off) - np.min(off)))


def _numbered(time: Column, period: float, resolution: float) -> Column:
    """Return a number for each row: one more than the row before, or several where rows were lost.

    A stamp may be late or rounded up, so what counts is the earliest stamp, by its deviation, from a row on.
    """
    count = len(time)
    rows = np.arange(count, dtype=np.float64)
    ahead = np.minimum.accumulate((time / period - rows)[::-1])[::-1]
    tail = min(count - 1, 2 * round(resolution / period) + 2)
    ahead[count - tail :] = ahead[count - tail - 1]  # too near the end to tell late from lost
    lost, level = np.zeros(count), float(ahead[0])
    for k in (np.flatnonzero(np.diff(ahead) > 0.0) + 1).tolist():
        if ahead[k] - level > _LOST_ROW_STEP_PERIODS:
            missing = max(1.0, round(float(ahead[k]) - level))
            lost[k] = missing
            level += missing
    return rows + np.cumsum(lost)


def _resolution(steps: Column) -> float:
    """Return the step of a coarse clock, s; 0 where the steps do not come in a few sizes."""
    sizes = np.unique(np.round(steps / _ROUNDING_S))
    if not 1 < len(sizes) <= _COARSE_STEP_KINDS_MAX or sizes[-1] > _TICKS_MAX:
        return 0.0
    return float(np.gcd.reduce(sizes.astype(np.int64))) * _ROUNDING_S


def _spread(time: Column) -> Column:
    """Spread rows with one stamp evenly up to the next one."""
    first = np.concatenate(([True], np.diff(time) > 0.0))
    places = np.flatnonzero(first)
    usual = float(np.median(np.diff(time[places]))) if len(places) > 1 else 1e-3
    # Behind the last stamp the rows go on at the usual step.
    known = np.append(places, len(time))
    spread = np.interp(np.arange(len(time)), known, np.append(time[places], time[-1] + usual))
    return np.asarray(spread, dtype=np.float64)


def _said(grid: _Grid, why: str) -> str:
    return (
        f"{why}, and the rows are evenly sampled by them: {grid.period:.6g} s is taken from row to row. "
        "--period says it exactly."
    )
