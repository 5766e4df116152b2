"""The banner: what a person reads first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
import rerun as rr

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.rerun.banner import AMBER, GREEN, GREY, LAST, PATH, RED, Banner
from dcmp_hil.telemetry.rerun.entity_columns import Frames
from dcmp_hil.values import CauseData, ChangeData, EndData, Event, EventKind, LimitData, PhaseData
from tests.telemetry.runs import VIEW, blocks
from tests.telemetry.test_marks import TRIP

if TYPE_CHECKING:
    from collections.abc import Mapping


def phase(name: str, t: float = 0.0) -> Event:
    return Event(t, "INFO", EventKind.PHASE, "in other words", PhaseData(name))


def banner(*events: Event, before: Mapping[str, str] = {}, after: Mapping[str, str] = {}) -> Banner:
    made = Banner()
    for event in events:
        made.take(event, before, after)
    return made


WARNING = Event(2.0, "WARN", EventKind.LIMIT, "voltage limited", LimitData("voltage"))
CHANGE = Event(14.172, "INFO", EventKind.CHANGE, "x", ChangeData({"controller.kp_1_s2": 4500.0}))


def test_phase_last_change_and_last_warning_in_one_sentence() -> None:
    key = "controller.kp_1_s2"
    made = banner(phase("running"), WARNING, CHANGE, before={key: "6500"}, after={key: "4500"})
    assert made.text(15.0) == "**RUNNING** · kp_1_s2 6500 → 4500 at 14.172 s · ▲ 2.000 s: voltage limited"
    assert banner(phase("probing")).text(9.0) == "**PROBING**"


def test_the_sentence_of_a_run_is_one_line_and_a_warning_leaves_it() -> None:
    keys = [f"controller.gain_{k}" for k in range(9)]
    change = CHANGE._replace(data=ChangeData(dict.fromkeys(keys, 1.0)))
    long = WARNING._replace(text="voltage limited " * 20)
    made = banner(phase("running"), change, long)
    assert made.text(3.0).count("…") == 2
    assert len(made.text(3.0)) <= 155
    assert "▲" in made.text(31.9)
    assert "▲" not in made.text(32.1)
    frames = Frames(VIEW)
    for event in (phase("running"), WARNING):
        frames.of_event(event)
    first, *_ = blocks(200)
    assert PATH not in [entity for entity, *_ in frames.of_block(first)]
    first.rows[:, FIELDS.index("t")] += 32.1
    assert [_text(columns) for entity, _, columns in frames.of_block(first) if entity == PATH] != []
    assert PATH not in [entity for entity, *_ in frames.of_block(first)]


def test_a_trip_in_large_words_with_cause_and_cure() -> None:
    made = banner(phase("running"), phase("tripped", 1.999), TRIP)
    assert made.text(15.0) == "# TRIPPED: travel, at 1.999 s\n\n**6.3 rad.** Check it."
    assert banner(phase("tripped", 3.0)).text(9.0) == "# ENDED BY A FAULT at 3.000 s"
    late = Event(5.0, "ERROR", EventKind.DEADLINE, "deadline: 3 are late. Use less.", CauseData("deadline"))
    assert banner(late).text(9.0) == "# TRIPPED: deadline, at 5.000 s\n\n**deadline: 3 are late.** Use less."
    lost = Event(6.0, "ERROR", EventKind.END, "0 V was not confirmed: the device goes there by itself")
    assert banner(lost).text(9.0).startswith("# ENDED BY A FAULT at 6.000 s\n\n**0 V was not")


def test_an_end_says_what_it_was() -> None:
    end = Event(9.0, "INFO", EventKind.END, "amplifier at 0 V")
    assert banner(phase("running"), end).text(9.0) == "**ENDED** · amplifier at 0 V"
    assert not banner(phase("running"), end).tripped
    kept = Event(9.0, "WARN", EventKind.DEVICE_END, "the device ended the run by itself")
    assert not banner(phase("running"), kept, end).tripped
    failed = end._replace(data=EndData("ZeroDivisionError", "division by zero"))
    made = banner(phase("running"), failed)
    assert made.text(15.0) == (
        "# ENDED BY A FAULT: ZeroDivisionError, at 9.000 s\n\n**division by zero.** Amplifier at 0 V."
    )
    assert (made.tripped, made.colour(9.0)) == (True, RED)


def test_the_first_cause_stays() -> None:
    later = Event(9.0, "ERROR", EventKind.END, "0 V was not confirmed")
    assert banner(phase("tripped", 1.999), TRIP, later).text(9.0).startswith("# TRIPPED: travel, at 1.999 s")
    assert "not confirmed" not in banner(TRIP, later).text(9.0)
    later = later._replace(data=EndData("LinkError", "The cable is out."))
    assert banner(TRIP, later).text(9.0) == banner(TRIP).text(9.0)


@pytest.mark.parametrize(
    ("events", "t", "colour"),
    [
        ((), 0.0, GREY),
        ((phase("settling"),), 0.5, GREY),
        ((phase("running"),), 1.0, GREEN),
        ((phase("running"), WARNING), 11.9, AMBER),
        ((phase("running"), WARNING), 12.1, GREEN),
        ((phase("running"), WARNING, phase("tripped", 3.0)), 3.0, RED),
        ((phase("running"), Event(3.0, "INFO", EventKind.END, "amplifier at 0 V")), 3.0, GREY),
    ],
)
def test_the_lamp(events: tuple[Event, ...], t: float, colour: tuple[int, int, int]) -> None:
    assert banner(*events).colour(t) == colour


def test_the_last_events_stand_with_the_newest_first() -> None:
    made = banner(*(Event(float(k), "INFO", EventKind.OTHER, f"number {k}") for k in range(40)), WARNING)
    made.take(Event(0.0, "INFO", EventKind.GRANT, "SCHED_FIFO: granted"), {}, {})
    lines = made.last.split("  \n")
    assert lines[0] == "▲ **2.000 s** voltage limited"
    assert lines[1] == "**39.000 s** number 39"
    assert len(lines) == 12


def test_no_text_of_an_event_is_markup() -> None:
    failed = Event(2.0, "WARN", EventKind.TELEMETRY, "a|b.csv: full.\n# *Free* some space.")
    made = banner(phase("running"), failed)
    assert made.last == r"▲ **2.000 s** a\|b.csv: full. # \*Free\* some space."
    assert r"2.000 s: a\|b.csv: full. # \*Free\* some" in made.text(3.0)
    tripped = Event(3.0, "ERROR", EventKind.TRIP, "tripped (own): *x*. See\n[model].", CauseData("own"))
    assert banner(tripped).text(9.0) == "# TRIPPED: own, at 3.000 s\n\n**\\*x\\*.** See \\[model\\]."


def test_what_is_sent_once_comes_again_with_banner_lamp_and_events() -> None:
    frames = Frames(VIEW)
    frames.of_event(phase("running"))
    frames.of_event(WARNING)
    rr.set_strict_mode(True)
    calls = {entity: columns for entity, _, columns in frames.of_once(20.0)}
    assert {PATH, LAST, "lamp", "phase", "params"} <= calls.keys()
    assert "voltage limited" in _text(calls[PATH])
    assert "voltage limited" in _text(calls[LAST])


def _text(columns: Any) -> str:
    return " ".join(str(column.as_arrow_array()) for column in columns)
