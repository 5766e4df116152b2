"""A recorded run and what came of it a second time, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.reexecute import Reexecution

    Column = NDArray[np.float64]


class ComparisonLine(NamedTuple):
    """A figure of both runs; None if it is not known."""

    name: str  # with its unit
    recorded: float | None
    again: float | None


class Comparison(NamedTuple):
    """Result of a comparison, as `--json` writes it.

    Parameters
    ----------
    identical
        Whether every number is the same, to the bit.
    rows
        Periods compared.
    figures
        Both runs' figures, and the largest differences.
    """

    identical: bool
    rows: int
    figures: tuple[ComparisonLine, ...]


def compare(recorded: RecordedRun, again: Reexecution, start: float = 0.0) -> Comparison:
    """Compare what observer and controller said then and now.

    Parameters
    ----------
    recorded, again
        The run, and what was made of it.
    start
        s from the first period: the figures count what is not earlier. `identical` counts every cycle.
    """
    block = recorded.block
    names = ("position", "velocity", "disturbance")
    then = np.stack([block[f"{name}_estimate"] for name in names], axis=1)
    demand = block["voltage_demand"]
    same = _bits(then) == _bits(again.estimate) and _bits(demand) == _bits(again.demand)
    late = block["t"] - block["t"][0] >= start if len(block) else np.zeros(0, dtype=bool)
    then, demand, now, asked = then[late], demand[late], again.estimate[late], again.demand[late]
    true = {name: block[f"{name}_true"][late] for name in names}
    t = block["t"][late]
    duration = float(t[-1] - t[0]) if len(t) > 1 else 0.0
    figures = [
        *(
            ComparisonLine(
                f"{name}_error_rms_{unit}",
                _rms(then[:, k] - true[name]),
                _rms(now[:, k] - true[name]),
            )
            for k, (name, unit) in enumerate(zip(names, ("rad", "rad_s", "rad_s2"), strict=True))
        ),
        ComparisonLine("demand_tv_V_s", _variation(demand, duration), _variation(asked, duration)),
        ComparisonLine("velocity_difference_max_rad_s", None, _largest(now[:, 1] - then[:, 1])),
        ComparisonLine("disturbance_difference_max_rad_s2", None, _largest(now[:, 2] - then[:, 2])),
        ComparisonLine("demand_difference_max_V", None, _largest(asked - demand)),
    ]
    return Comparison(same, len(t), tuple(figures))


def _bits(values: Column) -> bytes:
    """Return every bit: NaN is the same as NaN, and 0 not as -0."""
    return np.ascontiguousarray(values).tobytes()


def _known(values: Column) -> Column:
    return values[np.isfinite(values)]


def _rms(values: Column) -> float | None:
    known = _known(values)
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def _largest(values: Column) -> float | None:
    known = _known(values)
    return float(np.abs(known).max()) if len(known) else None


def _variation(values: Column, duration: float) -> float | None:
    return float(np.abs(np.diff(_known(values))).sum() / duration) if duration > 0.0 else None
