"""Time stamps as loggers write them, made into a time that rises."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.common.number_range import number
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.even_sampling import even_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Column = NDArray[np.float64]
    Rows = NDArray[np.intp]

_WRAP_DISTANCE_STEPS_MAX = 20.0  # usual steps: so close to its ends a counter is when it wraps
_GAP_STEPS_MIN = 10.0  # usual steps; after a longer one the observer restarts anyway
_COUNTER_MODULI = tuple(2.0**bits for bits in (8, 16, 24, 31, 32))
_TICKS = (1e-9, 1e-6, 1e-3)  # s: of a 32-bit counter that the file gives in another unit
_CLOCK_MODULI_S = (60.0, 3600.0, 43_200.0, 86_400.0, 604_800.0)  # s: seconds of the minute ... of the week
_FEW_ROWS_SHARE = 0.05  # share of rows
_DAYS = ((2e4, 8e4), (7e5, 8e5))  # since 1900, since the year 0: from 1954 on
_DAY_FRACTION_STEP_MAX = 1e-5  # of a day: 0.9 s
_EPOCHS = ((1e11, 1e14, "ms", 1e-3), (1e14, 1e17, "us", 1e-6), (1e17, 1e20, "ns", 1e-9))


class Stamps(NamedTuple):
    """Times of the rows, and notes on how they were corrected.

    Parameters
    ----------
    time
        s, shape (m,), rising.
    rows
        Shape (m,): the rows of the file that they belong to.
    breaks
        Where in `time` a new stretch begins that the clock does not tie to the one before; the step there is
        a usual one.
    notes
        What was done, one sentence each.
    """

    time: Column
    rows: Rows
    breaks: tuple[int, ...]
    notes: tuple[str, ...]


def epoch_unit(raw: Column) -> tuple[str, float] | None:
    """Return the unit of a date that cannot be in seconds, and its size in s.

    Such are times since 1970 in ms, us or ns, and the day numbers of Excel and MATLAB.
    """
    middle = float(np.median(raw))
    step = float(np.median(np.abs(np.diff(raw)))) if len(raw) > 1 else 1.0
    if any(low < middle < high for low, high in _DAYS) and 0.0 < step < _DAY_FRACTION_STEP_MAX:
        return "days", 86_400.0
    return next(((name, size) for low, high, name, size in _EPOCHS if low < middle < high), None)


def rising(raw: Column, size: float, copies: NDArray[np.bool_], period: float | None, name: str) -> Stamps:
    """Make time rise, and leave out or put right the rows for which it does not.

    Counters that wrap are continued. Rows that come in the wrong order by one place are exchanged, and a
    single stamp that fits nowhere is left out. Any other step back begins a new stretch. Stamps that are
    coarser than the rows are replaced by even ones if they fit them.

    Parameters
    ----------
    raw
        Shape (n,), in the file's unit.
    size
        s, one of that unit.
    copies
        Shape (n,): whether a row says exactly what the one before says.
    period
        s, of rows that are evenly sampled; None takes the stamps.
    name
        Of the file and its column, for messages.

    Raises
    ------
    ConfigError
        If the stamps do not tell when the rows were taken.
    """
    notes: list[str] = []
    rows = np.arange(len(raw))
    if np.median(np.diff(raw)) < 0.0:
        raw, rows, copies = raw[::-1], rows[::-1], np.append([False], copies[:0:-1])
        notes.append("The rows come in reverse order of their time: read from the last one on.")
    steps = np.diff(raw)
    if not (steps > 0.0).any() and period is not None and not steps.any():
        notes.append(f"Evenly sampled, {number(period)} s (--period); all stamps are the same.")
        return Stamps(period * rows.astype(np.float64), rows, (), tuple(notes))
    if not (steps > 0.0).any():
        raise ConfigError(
            f"{name}: no stamp is later than the one before. If the rows are evenly sampled, say so: "
            f"--period {period or 'T'} --time none."
        )
    usual = float(np.median(steps[steps > 0.0]))
    raw = _unwrapped(raw, size, usual, notes)
    doubled = copies & np.concatenate(([False], np.diff(raw) == 0.0))
    repeated = int(np.count_nonzero(np.diff(raw) == 0.0))
    if doubled.any() and (doubled.sum() == repeated or repeated < _FEW_ROWS_SHARE * len(raw)):
        rows, raw = rows[~doubled], raw[~doubled]
        notes.append(f"{_rows(int(doubled.sum()))} left out that the file holds twice.")
    if np.count_nonzero(np.diff(raw) <= 0.0) < _FEW_ROWS_SHARE * len(raw):
        raw, rows = _in_order(raw, rows, usual, notes)
    starts = _starts(raw, size, usual, notes)
    if len(starts) > _FEW_ROWS_SHARE * len(raw):
        raise ConfigError(
            f"{name}: the time goes back in {len(starts)} of {len(raw)} rows, so it does not tell when they "
            f"were taken. If they are evenly sampled, say so: --period {period or 'T'} --time none."
        )
    parts = [even_rows(size * (part - part[0]), period, name, notes) for part in np.split(raw, starts)]
    time = _joined(parts, size * float(raw[0]))
    return Stamps(time, rows, tuple(starts), tuple(dict.fromkeys(notes)))


def _starts(raw: Column, size: float, usual: float, notes: list[str]) -> list[int]:
    """Return the rows at which the time goes back."""
    starts = (np.flatnonzero(np.diff(raw) < 0.0) + 1).tolist()
    if starts:
        back = size * float(raw[starts[0] - 1] + usual - raw[starts[0]])
        notes.append(
            f"The clock goes back in {_places(len(starts))}, the first time by {back:.6g} s: "
            "a new stretch begins there, and the observer with it."
        )
    return [int(start) for start in starts]


def _joined(parts: list[Column], begin: float) -> Column:
    """Return the stretches joined, a usual step apart."""
    typical = float(np.median(np.concatenate([np.diff(part) for part in parts])))
    time = [begin + parts[0]]
    for part in parts[1:]:
        time.append(float(time[-1][-1]) + typical + part)
    return np.concatenate(time)


def _unwrapped(raw: Column, size: float, usual: float, notes: list[str]) -> Column:
    """Continue a counter that starts again at its end."""
    sizes = {modulus: f"2^{np.log2(modulus):.0f}" for modulus in _COUNTER_MODULI}
    sizes |= {2.0**32 * tick / size: "2^32" for tick in _TICKS}
    sizes |= {clock / size: f"{clock:g} s" for clock in _CLOCK_MODULI_S}
    lift, found, counts = np.zeros(len(raw)), "", 0
    for k in (np.flatnonzero(np.diff(raw) < 0.0) + 1).tolist():
        before, after = float(raw[k - 1]), float(raw[k])
        for modulus, name in sizes.items():
            near = min(_WRAP_DISTANCE_STEPS_MAX * usual, 0.3 * modulus)
            unsigned = before > modulus - near and 0.0 <= after < near
            signed = before > 0.5 * modulus - near and after < near - 0.5 * modulus
            step = after + modulus - before
            if (unsigned or signed) and 0.0 < step <= _GAP_STEPS_MIN * usual:
                lift[k:] += modulus
                found, counts = name, counts + 1
                break
    if counts:
        notes.append(f"The time counter wraps at {found} in {_places(counts)}: continued.")
    return raw + lift


def _in_order(raw: Column, rows: Rows, usual: float, notes: list[str]) -> tuple[Column, Rows]:
    """Exchange neighbours that come in the wrong order, and leave out single stamps that fit nowhere."""
    raw, rows = raw.copy(), rows.copy()
    odd: list[int] = []
    exchanged = 0
    for k in (np.flatnonzero(np.diff(raw) < 0.0) + 1).tolist():
        if k < 2 or k + 1 >= len(raw) or k - 1 in odd:  # noqa: PLR2004 - one before, one after
            continue
        older, before, now, after = raw[k - 2 : k + 2].tolist()
        skipped = before - older > 1.4 * usual and after - now > 1.4 * usual
        if older < now and before < after and skipped and after - older < 5.0 * usual:
            raw[[k - 1, k]], rows[[k - 1, k]] = raw[[k, k - 1]], rows[[k, k - 1]]
            exchanged += 1
        elif 0.0 < after - before < 3.5 * usual:
            odd.append(k)
        elif 0.0 < now - older < 3.5 * usual < before - older:
            odd.append(k - 1)
    if exchanged:
        notes.append(f"Two neighbouring rows come in the wrong order in {_places(exchanged)}: exchanged.")
    if odd:
        notes.append(f"{_rows(len(odd))} left out whose time fits neither the row before nor the one after.")
    return np.delete(raw, odd), np.delete(rows, odd)


def _places(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"


def _rows(count: int) -> str:
    return "1 row" if count == 1 else f"{count} rows"
