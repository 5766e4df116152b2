"""Real hosts that die: the amplifier goes off in time, by the firmware's own clock, and stays off."""

from __future__ import annotations

import pytest

from tests.firmware.core_library import compiler
from tools.host_death import WAYS, Death, die, table

GOOD = Death("SIGKILL", 5_000, 6_000, -1_000, 100, "LINK_DOWN", -9, 50, True, 1)


@pytest.fixture(scope="module")
def _compiled() -> None:
    compiler()


@pytest.mark.usefixtures("_compiled")
@pytest.mark.parametrize("way", WAYS)
def test_amplifier_goes_off_in_time_when_a_host_dies(way: str) -> None:
    death = die(way)
    assert death.wrong == []
    assert (death.seen_us is None) == (way == "SIGSTOP")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"silent_us": 21_001}, "0 V 21.0 ms after the last command"),
        ({"fed_us": 3_051}, "a command counted 3.0 ms after the deed"),
        ({"seen_us": 2_051}, "0 V 2.0 ms after the line went down"),
        ({"fault": "HOST_SILENT"}, "the device says HOST_SILENT"),
        ({"exit_code": 0}, "the host ended with 0"),
        ({"stayed_off": False}, "the amplifier came on again"),
    ],
)
def test_table_counts_what_is_wrong(changed: dict[str, object], said: str) -> None:
    wrong = GOOD._replace(**changed)  # type: ignore[arg-type]
    assert GOOD.wrong == []
    assert wrong.wrong == [said]
    assert table([GOOD, wrong]).endswith("| 1 | 0 | 0.05 |")
    assert table([GOOD, GOOD]).endswith("| 0 | 0 | 0.05 |")
