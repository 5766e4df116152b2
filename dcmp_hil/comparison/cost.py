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
_ROUNDS, _SAMPLES_MAX = 25, 500  # short ones: one of them is not interrupted
_NS_PER_US = 1e3


def cost_per_step(
    makers: Mapping[str, Callable[[], Observer]], samples: Sequence[Sample], clock: Clock | None = None
) -> dict[str, float | None]:
    """Return the time that one call of `update` takes, us: the best of several rounds.

    The observers take turns, so that a computer that slows down does so for all of them.

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
    best: dict[str, float | None] = dict.fromkeys(makers)
    working = dict(makers) if samples else {}
    for _ in range(_ROUNDS):
        for name, make in tuple(working.items()):
            try:
                update = make().update
                began_ns = clock.now_ns()
                for sample in samples:
                    update(sample)
                took = (clock.now_ns() - began_ns) / (_NS_PER_US * len(samples))
            except Exception:  # noqa: BLE001 - a class of the user's own may raise any; it has no cost then
                best[name] = None
                del working[name]
                continue
            known = best[name]
            best[name] = took if known is None else min(known, took)
    return best


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
        Time (s), position (rad), voltage applied (V), shape (n,); the first 500 rows are used.
    """

    def maker(section: ObserverSection) -> Callable[[], Observer]:
        return lambda: observer_of(section, context, folders)

    rows = zip(*(column[:_SAMPLES_MAX].tolist() for column in columns), strict=True)
    standard = cast("ObserverSection", KINDS["observer"][STANDARD].model_validate({"kind": STANDARD}))
    makers = {name: maker(section) for name, section in {STANDARD: standard, **sections}.items()}
    return cost_per_step(makers, [Sample(*row) for row in rows])
