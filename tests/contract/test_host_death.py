"""Real hosts that die: the amplifier goes off within the watchdog's time, by the firmware's own clock."""

from __future__ import annotations

import pytest

from tests.firmware.core_library import compiler
from tools.host_death import die

RESOLUTION_US = 1_000  # the deed falls somewhere into a period


@pytest.fixture(scope="module", autouse=True)
def needs_compiler() -> None:
    compiler()


def test_killed_host_is_a_link_that_went_down() -> None:
    death = die("SIGKILL")
    assert death.fault == "LINK_DOWN"
    assert death.off_us is not None
    assert death.off_us <= 21_000 + RESOLUTION_US
    assert death.exit_code == -9


def test_stopped_host_runs_into_the_watchdog() -> None:
    death = die("SIGSTOP")
    assert death.fault == "HOST_SILENT"
    assert death.off_us is not None
    assert 18_000 <= death.off_us <= 21_000 + RESOLUTION_US


def test_host_whose_device_is_unplugged_ends_with_code_3() -> None:
    assert die("unplug").exit_code == 3
