"""The tables of the reproduction: what is claimed, what comes out, and what may come out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.paper.measures import Measures


@dataclass(frozen=True, slots=True)
class Expected:
    """Expected value and tolerance of one quantity of the paper.

    Parameters
    ----------
    quantity
        A field of `Measures`.
    claimed
        By the paper, in the quantity's unit; None where the paper says nothing.
    low, high
        Bounds of what the corrected equations may give.
    """

    quantity: str
    claimed: float | None
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity: claimed, by the printed equations, by the corrected ones, and within what bounds."""

    quantity: str
    claimed: float | None
    printed_eq9: float
    printed_eq10: float
    corrected: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether the corrected equations give what they must; NaN never does."""
        return self.low <= self.corrected <= self.high


@dataclass(frozen=True, slots=True)
class Printed:
    """A misprint of the paper, its correction, and the run that shows its effect.

    Parameters
    ----------
    equation
        Where it stands.
    printed, meant
        A line each.
    variant
        The run that takes it at its word.
    quantity
        A field of `Measures` that shows the damage.
    low, high
        Bounds of what that run may give.
    """

    equation: str
    printed: str
    meant: str
    variant: str
    quantity: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Misprint:
    """One misprint and one quantity that it spoils."""

    equation: str
    printed: str
    meant: str
    quantity: str
    as_printed: float
    corrected: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether the printed form does the damage it is known for; NaN never does."""
        return self.low <= self.as_printed <= self.high


EXPECTED_ROWS = (
    Expected("voltage_at_start_V", None, 1174.9, 1175.1),
    Expected("tracking_max_rad", 1e-4, 0.0, 3e-5),
    Expected("tracking_rms_rad", None, 3.15e-6, 3.85e-6),
    Expected("velocity_error_max_rad_s", 1e-4, 0.0, 6e-4),
    Expected("disturbance_error_rms_rad_s2", None, 0.10, 0.15),
    Expected("velocity_settled_s", 1.0, 0.375, 0.415),  # all states "after one second": an upper bound
    Expected("voltage_peak_V", None, 2.55, 2.65),
    Expected("damping", 1.0, 1.0275, 1.0285),
)

_EQ9 = ("(9)", "v3+L2 v1+f0 v2", "v3+(L1+f0) v2\n+(L2+f0 L1) v1", "eq9")
_EQ10 = ("(10)", "1/ku [..]", "[..]", "eq10")
_EQ8 = ("(8)", "v1' twice", "n1, and v1' = n1", "eq8")
_BOUND = ("III.A", "M > |w|: 17", "M > |e'''|: 1000", "M17")

PRINTED_ROWS = (
    Printed(*_EQ9, "disturbance_error_rms_rad_s2", 3.42, 3.78),
    Printed(*_EQ9, "tracking_max_rad", 1.25e-3, 1.53e-3),
    Printed(*_EQ10, "tracking_max_rad", 1.435e-2, 1.585e-2),
    Printed(*_EQ10, "damping", 0.43, 0.46),
    Printed(*_EQ8, "velocity_error_max_rad_s", 0.53, 0.59),
    Printed(*_BOUND, "velocity_settled_s", 1.41, 1.51),
)


def rows(corrected: Measures, eq9: Measures, eq10: Measures) -> tuple[Row, ...]:
    """Return the table of three runs and the expected values."""
    return tuple(
        Row(
            quantity=expected.quantity,
            claimed=expected.claimed,
            printed_eq9=getattr(eq9, expected.quantity),
            printed_eq10=getattr(eq10, expected.quantity),
            corrected=getattr(corrected, expected.quantity),
            low=expected.low,
            high=expected.high,
        )
        for expected in EXPECTED_ROWS
    )


def misprints(corrected: Measures, variants: dict[str, Measures]) -> tuple[Misprint, ...]:
    """Return the table of the runs of `PRINTED_ROWS`, by variant, beside the corrected run."""
    return tuple(
        Misprint(
            equation=one.equation,
            printed=one.printed,
            meant=one.meant,
            quantity=one.quantity,
            as_printed=getattr(variants[one.variant], one.quantity),
            corrected=getattr(corrected, one.quantity),
            low=one.low,
            high=one.high,
        )
        for one in PRINTED_ROWS
    )


def as_json(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return the rows as plain values, for `dcmp-hil paper --json`."""
    return [
        {
            "quantity": row.quantity,
            "claimed": row.claimed,
            "printed_eq9": row.printed_eq9,
            "printed_eq10": row.printed_eq10,
            "corrected": row.corrected,
            "low": row.low,
            "high": row.high,
            "pass": row.passed,
        }
        for row in rows
    ]
