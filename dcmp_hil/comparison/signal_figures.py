"""Figures of a signal: how late it is, how noisy, and how much it varies."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.offline.zero_phase import low_pass

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    Column = NDArray[np.float64]

_LAG_MAX_S = 0.25  # s, either way
_SHIFT_SHARE_MAX = 0.25  # of a piece
_UNEXPLAINED_SHARE_MAX = 0.5  # of the reference's deviation: beyond it, no shift makes the two alike
_SAMPLES_MIN = 16  # of a piece


def even_pieces(
    time: Column, columns: Sequence[Column], used: NDArray[np.bool_], begins: NDArray[np.bool_], period: float
) -> list[list[Column]]:
    """Cut columns into pieces that are sampled evenly.

    Parameters
    ----------
    time
        s, shape (n,), rising.
    columns
        Of shape (n,) each.
    used
        Shape (n,): the rows that count.
    begins
        Shape (n,): rows that nothing ties to the one before.
    period
        s, of the even grid: between rows, and over lost ones, values are interpolated.

    Returns
    -------
    list
        A list of all columns, in their order, for each stretch of rows that is long enough.
    """
    edges = np.flatnonzero(begins | (used != np.concatenate(([not used[0]], used[:-1]))))
    pieces = []
    for first, last in pairwise([*edges.tolist(), len(time)]):
        count = round((time[last - 1] - time[first]) / period) + 1
        if not used[first] or min(count, last - first) < _SAMPLES_MIN:
            continue
        grid = np.linspace(time[first], time[last - 1], count)
        pieces.append([np.interp(grid, time[first:last], column[first:last]) for column in columns])
    return pieces


def lag(pieces: Sequence[tuple[Column, Column]], period: float, cutoff: float) -> float | None:
    """Return by how much a signal is late: the shift with the least mean square difference.

    The differences for whole samples are found by cross-correlation (by FFT); a parabola through the least
    and its neighbours gives the fraction (Jacovitti and Scarano, "Discrete time techniques for time delay
    estimation", IEEE Trans. Signal Processing 41(2), 1993). Signal and reference pass the same zero-phase
    low-pass first, which moves neither: the steps of an encoder would pull the shift towards themselves.

    Parameters
    ----------
    pieces
        Signal and reference, evenly sampled, of equal shape (n,); one shift for all pieces.
    period
        s.
    cutoff
        Hz, of the Butterworth filter of third order, forwards and backwards.

    Returns
    -------
    float or None
        s, positive where the signal is late; None where no shift within 0.25 s makes the two alike (the
        reference hardly changes, or the signal is noise), or the sampling is too slow for the corner.

    Raises
    ------
    ConfigError
        If scipy is missing.
    """
    pieces = [(slow, true) for pair in pieces for slow, true in _smooth(pair, cutoff * period)]
    most = round(_LAG_MAX_S / period)
    most = min([most, *(int(_SHIFT_SHARE_MAX * len(signal)) for signal, _ in pieces)])
    if not pieces or most < 1:
        return None
    counted = sum(len(signal) - 2 * most for signal, _ in pieces)
    squares = np.sum([_squares(signal, true, most) for signal, true in pieces], axis=0) / counted
    reference = np.concatenate([reference for _, reference in pieces])
    best = int(np.argmin(squares))
    alike = squares[best] <= (_UNEXPLAINED_SHARE_MAX * float(np.std(reference))) ** 2
    if not alike or not 0 < best < len(squares) - 1:
        return None
    before, least, behind = squares[best - 1 : best + 2].tolist()
    curvature = before - 2.0 * least + behind
    if not curvature > 0.0:
        return None
    return float(best - most + 0.5 * (before - behind) / curvature) * period


def _smooth(pair: tuple[Column, Column], corner: float) -> Iterator[tuple[Column, Column]]:
    """Yield signal and reference below the corner; nothing where there is no such filter."""
    signal, reference = (low_pass(column, corner) for column in pair)
    if signal is not None and reference is not None:
        yield signal, reference


def _squares(signal: Column, reference: Column, most: int) -> Column:
    """Return the sum of squared differences for each shift, from -most to +most samples.

    The reference is shifted, which has no noise: the window of the signal stays, and its noise with it.
    """
    mean = float(np.mean(reference))  # taken off, so that the differences keep their digits
    middle, reference = signal[most : len(signal) - most] - mean, reference - mean
    size = 1 << (len(reference) + len(middle)).bit_length()
    both = np.fft.irfft(np.fft.rfft(reference, size) * np.conj(np.fft.rfft(middle, size)), size)
    sums = np.concatenate(([0.0], np.cumsum(reference * reference)))
    own = sums[len(middle) :] - sums[: -len(middle)]
    squares: Column = own + float(middle @ middle) - 2.0 * both[: len(own)]
    return squares[::-1]  # a reference that is shifted forwards is a signal that is late


def noise(pieces: Sequence[Column], period: float, cutoff: float) -> float | None:
    """Return what of a signal lies above a frequency: it minus its own zero-phase low-pass, RMS.

    A jump of the true signal counts, too, as that of friction at a reversal does.

    Parameters
    ----------
    pieces
        Evenly sampled, shape (n,) each.
    period
        s.
    cutoff
        Hz, of the Butterworth filter of third order, forwards and backwards.

    Returns
    -------
    float or None
        In the unit of the signal; None where the sampling is too slow for the corner.

    Raises
    ------
    ConfigError
        If scipy is missing.
    """
    smooth = [low_pass(piece, cutoff * period) for piece in pieces]
    rest = [piece - slow for piece, slow in zip(pieces, smooth, strict=True) if slow is not None]
    return rms(np.concatenate(rest)) if rest else None


def variation(time: Column, values: Column) -> float | None:
    """Return the total variation of a signal, the sum of its steps without their signs, per second.

    Parameters
    ----------
    time, values
        s, and any unit; shape (n,).

    Returns
    -------
    float or None
        In the unit of the signal over s; None where it lasts no time, or is not known.
    """
    duration = float(time[-1] - time[0]) if len(time) else 0.0
    total = float(np.abs(np.diff(values)).sum())
    return total / duration if duration > 0.0 and math.isfinite(total) else None


def rms(values: Column) -> float | None:
    """Return the root mean square of what is a number; None where nothing is."""
    known = values[np.isfinite(values)]
    return math.sqrt(float(known @ known) / len(known)) if len(known) else None
