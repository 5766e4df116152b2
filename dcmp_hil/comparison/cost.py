"""Cost of an observer: fresh ones over the same samples, in this process, after the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.stage_factory import observer_of
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.config.kinds import ObserverSection
    from dcmp_hil.control.observers import Observer, ObserverContext
    from dcmp_hil.platform.clock import Clock

STANDARD = "super_twisting"
"""The observer that costs are compared with."""
_ROUNDS, _SAMPLES_MAX, _SLICE_SAMPLES = 15, 2000, 100
_NS_PER_US = 1e3
_ROUND_MAX_NS = 500_000_000  # an observer that takes longer has one round, and that one is cut short


def cost_per_step(
    makers: Mapping[str, Callable[[], Observer]], samples: Sequence[Sample], clock: Clock | None = None
) -> dict[str, float | None]:
    """Return the time that one call of `update` takes, us.

    A fresh observer goes over the samples in each of several rounds. Of every hundred of them the best round
    counts, so that an interruption spoils a hundred and no round; the observers take turns.

    Parameters
    ----------
    makers
        Make a fresh observer, by name.
    samples
        Given to each of them, in order.
    clock
        The machine's own by default.

    Returns
    -------
    dict
        By name; None for an observer that raises, or without samples.
    """
    clock = clock or MonotonicClock()
    slices = [samples[first : first + _SLICE_SAMPLES] for first in range(0, len(samples), _SLICE_SAMPLES)]
    best: dict[str, list[int] | None] = {name: [] for name in makers}
    for _ in range(_ROUNDS):
        for name, make in makers.items():
            known = best[name]
            if known is None or sum(known) > _ROUND_MAX_NS:
                continue
            try:
                took = _times_ns(make(), slices, clock)
            except Exception:  # noqa: BLE001 - a class of the user's own may raise any; it has no cost then
                best[name] = None
                continue
            best[name] = [min(pair) for pair in zip(known, took, strict=True)] if known else took
    return {name: sum(took) / (_NS_PER_US * len(samples)) if took else None for name, took in best.items()}


def _times_ns(observer: Observer, slices: Sequence[Sequence[Sample]], clock: Clock) -> list[int]:
    """Return how long an observer takes for each slice, ns; a slow one as long as for its last one asked."""
    update, now_ns, found = observer.update, clock.now_ns, []
    for samples in slices:
        began_ns = now_ns()
        for sample in samples:
            update(sample)
        found.append(now_ns() - began_ns)
        if sum(found) > _ROUND_MAX_NS:
            step_ns = found[-1] / len(samples)
            return found + [round(step_ns * len(rest)) for rest in slices[len(found) :]]
    return found


def observer_costs(
    sections: Mapping[str, ObserverSection],
    context: ObserverContext,
    folders: Sequence[Path],
    columns: tuple[NDArray[np.float64], ...],
) -> dict[str, float | None]:
    """Return the cost of a step of each observer, and of the one that all are compared with, us.

    Parameters
    ----------
    sections
        Their tables, by name.
    context, folders
        As for `observer_of`.
    columns
        Time (s), position (rad), voltage applied (V), shape (n,); the first 2000 rows are used.

    Returns
    -------
    dict
        By name; None for an observer that raises, and of fewer than 100 rows.
    """

    def maker(section: ObserverSection) -> Callable[[], Observer]:
        return lambda: observer_of(section, context, folders)

    rows = zip(*(column[:_SAMPLES_MAX].tolist() for column in columns), strict=True)
    standard = cast("ObserverSection", KINDS["observer"][STANDARD].model_validate({"kind": STANDARD}))
    makers = {name: maker(section) for name, section in {STANDARD: standard, **sections}.items()}
    if len(columns[0]) < _SLICE_SAMPLES:  # a clock cannot tell so little
        return dict.fromkeys(makers)
    return cost_per_step(makers, [Sample(*row) for row in rows])
