"""Observers side by side: error, lag, noise, variation and cost of each on the same samples."""

from dcmp_hil.comparison.cost import cost_per_step
from dcmp_hil.comparison.signal_figures import even_pieces, lag, noise, variation
from dcmp_hil.comparison.table import (
    ComparedObserver,
    ComparedRows,
    ComparisonReference,
    ObserverComparison,
    ObserverFigures,
    compare_observers,
)

__all__ = [
    "ComparedObserver",
    "ComparedRows",
    "ComparisonReference",
    "ObserverComparison",
    "ObserverFigures",
    "compare_observers",
    "cost_per_step",
    "even_pieces",
    "lag",
    "noise",
    "variation",
]
