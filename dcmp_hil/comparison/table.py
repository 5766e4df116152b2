"""The table of observers side by side, from the columns of a run or of a file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from dcmp_hil.comparison.cost import STANDARD
from dcmp_hil.comparison.signal_figures import even_pieces, lag, noise, rms, variation
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Column = NDArray[np.float64]

CUTOFF_HZ = 15.0
"""Corner of the zero-phase filters, Hz."""
_SLOW_SHARE = 0.3  # of a period: more for one observer leaves the loop too little
_FILTERED = ("velocity_lag_s", "velocity_noise_rad_s", "disturbance_noise_rad_s2")
_FROM_COLUMNS = (
    "velocity_error_rms_rad_s",
    "disturbance_error_rms_rad_s2",
    "voltage_tv_V_s",
    *_FILTERED,
)


@dataclass(frozen=True, kw_only=True)
class ComparedObserver:
    """Columns of one observer, shape (n,) each.

    Parameters
    ----------
    name
        In the table.
    velocity, disturbance
        rad/s and rad/s2, as estimated.
    voltage
        V: the demand; of the observer that closes the loop the voltage that was sent; None without any.
    closes_loop
        Whether the voltage was made with this one.
    """

    name: str
    velocity: Column
    disturbance: Column
    voltage: Column | None = None
    closes_loop: bool = False


@dataclass(frozen=True, kw_only=True)
class ComparisonReference:
    """Columns that the estimates are judged by, shape (n,) each.

    Parameters
    ----------
    kind
        `truth` of a simulation; `zero_phase`, from the position; `none` where neither is known.
    velocity, disturbance
        rad/s and rad/s2; NaN where they are not known.
    """

    kind: Literal["truth", "zero_phase", "none"]
    velocity: Column
    disturbance: Column


@dataclass(frozen=True, kw_only=True)
class ObserverFigures:
    """Figures of one observer; the names are keys of `--json`. None: not known."""

    observer: str
    closes_loop: bool
    velocity_error_rms_rad_s: float | None
    disturbance_error_rms_rad_s2: float | None
    velocity_lag_s: float | None
    """Shift with the least RMS difference from the reference below the cut-off; positive: late."""
    velocity_noise_rad_s: float | None
    """RMS of what is above the cut-off."""
    disturbance_noise_rad_s2: float | None
    voltage_tv_V_s: float | None
    """Total variation a second: of the voltage sent where it closes the loop, else of the demand."""
    cost_us: float | None
    """Of one step, measured after the run."""
    cost_ratio: float | None
    """The same, over that of super_twisting."""


@dataclass(frozen=True, kw_only=True)
class ObserverComparison:
    """Observers side by side, over the same rows.

    Parameters
    ----------
    reference
        What errors and lag are against: `truth`, `zero_phase` or `none`.
    cutoff_hz
        Of noise and zero-phase reference.
    window_s
        First and last time that counts.
    observers
        In order; the one that closes the loop comes first.
    notes
        What is missing, and why, a sentence each.
    """

    reference: str
    cutoff_hz: float
    window_s: tuple[float, float] | None
    observers: tuple[ObserverFigures, ...]
    notes: tuple[str, ...] = ()

    def with_notes(self, *notes: str) -> ObserverComparison:
        """Return the same with further notes; empty ones are left out."""
        return replace(self, notes=(*self.notes, *filter(None, notes)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values under the names above, for JSON."""
        return asdict(self)


class ComparedRows(NamedTuple):
    """The rows of a comparison.

    Parameters
    ----------
    time
        s, shape (n,), rising.
    used
        Shape (n,): the rows that count.
    begins
        Shape (n,): rows that nothing ties to the one before, as behind a gap.
    period
        s, nominal.
    cutoff
        Hz, of noise and zero-phase reference.
    """

    time: Column
    used: NDArray[np.bool_]
    begins: NDArray[np.bool_]
    period: float
    cutoff: float = CUTOFF_HZ


def compare_observers(
    rows: ComparedRows,
    observers: Sequence[ComparedObserver],
    reference: ComparisonReference,
    costs_us: Mapping[str, float | None],
) -> ObserverComparison:
    """Compare observers over the same rows.

    Parameters
    ----------
    rows
        What counts.
    observers
        Columns of each.
    reference
        What they are judged by.
    costs_us
        Of one step, us, by the names of the observers, and of `super_twisting`.
    """
    notes: dict[str, None] = {}
    standard = costs_us.get(STANDARD)
    found = []
    for one in observers:
        figures = _figures(rows, one, reference, notes)
        cost = costs_us.get(one.name) if any(value is not None for value in figures.values()) else None
        if cost is not None and not one.closes_loop and cost > _SLOW_SHARE * 1e6 * rows.period:
            notes[
                f"{one.name} takes {cost:.0f} µs a step, of a period of {1e6 * rows.period:.0f} µs: beside "
                "the loop of a run it makes cycles late."
            ] = None
        found.append(
            ObserverFigures(
                observer=one.name,
                closes_loop=one.closes_loop,
                **figures,
                cost_us=cost,
                cost_ratio=None if cost is None or not standard else cost / standard,
            )
        )
    time = rows.time[rows.used]
    return ObserverComparison(
        reference=reference.kind,
        cutoff_hz=rows.cutoff,
        window_s=(float(time[0]), float(time[-1])) if len(time) else None,
        observers=tuple(found),
        notes=tuple(notes),
    )


def _figures(
    rows: ComparedRows, one: ComparedObserver, reference: ComparisonReference, notes: dict[str, None]
) -> dict[str, float | None]:
    """Return what the columns of one observer come to; all None if it gave up within the rows."""
    used, period = rows.used, rows.period
    velocity, disturbance = one.velocity[used], one.disturbance[used]
    if not len(velocity):
        return dict.fromkeys(_FROM_COLUMNS)
    gave_up = ~np.isfinite(velocity + disturbance)
    if gave_up.any():
        t = float(rows.time[used][np.argmax(gave_up)])
        notes[f"{one.name} has no numbers from {t:.3f} s on, and therefore no figures."] = None
        return dict.fromkeys(_FROM_COLUMNS)
    known = used & np.isfinite(reference.velocity)
    pairs = even_pieces(rows.time, (one.velocity, reference.velocity), known, rows.begins, period)
    pieces = even_pieces(rows.time, (one.velocity, one.disturbance), used, rows.begins, period)
    return {
        "velocity_error_rms_rad_s": rms(velocity - reference.velocity[used]),
        "disturbance_error_rms_rad_s2": rms(disturbance - reference.disturbance[used]),
        "voltage_tv_V_s": None if one.voltage is None else variation(rows.time[used], one.voltage[used]),
        **_filtered([(signal, true) for signal, true in pairs], pieces, rows, notes),
    }


def _filtered(
    pairs: Sequence[tuple[Column, Column]],
    pieces: Sequence[Sequence[Column]],
    rows: ComparedRows,
    notes: dict[str, None],
) -> dict[str, float | None]:
    """Return the figures that need a filter; None without scipy, which is an extra, and a note."""
    period, cutoff = rows.period, rows.cutoff
    try:
        return {
            "velocity_lag_s": lag(pairs, period, cutoff),
            "velocity_noise_rad_s": noise([velocity for velocity, _ in pieces], period, cutoff),
            "disturbance_noise_rad_s2": noise([disturbance for _, disturbance in pieces], period, cutoff),
        }
    except ConfigError as error:
        notes[f"No figures of lag and noise: {error}"] = None
        return dict.fromkeys(_FILTERED)
