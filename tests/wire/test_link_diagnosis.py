"""What the counters of a link mean: the cause, and from which share on it is told."""

from __future__ import annotations

from typing import Any

import pytest

from dcmp_hil.wire.link_diagnosis import DeviceCounters, LinkCounters, growth, judge

HALF_A_PERCENT = 0.005


def causes(**counts: int | float | DeviceCounters) -> list[str]:
    counters = LinkCounters(**{"samples": 1000, **counts})  # type: ignore[arg-type]
    return [concern.cause for concern in judge(counters, HALF_A_PERCENT, HALF_A_PERCENT)]


@pytest.mark.parametrize(
    ("counts", "found"),
    [
        ({}, []),
        ({"missed": 600}, ["commands_lost"]),
        ({"missed": 5}, []),
        ({"samples": 200, "missed": 9}, []),  # so few say nothing
        ({"samples": 100, "missed": 9}, ["commands_lost"]),
        ({"samples": 20, "missed": 2}, []),
        ({"missed": 600, "device": DeviceCounters(crc_errors=590)}, ["commands_damaged"]),
        (
            {"missed": 600, "device": DeviceCounters(crc_errors=255, full=("crc_errors",))},
            ["commands_damaged"],
        ),
        ({"missed": 600, "device": DeviceCounters(crc_errors=10)}, ["commands_lost", "commands_damaged"]),
        ({"missed": 300, "skipped": 300}, []),  # this computer came late, and the timing tells of it
        ({"missed": 300, "late": 300}, []),
        ({"missed": 300, "lost": 300}, ["samples_lost"]),
        ({"missed": 300, "lost": 300, "corrupt": 300}, ["samples_damaged"]),
        ({"corrupt": 20}, ["samples_damaged"]),
        ({"device": DeviceCounters(ring_overruns=50)}, ["line_too_slow"]),
        ({"device": DeviceCounters(late_ticks=50)}, ["device_late"]),
        ({"device": DeviceCounters(bus_offs=1)}, ["bus_off"]),
        ({"clock_error": 0.02}, ["device_clock"]),
        ({"clock_error": -0.02}, ["device_clock"]),
        ({"clock_error": 0.004}, []),
    ],
)
def test_every_cause_has_its_name(counts: dict[str, int], found: list[str]) -> None:
    assert causes(**counts) == found


@pytest.mark.parametrize(
    "counts",
    [
        {"samples": 18, "lost": 58, "corrupt": 151},  # noise makes several frames of one
        {"samples": 2, "lost": 2, "corrupt": 19},
        {"samples": 20, "missed": 20, "device": DeviceCounters(crc_errors=90)},
    ],
)
def test_no_more_than_everything_is_damaged(counts: dict[str, Any]) -> None:
    (concern,) = judge(LinkCounters(**counts), HALF_A_PERCENT, HALF_A_PERCENT)
    assert concern.cause.endswith("_damaged")
    assert 0.8 < concern.share <= 1.0
    assert f"{100 * concern.share:.0f} %" in concern.text


def test_growth_of_health_is_that_of_the_run_and_says_where_it_is_a_lower_bound() -> None:
    assert growth((3, 0, 0, 0, 200), (7, 255, 0, 1, 255)) == DeviceCounters(
        4, 255, 0, 1, 55, ("sequence_gaps", "late_ticks")
    )


def test_counters_of_a_device_that_was_reset_count_anew() -> None:
    assert growth((200, 0, 0, 0, 0), (5, 0, 0, 0, 0)).crc_errors == 5


def test_a_part_of_a_run_is_the_difference_of_two_copies() -> None:
    before = LinkCounters(samples=1000, missed=3, device=DeviceCounters(crc_errors=3))
    after = LinkCounters(samples=2000, missed=43, device=DeviceCounters(crc_errors=43), clock_error=0.1)
    part = after.since(before)
    assert (part.samples, part.missed, part.clock_error) == (1000, 40, 0.1)
    assert part.device == DeviceCounters(crc_errors=40)
