"""Real hosts that end: 0 V at once, disarmed, everything kept, the right code."""

from __future__ import annotations

import pytest

from tests.firmware.core_library import compiler
from tools.host_endings import Ending, end, median_us, table

GOOD = Ending("SIGTERM", 1_500, 1.0, 143, "IDLE", "NONE", ["run.rrd", "summary.json"], "", 50, 100, 0.5, 1)


@pytest.fixture(scope="module")
def _compiled() -> None:
    compiler()


@pytest.mark.usefixtures("_compiled")
@pytest.mark.parametrize(
    "way", ["Ctrl-C", "controller: BaseException", "controller: no voltage", "the loop itself"]
)
def test_host_that_ends_leaves_zero_volts_and_everything_it_saw(way: str) -> None:
    assert end(way).wrong == []


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"off_us": 50_151}, "0 V after 50.0 ms"),
        ({"gone_s": 2.6}, "gone after 2.1 s"),
        ({"exit_code": 0, "said": "bye"}, "code 0: bye"),
        ({"state": "FAULT", "fault": "HOST_SILENT"}, "FAULT with HOST_SILENT"),
        ({"kept": ["run.rrd"]}, "kept only ['run.rrd']"),
    ],
)
def test_table_of_endings_counts_what_is_wrong(changed: dict[str, object], said: str) -> None:
    wrong = GOOD._replace(**changed)  # type: ignore[arg-type]
    assert GOOD.wrong == []
    assert wrong.wrong == [said]
    assert "| 1 | 0 |" in table([GOOD, wrong])
    assert median_us([GOOD], "SIGTERM") == 1_350
