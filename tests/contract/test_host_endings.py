"""Real hosts that end: 0 V at once, disarmed, everything kept, the right code."""

from __future__ import annotations

import pytest

from tests.firmware.core_library import compiler
from tools.host_endings import Ending, end, median_us, table

GOOD = Ending(
    way="SIGTERM",
    off_us=1_600,
    gone_s=1.0,
    exit_code=143,
    state="IDLE",
    fault="NONE",
    kept=["run.rrd", "summary.json"],
    said="",
    doubt_us=50,
    waited_us=100,
    late_us=100,
    pressed_s=0.5,
    gap_us=1_100,
    tries=1,
)


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
        ({"off_us": 50_251}, "0 V after 50.0 ms"),
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
    assert median_us([GOOD], signalled=True) == 1_350


def test_usual_time_to_zero_volts_is_that_of_all_signals_and_of_all_errors() -> None:
    signals = [
        GOOD._replace(way=way, off_us=250 + own_us) for way, own_us in (("Ctrl-C", 3_400), ("SIGHUP", 1_300))
    ]
    errors = [GOOD._replace(way="the loop itself", off_us=250 + 700)]
    assert median_us([GOOD, *signals, *errors], signalled=True) == 1_350
    assert median_us([GOOD, *signals, *errors], signalled=False) == 700
    assert median_us([], signalled=True) == 0


def test_ending_with_unknown_instants_or_wrong_with_a_device_that_stood_still_does_not_count() -> None:
    late = GOOD._replace(gap_us=10_001)
    assert GOOD.well_timed
    assert late.well_timed
    assert GOOD._replace(exit_code=3).well_timed
    assert not late._replace(exit_code=3).well_timed
    assert not GOOD._replace(doubt_us=5_001).well_timed
