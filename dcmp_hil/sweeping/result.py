"""Result of a sweep: its table, quantiles, the worst runs, and the command that repeats one."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dcmp_hil.sweeping.design import SweepDesign, override
from dcmp_hil.sweeping.engine import FIGURES

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.sweeping.spec import SweepSpec

_QUANTILES = (0.05, 0.5, 0.95)
JUDGED = "tracking_rms_rad"
"""The figure by which runs are worse than others."""


class FigureQuantiles(NamedTuple):
    """Distribution of a figure over the runs that were not ended, in the unit of its name."""

    figure: str
    least: float
    p5: float
    p50: float
    p95: float
    most: float


class WorstRun(NamedTuple):
    """One of the worst runs: ended ones first, then those with the largest tracking error."""

    run: int
    tripped: bool
    trip_time_s: float
    trip_cause: str
    tracking_rms_rad: float
    command: str
    """What repeats it, with the same bits."""


@dataclass(frozen=True)
class SweepResult:
    """Result of a sweep.

    Parameters
    ----------
    spec
        What was swept.
    table
        A `pyarrow.Table`, a row a run in their order: run, each swept key under its dotted name, engine,
        refused (the sentence of the rule, empty for none), the figures of `dcmp_hil.Summary`, tripped,
        trip_time_s, trip_cause. `table.to_pandas()` makes a data frame.
    folder
        Where the parts are; None if they were not kept.
    """

    spec: SweepSpec
    table: Any
    folder: Path | None = None

    def column(self, name: str) -> NDArray[Any]:
        """Return a column as an array, shape (runs,)."""
        return np.asarray(self.table.column(name).to_pylist())

    @property
    def tripped(self) -> NDArray[np.bool_]:
        """Runs that the supervisor ended, shape (runs,)."""
        return self.column("tripped").astype(np.bool_)

    @property
    def refused(self) -> NDArray[np.bool_]:
        """Runs that the rules refused, shape (runs,)."""
        return np.array([bool(one) for one in self.table.column("refused").to_pylist()], np.bool_)

    def quantiles(self) -> list[FigureQuantiles]:
        """Return the distribution of each figure over the runs that were neither refused nor ended."""
        whole = ~(self.tripped | self.refused)
        found = []
        for name in FIGURES[1:]:
            values = self.column(name).astype(np.float64)[whole]
            values = values[~np.isnan(values)]
            if len(values):
                low, middle, high = (float(one) for one in np.quantile(values, _QUANTILES))
                found.append(
                    FigureQuantiles(name, float(values.min()), low, middle, high, float(values.max()))
                )
        return found

    def worst(self, count: int = 3) -> list[WorstRun]:
        """Return the worst runs, the worst first."""
        tripped, time = self.tripped, self.column("trip_time_s").astype(np.float64)
        error = self.column(JUDGED).astype(np.float64)
        key = np.where(tripped, -1e9 + np.nan_to_num(time), -np.nan_to_num(error, nan=-math.inf))
        key[self.refused] = math.inf
        order = [int(row) for row in np.argsort(key, kind="stable") if math.isfinite(key[row])][:count]
        causes = self.table.column("trip_cause")
        return [
            WorstRun(
                row,
                bool(tripped[row]),
                float(time[row]),
                str(causes[row].as_py()),
                float(error[row]),
                self.command(row),
            )
            for row in order
        ]

    def command(self, run: int) -> str:
        """Return the command line that repeats a run, with the same bits."""
        spec = self.spec
        words = ["dcmp-hil", "run", spec.rig, "--fast", "--duration", f"{spec.duration_s!r}s"]
        given = {**spec.set, **SweepDesign(spec).named(run)}
        for key, value in given.items():
            words += ["--set", override(key, value)]
        for fault in spec.faults:
            words += ["--fault", fault]
        return shlex.join(words)
