"""Fewer points of fast signals, and every peak among them; fewer bits of each point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Column = NDArray[np.float64]
_SINGLE_MAX = float(np.finfo(np.float32).max)
_DECIMATED_RATE_MIN_HZ, _BUCKET_RATE_HZ = 2_000.0, 1_000.0


def rows_per_bucket(period: float) -> int:
    """Return how many periods are drawn as two points; 1 leaves them as they are."""
    return 1 if period * _DECIMATED_RATE_MIN_HZ >= 1.0 else max(2, round(1.0 / (period * _BUCKET_RATE_HZ)))


def peaks(t: Column, values: Column, rows: int) -> tuple[Column, Column]:
    """Draw each bucket of `rows` rows as its smallest and largest value, in the order in which they came.

    Parameters
    ----------
    t
        s, shape (n,).
    values
        Shape (n, k); each column has extremes of its own.
    rows
        A bucket; what is left at the end is a shorter one.

    Returns
    -------
    tuple
        Times, shape (m,), and values, shape (m, k): two rows a bucket, at its beginning and in its middle.
    """
    if rows == 1 or not len(t):
        return t, values
    missing = -len(t) % rows
    if missing:  # the last row again: it changes no extreme
        t = np.concatenate((t, np.repeat(t[-1:], missing)))
        values = np.concatenate((values, np.repeat(values[-1:], missing, axis=0)))
    buckets = values.reshape(-1, rows, values.shape[1])
    low, high = _extreme(buckets, np.inf, np.argmin), _extreme(buckets, -np.inf, np.argmax)
    first, second = np.minimum(low, high), np.maximum(low, high)
    drawn = np.stack([np.take_along_axis(buckets, place, axis=1)[:, 0] for place in (first, second)], axis=1)
    times = t.reshape(-1, rows)[:, [0, rows // 2]]
    return times.ravel(), drawn.reshape(-1, values.shape[1])


def single(values: Column) -> Column:
    """Round to single precision, seven digits: zeros at the end of a number are compressed to nothing.

    A recording is 2 MB a minute smaller by it at 1 kHz, and no screen shows an eighth digit.

    Parameters
    ----------
    values
        Any shape; what is too large for a single is its largest.
    """
    bounded = np.clip(values, -_SINGLE_MAX, _SINGLE_MAX)
    return bounded.astype(np.float32).astype(np.float64)


def _extreme(buckets: Column, instead: float, find: object) -> NDArray[np.intp]:
    """Return the place of an extreme in each bucket, shape (m, 1, k); NaN is none."""
    known = np.where(np.isnan(buckets), instead, buckets)
    places: NDArray[np.intp] = find(known, axis=1, keepdims=True)  # type: ignore[operator]
    return places
