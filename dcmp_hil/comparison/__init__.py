"""Observers side by side: error, lag, noise, variation and cost of each on the same samples."""

from dcmp_hil.comparison.cost import cost_per_step, observer_costs
from dcmp_hil.comparison.of_file import compare_in_file
from dcmp_hil.comparison.of_run import ObserverBeside, compare_in_run, compare_result
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
    "ObserverBeside",
    "ObserverComparison",
    "ObserverFigures",
    "compare_in_file",
    "compare_in_run",
    "compare_observers",
    "compare_result",
    "cost_per_step",
    "even_pieces",
    "lag",
    "noise",
    "observer_costs",
    "variation",
]
