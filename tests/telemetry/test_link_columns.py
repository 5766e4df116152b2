"""Counters of the link as lines with names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.values import Event, EventKind, LinkData
from tests.telemetry.runs import VIEW, entities, read_back

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def told(t: float, counters: Mapping[str, int]) -> Event:
    return Event(t, "DEBUG", EventKind.LINK, "", LinkData(counters))


def test_only_what_counts_something_has_a_line_and_what_is_lost_has_one_from_the_start(
    tmp_path: Path,
) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    sink.event(told(1.0, {"lost": 0, "late": 0, "crc_errors": 0}))
    sink.event(told(2.0, {"lost": 0, "late": 3, "crc_errors": 0}))
    sink.event(told(3.0, {"lost": 1, "late": 3, "crc_errors": 9}))
    sink.close()
    assert {name for name in entities(tmp_path / "run.rrd") if name.startswith("link/")} == {
        *("link/lost", "link/late", "link/crc_errors"),
    }
    for name, label, counts in (
        ("lost", "lost", [0, 0, 1]),
        ("late", "late", [3, 3]),
        ("crc_errors", "crc errors", [9]),
    ):
        table = read_back(tmp_path / "run.rrd", f"link/{name}")
        assert table["SeriesLines:names"] == [[label]]
        assert table["Scalars:scalars"] == [[float(count)] for count in counts]


@pytest.mark.parametrize("counters", [{}, {"late": 0}])
def test_what_was_not_told_has_no_line(tmp_path: Path, counters: dict[str, int]) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    sink.event(told(1.0, counters))
    sink.close()
    assert not [name for name in entities(tmp_path / "run.rrd") if name.startswith("link/")]
