"""A group of runs from the first tick to the last, block by block on threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim_backend.lanes.block_group import Mode, blocks_of, common_of, key_of
from sim_backend.lanes.library import address
from sim_backend.lanes.reference_rows import reference_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from sim_backend.lanes.library import Lanes

_TICKS_AT_ONCE = 1 << 15
"""Ticks of one call: their reference takes 4 MB, and a call some 100 ms."""
_SAMPLE_NUMBERS = 3  # t, position, voltage


class GroupResult(NamedTuple):
    """State of the runs of a group at their end.

    Parameters
    ----------
    state
        `struct lanes_state` of each block.
    kept
        The last samples of each lane, shape (blocks, samples, 3, lanes), a ring by the number of the cycle;
        None where none were kept.
    """

    state: NDArray[np.void]
    kept: NDArray[np.float64] | None

    def of(self, name: str) -> NDArray[np.float64]:
        """Return a number of each lane, padding included."""
        return np.asarray(self.state[name], float).ravel()


def run_group(
    lanes: Lanes, rigs: Sequence[Rig], duration_s: float, mode: Mode, threads: int = 1
) -> GroupResult:
    """Run the rigs of one group.

    Parameters
    ----------
    lanes
        The library.
    rigs
        With equal keys.
    duration_s
        s, of each run.
    mode
        How they are run.
    threads
        Blocks that run at the same time.
    """
    key = key_of(rigs[0])
    common = common_of(key, duration_s, lanes.layout, mode)
    blocks, gap_steps = blocks_of(rigs, lanes.layout, mode)
    shape = (len(blocks), mode.kept, _SAMPLE_NUMBERS, lanes.layout.lanes)
    kept = np.zeros(shape) if mode.kept else None
    going = list(range(len(blocks)))
    first = 0
    with ThreadPoolExecutor(threads) as pool:
        while going:
            ticks = range(first, first + min(_TICKS_AT_ONCE, _ticks(duration_s, key.period, first)))
            rows = reference_rows(key.reference, key.instants, ticks, lanes.layout.row)
            call = partial(_run_block, lanes, common, blocks, rows, first, gap_steps, kept)
            left = list(pool.map(call, going)) if threads > 1 else [call(k) for k in going]
            going = [block for block, lanes_left in zip(going, left, strict=True) if lanes_left]
            first = ticks.stop
    return GroupResult(blocks["state"], kept)


def _ticks(duration_s: float, period: float, first: int) -> int:
    """Return how many further ticks most runs need; a way to 0 V or lost samples take more."""
    usual = round(duration_s / period) - first
    return usual if usual > 0 else max(64, round(0.1 / period))


def _run_block(
    lanes: Lanes,
    common: NDArray[np.void],
    blocks: NDArray[np.void],
    rows: NDArray[np.void],
    first: int,
    gap_steps: NDArray[np.float64] | None,
    kept: NDArray[np.float64] | None,
    block: int,
) -> int:
    """Run some ticks of one block; return how many of its lanes go on."""
    steps = None if gap_steps is None else gap_steps[block]
    ring = None if kept is None else kept[block]
    return lanes.run(
        address(common),
        address(blocks[block : block + 1]),
        address(rows),
        first,
        len(rows),
        address(steps),
        address(ring),
    )
