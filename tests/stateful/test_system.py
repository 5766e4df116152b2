"""Failures that the stateful machine found, as single tests."""

import pytest

from tests.stateful.system import Start, System


@pytest.mark.parametrize("volts", [3.0, -3.0])
@pytest.mark.parametrize("encoder", [2**23 - 2, -(2**23) + 1])
def test_a_start_beyond_the_wrap_of_the_count_is_still_at_the_zero(encoder: int, volts: float) -> None:
    system = System(start=Start(encoder=encoder))
    for _ in range(2):
        assert system.open()
        for _ in range(60):
            system.period(volts)
        assert system.host is not None
        assert abs(system.host.sample.position) < 3.0
        system.close()
    assert system.violations == []
