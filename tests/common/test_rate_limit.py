"""One message of a name in a period; time is an argument."""

from __future__ import annotations

from dcmp_hil.common.rate_limit import RateLimit


def test_first_message_passes_and_the_next_one_after_a_period() -> None:
    limit = RateLimit(1.0)
    passed = [t for t in range(0, 3000, 250) if limit.passes("voltage", 1e-3 * t)]
    assert passed == [0, 1000, 2000]


def test_a_message_that_is_left_out_delays_none() -> None:
    limit = RateLimit(1.0)
    assert [limit.passes("slew", t) for t in (5.0, 5.9, 6.0)] == [True, False, True]


def test_each_name_has_a_period_of_its_own() -> None:
    limit = RateLimit(1.0)
    assert limit.passes("voltage", 0.0)
    assert limit.passes("slew", 0.5)
    assert not limit.passes("voltage", 0.5)
