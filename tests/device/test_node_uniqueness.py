"""Ticks of two devices in one stream."""

from __future__ import annotations

import pytest

from dcmp_hil.device.node_uniqueness import NodeUniqueness
from dcmp_hil.wire.messages import SampleReport, State


def sample(tick: int, counts: int = 0) -> SampleReport:
    return SampleReport(counts, 0, tick % 256, State.IDLE, missed=True, limited=False, fault_class=0)


def uniqueness(*samples: SampleReport) -> NodeUniqueness:
    found = NodeUniqueness()
    for one in samples:
        found.add(one)
    return found


@pytest.mark.parametrize("apart", [-100, -2, -1, 0, 1, 2, 50, 127])
def test_two_devices_show_at_any_distance_of_their_ticks(apart: int) -> None:
    both = [one for k in range(20) for one in (sample(k), sample(k + apart, 5))]
    assert uniqueness(*both).two_devices


@pytest.mark.parametrize(
    "samples",
    [
        [sample(k) for k in range(100)],
        [sample(k) for k in range(250, 350)],
        [one for k in range(50) for one in (sample(k), sample(k))],  # frames that come twice
        [sample(k) for k in range(0, 100, 5)],
        [sample(k) for k in (*range(50), *range(40))],  # a reset
        [sample(k ^ 1) if k % 16 < 2 else sample(k) for k in range(64)],  # now and then out of order
        [sample(0)],
    ],
)
def test_one_device_is_not_taken_for_two(samples: list[SampleReport]) -> None:
    assert not uniqueness(*samples).two_devices
