"""The law in single precision on a Cortex-M4: the bits of this computer for any numbers, and its cost."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.target.chip_draws import context, cycle_orders, draw_rows, orders, r1_setup
from tests.target.chip_image import (
    FLUSH_TO_ZERO,
    Order,
    closed_loop,
    costs,
    differing,
    here,
    on_the_chip,
)
from tests.target.chip_rigs import RIGS, parameters

if TYPE_CHECKING:
    import ctypes
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from tests.target.chip_image import Words

SAMPLES = int(os.environ.get("DCMP_CHIP_SAMPLES", "100000"))
"""Of each job; `make chip` asks a million."""
COUNTED = 20_000
STEP_MAX, CYCLE_MAX = 333, 2800  # instructions
STACK_MAX = 3072  # bytes, of the 4096 that the boards' programs have
RUNNING, TRIPPED = 4, 6


def _compared(image: Path, library: ctypes.CDLL, given: Sequence[Order]) -> list[Words]:
    """Return the results of orders, which both have."""
    wanted = [here(library, order) for order in given]
    for k, (found, right) in enumerate(zip(on_the_chip(image, given), wanted, strict=True)):
        off = differing(found, right)
        assert len(off) == 0, f"order {k}: {len(off)} words differ, the first ones are {off[:5].tolist()}"
    return wanted


@pytest.fixture
def text(pytestconfig: pytest.Config) -> str:
    """Return what draws the samples: in CI the commit."""
    return str(pytestconfig.getoption("--sample-of"))


@pytest.mark.parametrize("job", ["r1", "friction"])
def test_observers_have_the_bits_of_this_computer(
    image: Path, library: ctypes.CDLL, job: str, text: str, figure: Callable[[str], None]
) -> None:
    results = _compared(image, library, list(orders(job, SAMPLES, text)))
    numbers = np.concatenate(results).view(np.float32)[:, :5]
    small = (np.abs(numbers) < np.finfo(np.float32).tiny) & (numbers != 0.0)
    seen = {"no number": np.isnan(numbers), "infinite": np.isinf(numbers), "below the normal ones": small}
    assert all(each.any() for each in seen.values())
    if job == "r1":
        assert (np.abs(numbers[:, 4]) == 10.0).any()  # saturated
    said = ", ".join(f"{np.any(each, axis=1).sum()} {name}" for name, each in seen.items())
    figure(f"chip: {SAMPLES} samples of {job} to the bit; rows with results that are {said}")


def test_whole_cycles_have_the_bits_of_this_computer(image: Path, library: ctypes.CDLL, text: str) -> None:
    results = _compared(image, library, list(cycle_orders(library, SAMPLES, text)))
    assert {RUNNING, TRIPPED} <= set(np.concatenate(results)[:, 9].tolist())


def test_a_closed_loop_has_the_bits_of_this_computer(image: Path, library: ctypes.CDLL) -> None:
    loops = [closed_loop(library, parameters(settings), 5000) for settings in RIGS]
    found = _compared(image, library, [loop.order for loop in loops])
    for loop, results in zip(loops, found, strict=True):
        assert np.array_equal(loop.results, results)
        assert loop.began >= 0


def test_flushed_numbers_would_be_noticed(image: Path, library: ctypes.CDLL) -> None:
    draw = np.random.default_rng(1)
    rig = context(draw)
    order = Order("r1", r1_setup(rig, draw), draw_rows("extreme", rig, draw))
    (found,) = on_the_chip(image, [order._replace(fpscr=FLUSH_TO_ZERO)])
    assert len(differing(found, here(library, order))) > 0


def test_a_step_costs_at_most_so_much(
    image: Path, library: ctypes.CDLL, text: str, figure: Callable[[str], None]
) -> None:
    for job, most in (("r1", STEP_MAX), ("friction", CYCLE_MAX)):
        found = costs(image, list(orders(job, COUNTED, text)))
        counted = np.concatenate([each.instructions for each in found])
        stack = max(each.stack for each in found)
        figure(
            f"chip: {job}: {np.median(counted):.0f} instructions, at most {counted.max()}; stack {stack} B"
        )
        assert len(counted) > 0.8 * COUNTED
        assert counted.max() <= most
        assert stack <= STACK_MAX
    loops = [closed_loop(library, parameters(settings), COUNTED).order for settings in RIGS]
    for settings, cost in zip(RIGS, costs(image, loops), strict=True):
        counted = cost.instructions
        name = " ".join(settings) or "as shipped"
        figure(f"chip: cycle {name}: {np.median(counted):.0f}, at most {counted.max()}; stack {cost.stack} B")
        assert counted.max() <= CYCLE_MAX
        assert cost.stack <= STACK_MAX
