"""What the tests of a backend do with it: drive it for periods, and end as an error does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import TripError
from tests.contract.benches import ALL, WIRED

if TYPE_CHECKING:
    from dcmp_hil.backend import Backend
    from dcmp_hil.values import Sample
    from tests.contract.benches import Bench

T = 1e-3
every = pytest.mark.parametrize("kind", ALL)
wired = pytest.mark.parametrize("kind", WIRED)


def drive(backend: Backend, voltage: float, periods: int) -> list[Sample]:
    """Answer samples with a voltage."""
    samples = []
    for _ in range(periods):
        samples.append(backend.read())
        backend.write(voltage)
    return samples


def at_rest(bench: Bench) -> bool:
    """Whether the amplifier is at 0 V, disarmed."""
    return bench.board.applied_mV == 0 and not bench.board.enable


ENDINGS = [TripError("test", "It happened.", "Mend it."), RuntimeError(), KeyboardInterrupt(), None]


def run_into(backend: Backend, bench: Bench, error: BaseException | None) -> None:
    """Drive for a while, and end as an error does."""
    with backend:
        drive(backend, 3.0, 20)
        assert bench.board.applied_mV == 3000
        if error:
            raise error
