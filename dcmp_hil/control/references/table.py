"""A reference from a CSV file: a twice differentiable curve through the points."""

from __future__ import annotations

from bisect import bisect_right
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from dcmp_hil.common.csv import read_columns
from dcmp_hil.control.references import References, ReferenceSettings
from dcmp_hil.errors import ConfigError
from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ROWS_MIN = 2


class Table(ReferenceSettings):
    """Columns `time_s` and `position_rad`; a cubic spline at rest at both ends, held after the last point."""

    in_run: ClassVar[bool] = False
    kind: Literal["csv"]
    file: str = Field(min_length=1)
    """CSV file with the columns time_s and position_rad; relative to the folder of rig.toml."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        knots, pieces = self._spline
        k = min(max(bisect_right(knots, t) - 1, 0), len(pieces) - 1)
        s = min(max(t, knots[0]), knots[-1]) - knots[k]
        c3, c2, c1, c0 = pieces[k]
        if not knots[0] <= t <= knots[-1]:
            return Reference(((c3 * s + c2) * s + c1) * s + c0, 0.0, 0.0)
        return Reference(
            ((c3 * s + c2) * s + c1) * s + c0, (3 * c3 * s + 2 * c2) * s + c1, 6 * c3 * s + 2 * c2
        )

    def at_each(self, t: NDArray[np.float64]) -> References:
        """Return the references at many instants, s after the start."""
        knots, pieces = map(np.array, self._spline)
        k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(pieces) - 1)
        s = np.minimum(np.maximum(t, knots[0]), knots[-1]) - knots[k]
        c3, c2, c1, c0 = pieces[k].T
        inside = (knots[0] <= t) & (t <= knots[-1])
        return References(
            ((c3 * s + c2) * s + c1) * s + c0,
            np.where(inside, (3 * c3 * s + 2 * c2) * s + c1, 0.0),
            np.where(inside, 6 * c3 * s + 2 * c2, 0.0),
        )

    @cached_property
    def _spline(self) -> tuple[list[float], list[list[float]]]:
        """Knots (s, from 0) and the coefficients of each piece, highest power first."""
        try:
            from scipy.interpolate import CubicSpline
        except ImportError:
            raise ConfigError(
                'reference.kind = "csv" needs scipy for its spline: pip install scipy'
            ) from None
        columns = read_columns(Path(self.file), ("time_s", "position_rad"))
        time = columns["time_s"]
        if len(time) < _ROWS_MIN:
            raise ConfigError(
                f"{self.file}: a reference needs at least two rows, got {len(time)}. Add points."
            )
        spline = CubicSpline(time - time[0], columns["position_rad"], bc_type="clamped")
        return spline.x.tolist(), spline.c.T.tolist()
