"""Positions that wrap: the modulus, and what is left that no arm can have done."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from dcmp_hil.common.number_range import number
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.units import COUNTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Column = NDArray[np.float64]

_TURN_RAD = 2.0 * np.pi
_BITS = (8, 10, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 32)
_MODULUS_TURNS = (1.0, 2.0, 4.0)
_HALF_SHARE = 0.5
_STEP_CHANGE_SHARE_MAX = 0.25
"""Of the modulus: so much no step differs from the two before it once the wraps are undone."""
_JUMP_MIN_RAD = 0.5  # rad between two rows, more than the rows around it move
_ACCELERATION_MAX_RAD_S2 = 2e4  # rad/s2: above it there is no arm
_NEIGHBOUR_ROWS = 3  # rows on either side that a step is compared with
_SPIKE_ROWS_MAX = 3  # rows
_FEW_ROWS_SHARE = 0.02  # share of rows
_ODD_ROWS_MIN = 3
_STRETCH_ROWS_MIN = 3  # rows that have a step beside another one

Modulus = float | Literal["none"] | None


class Motion(NamedTuple):
    """A position without wraps.

    Parameters
    ----------
    position
        Shape (n,), in the file's unit.
    keep
        Shape (n,): the rows that an arm can have been at.
    breaks
        Rows at which the position jumps and stays: it was set anew there.
    notes
        What was done, one sentence each.
    """

    position: Column
    keep: NDArray[np.bool_]
    breaks: tuple[int, ...]
    notes: tuple[str, ...]


def moduli(unit: str, size: float, counts_per_rev: float | None) -> dict[float, str]:
    """Return the moduli that encoders and programs wrap at: size in the file's unit to name.

    Parameters
    ----------
    unit, size
        Of the position column; the size in rad, that of a count where the unit is counts.
    counts_per_rev
        Of the encoder, where it is known: then a counter that was scaled to an angle is thought of, too.
    """
    found = {
        turns * _TURN_RAD / size: "a turn" if turns == 1.0 else f"{turns:g} turns" for turns in _MODULUS_TURNS
    }
    count = 1.0 if unit == COUNTS else None if counts_per_rev is None else _TURN_RAD / counts_per_rev / size
    if count is not None:
        found |= {2.0**bits * count: f"2^{bits} counts" for bits in _BITS}
    return dict(sorted(found.items()))


def continuous(
    raw: Column,
    time: Column,
    size: float,
    *,
    begins: Sequence[int],
    modulus: Modulus,
    known: dict[float, str],
) -> Motion:
    """Undo the wraps of a position, and leave out what no arm can have done.

    A wrap is undone by the half-modulus rule: between two rows an arm moves less than half a modulus.

    Parameters
    ----------
    raw
        Shape (n,), in the file's unit.
    time
        s, shape (n,), rising.
    size
        rad, one of that unit.
    begins
        Rows at which a new stretch begins: the position may have been set anew there.
    modulus
        In the file's unit; `none` leaves the position as it is, None looks for it in `known`.
    known
        What `moduli` returned.

    Raises
    ------
    ConfigError
        If the position moves by half a modulus between rows, or jumps where no modulus explains it.
    """
    steps = np.diff(raw)
    inside = np.ones(len(steps), dtype=bool)
    inside[[k - 1 for k in begins]] = False
    notes: list[str] = []
    if isinstance(modulus, float) and np.ptp(raw) > modulus * (1.0 + 1e-6):
        raise ConfigError(
            f"--modulus {number(modulus)}: the position spans {np.ptp(raw):g}, more than it. "
            "Give the number of values before it wraps, in the unit of the column, or leave it out."
        )
    chosen = _found(raw, steps, inside, known) if modulus is None else modulus
    if isinstance(chosen, float):
        wraps = np.where(np.abs(steps) > _HALF_SHARE * chosen, -np.sign(steps), 0.0)
        places = int(np.count_nonzero(wraps[inside]))
        raw = raw + chosen * np.concatenate(([0.0], np.cumsum(wraps)))
        name = known.get(chosen, "")
        what = f"{chosen:.6g} ({name})" if name and name != "a turn" else name or f"{chosen:.6g}"
        if places:
            notes.append(
                f"The position wraps at {what} in {_places(places)}: unwrapped. --modulus overrides it."
            )
        _check_half(np.diff(raw)[inside], chosen)
    if len(raw) < _STRETCH_ROWS_MIN:
        return Motion(raw, np.ones(len(raw), dtype=bool), (), tuple(notes))
    keep, jumps = _impossible(size * raw, time, inside)
    if not keep.all():
        count, row = int(np.count_nonzero(~keep)), int(np.flatnonzero(~keep)[0]) + 1
        rows = "1 row" if count == 1 else f"{count} rows"
        notes.append(f"{rows} left out whose position no arm can have been at; the first is row {row}.")
    if len(jumps):
        sizes = np.diff(raw)[np.array(jumps) - 1]
        _check_few(raw, jumps, sizes, len(known) > 0 and modulus is None)
        notes.append(
            f"The position jumps in {_places(len(jumps))}, the first time at row {jumps[0] + 1} by "
            f"{sizes[0]:.6g}: a new stretch begins there, and the observer with it."
        )
    return Motion(raw, keep, tuple(jumps), tuple(notes))


def _found(raw: Column, steps: Column, inside: NDArray[np.bool_], known: dict[float, str]) -> float | None:
    """Return the smallest modulus that explains the jumps, None where there are none."""
    span = float(np.ptp(raw))
    for modulus in known:
        if span > modulus * (1.0 + 1e-6):
            continue
        wraps = np.where(np.abs(steps) > _HALF_SHARE * modulus, -np.sign(steps), 0.0)
        if not wraps[inside].any():
            continue
        undone = steps + modulus * wraps
        sharp = np.abs(np.diff(undone)) > _STEP_CHANGE_SHARE_MAX * modulus
        near = wraps[1:].astype(bool) | wraps[:-1].astype(bool)
        # Where a wrap was undone the motion must go on as before: then it was one.
        if np.mean(sharp[near]) < 0.1:  # noqa: PLR2004 - a glitch may lie beside a wrap
            return modulus
    return None


def _check_half(steps: Column, modulus: float) -> None:
    sharp = np.abs(np.diff(steps)) > _HALF_SHARE * modulus
    if np.count_nonzero(sharp) > max(_ODD_ROWS_MIN, 0.001 * len(steps)):
        raise ConfigError(
            f"The position moves by about half of its modulus ({modulus:.6g}) between two rows in "
            f"{np.count_nonzero(sharp)} places, so that nothing tells which way it went. Say --modulus if it "
            "is another one, or record faster."
        )


def _impossible(
    position: Column, time: Column, inside: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], list[int]]:
    """Return which rows to keep, without impossible positions, and rows where the position was set anew."""
    dt = np.diff(time)
    rate = np.diff(position) / dt
    usual = np.median(dt)
    jump = max(_JUMP_MIN_RAD, _ACCELERATION_MAX_RAD_S2 * float(usual) ** 2)
    around = _running_median(rate)
    far = inside & (np.abs(rate - around) * dt > jump) & (dt < 3.0 * usual)
    keep = np.ones(len(position), dtype=bool)
    jumps: list[int] = []
    places = np.flatnonzero(far).tolist()
    while places:
        first = places.pop(0)  # the step from row `first` to the next
        back = next(
            (k for k in places if k - first <= _SPIKE_ROWS_MAX and _returns(position, first, k, jump)), None
        )
        if back is not None:
            keep[first + 1 : back + 1] = False
            places = [k for k in places if k > back]
        elif first + 1 == len(position) - 1:
            keep[-1] = False
        elif first == 0:
            keep[0] = False
        else:
            jumps.append(first + 1)
    return keep, jumps


def _returns(position: Column, first: int, last: int, jump: float) -> bool:
    """Whether the row after a spike is near the row before it."""
    return abs(float(position[last + 1] - position[first])) < (last + 1 - first) * jump


def _running_median(values: Column) -> Column:
    padded = np.pad(values, _NEIGHBOUR_ROWS, mode="edge")
    return np.asarray(
        np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * _NEIGHBOUR_ROWS + 1), axis=1),
        dtype=np.float64,
    )


def _check_few(raw: Column, jumps: Sequence[int], sizes: Column, open_: bool) -> None:
    if len(jumps) <= max(_ODD_ROWS_MIN, _FEW_ROWS_SHARE * len(raw) / 10.0):
        return
    usual = float(np.median(np.abs(sizes)))
    alike = np.mean(np.abs(np.abs(sizes) - usual) < 0.2 * usual) > _HALF_SHARE
    hint = (
        f"The jumps are of about {usual:.4g}: if it wraps, say --modulus N in the unit of the column "
        f"(it spans {np.ptp(raw):.6g})."
        if alike and open_
        else "Check the position column and its unit (--position, --position-unit), or say --modulus N."
    )
    raise ConfigError(
        f"The position jumps in {len(jumps)} places (the first at row {jumps[0] + 1}, by {sizes[0]:.6g}) as "
        f"no arm can move. {hint}"
    )


def _places(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"
