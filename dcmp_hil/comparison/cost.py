"""Cost of an observer: fresh ones over the same samples, in this process, after the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from dcmp_hil.control.observers import Observer
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Sample

_ROUNDS = 7
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
