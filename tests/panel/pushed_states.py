"""States that a test gives to the page, and what the page makes of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.live.envelopes import COLUMNS
from tests.live.processes import until
from tests.panel.layout import ALARM_RGB, late_pixels, limit_pixels, module, text, unmarked

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

_OUTLIER_RAD = 3.21
_LIVE = {"connection": "live", "pid": 1, "t_s": 1.0, "phase": "running"}
_MINUS, _DASH = "\N{MINUS SIGN}", "\N{EN DASH}"
_TILES = {
    "position_rad": 0.1234,
    "reference_rad": 0.1,
    "velocity_rad_s": -1.5,
    "error_mrad": 0.456,
    "voltage_V": 3.0,
    "voltage_limit_V": 12.0,
    "disturbance_rad_s2": -3.214,
    "gravity_rad_s2": -2.5,
    "friction_rad_s2": 1.3,
    "rest_rad_s2": -2.0,
    "lateness_us": 41.6,
    "late": 3,
    "missed": 0,
}
_TEXTS = {
    "position": "+0.123",
    "reference": "reference +0.100",
    "velocity": f"{_MINUS}1.500",
    "error": "+0.46",
    "voltage": "+3.00",
    "limit": "limit \N{PLUS-MINUS SIGN} 12 V",
    "disturbance": f"{_MINUS}3.21",
    "gravity": f"{_MINUS}2.5",
    "friction": "+1.3",
    "rest": f"{_MINUS}2.0",
    "lateness": "newest +42 \N{MICRO SIGN}s",
    "late": "3",
}
_EMPTY_TEXTS = {
    **dict.fromkeys(_TEXTS, _DASH),
    "reference": f"reference {_DASH}",
    "limit": f"limit {_DASH}",
    "lateness": f"newest {_DASH}",
    "late": "3",  # counted up to here
}


def pushed_states_are_drawn(page: Chrome) -> None:
    """Give states to a page whose own stream of them is closed."""
    _one_cycle_is_drawn(page)
    _late_cycles_and_a_limit_that_is_near_are_drawn(page)
    _a_fault_is_said_while_the_run_goes_on(page)
    _tiles_are_of_now_or_empty(page)
    _a_number_without_a_bound_has_none_on_the_page(page)


def _one_cycle_is_drawn(page: Chrome) -> None:
    """Send a bucket in which one cycle is far off: the plot reaches up to it."""
    low_high = [0.0, 0.0] * len(COLUMNS)
    low_high[1] = _OUTLIER_RAD
    state: dict[str, Any] = {**_LIVE, "columns": COLUMNS}
    state["buckets"] = [[0.04 * k, 0, *(low_high if k == 30 else [0.0] * len(low_high))] for k in range(100)]
    draw = (  # again, should a state of before have been on its way
        "panel.take(given[0]); await new Promise(requestAnimationFrame);return plots.rangeOf('position')[1]"
    )
    until(lambda: module(page, draw, state) > _OUTLIER_RAD, "the plot reached up to the one cycle")


def _late_cycles_and_a_limit_that_is_near_are_drawn(page: Chrome) -> None:
    """Send a bucket of two late cycles, and 9 V of 10: both are seen in their plots, and only there."""
    state: dict[str, Any] = {**_LIVE, "columns": COLUMNS}
    state["voltage_limit_V"] = 10.0
    at = 2 + 2 * COLUMNS.index("voltage_V") + 1
    state["buckets"] = [[0.04 * k, 2 * (k == 60), *([0.0] * 2 * len(COLUMNS))] for k in range(100)]
    state["buckets"][30][at] = 9.0
    draw = "panel.take(given[0]); await new Promise(requestAnimationFrame);"
    module(page, draw, state)
    assert late_pixels(page, 2.4) > 0
    assert late_pixels(page, 1.2) == 0
    assert limit_pixels(page, 10.0) > 50
    assert limit_pixels(page, 5.0) == 0
    assert (
        page.execute_script("return document.querySelector('#plot-voltage .limit').textContent")
        == "limit ± 10 V"
    )
    state["buckets"][30][at] = 4.0  # far below the limit
    module(page, draw, state)
    assert module(page, "return plots.rangeOf('voltage')[1]") < 5.0
    killed = {**state, "connection": "ended", "ended": "It died.", "at_zero": False, "last_phase": "running"}
    module(page, draw, killed)
    assert module(page, "return marks.marksIn(0, 1e9).map(([, label]) => label)") == ["end"]
    assert unmarked(page, 0.04 * 99, ALARM_RGB) == []


def _tiles_are_of_now_or_empty(page: Chrome) -> None:
    """Send numbers; then the same from a run that is silent, unseen, and at its end."""
    show = (
        "panel.take(given[0]); return Object.fromEntries(given[1].map((id) => "
        "[id, document.getElementById(id).textContent]))"
    )
    state = {**_LIVE, **_TILES}
    assert module(page, show, state, list(_TEXTS)) == _TEXTS
    assert module(page, show, {**state, "phase": "silent"}, list(_TEXTS)) == _EMPTY_TEXTS
    assert "No cycle has come" in text(page, "banner")
    assert module(page, show, {**state, "connection": "unseen"}, list(_TEXTS)) == _EMPTY_TEXTS
    assert "it may go on" in text(page, "banner")
    assert page.find_element("id", "stop").is_enabled()
    ended = {**state, "connection": "ended", "ended": "It ended.", "at_zero": True}
    assert module(page, show, ended, list(_TEXTS)) == {**_EMPTY_TEXTS, "voltage": "0.00"}
    assert module(page, show, {**ended, "at_zero": False}, list(_TEXTS)) == _EMPTY_TEXTS
    assert not page.find_element("id", "stop").is_enabled()


def _a_number_without_a_bound_has_none_on_the_page(page: Chrome) -> None:
    knob = {
        "key": "observer.w_noise",
        "value": 10.0,
        "unit": "",
        "meaning": "Noise.",
        "low": 0.1,
        "high": None,
    }
    state = {**_LIVE, "knobs": [{**knob, "slider": [0.1, 1000.0], "decades": True}]}
    show = (
        "panel.take(given[0]); const number = document.getElementById('number-observer.w_noise');"
        "return [number.min, number.max, number.value, number.parentElement.title]"
    )
    title = "observer.w_noise: Noise. Allowed: from 0.1."
    assert module(page, show, state) == ["0.1", "", "10", title]


def _a_fault_is_said_while_the_run_goes_on(page: Chrome) -> None:
    """Send a state with a fault of the device: the banner says cause and cure, in red, and goes with it."""
    state = {**_LIVE, "phase": "tripped", "fault": "It hung. Look at it."}
    said = (
        "panel.take(given[0]); const b = document.getElementById('banner');"
        "return [b.textContent, b.className, b.hidden, b.getAttribute('role')]"
    )
    assert module(page, said, state) == ["Fault: It hung. Look at it.", "bad", False, "alert"]
    assert module(page, said, {**state, "fault": "", "phase": "running"})[2] is True
