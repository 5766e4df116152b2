"""The page at every size: STOP within reach, nothing clipped, plots that are read, history, diff, memory."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config import copy_rig, load_rig
from dcmp_hil.live.client import change, status
from dcmp_hil.live.envelopes import COLUMNS, HISTORY_S
from dcmp_hil.live.tunables import value_of
from tests.live.processes import TIMEOUT_S, own_folder, started, until, until_running
from tests.panel.browser import browser, needed
from tests.panel.layout import (
    ALARM_RGB,
    CHANGE_RGB,
    CLIPPED,
    PICTURES,
    PLOTS,
    check_axes,
    check_marked,
    check_size,
    module,
    resize,
    text,
    within,
)
from tests.panel.pushed_states import pushed_states_are_drawn
from tests.panel.test_browser import address_of, free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from selenium.webdriver import Chrome

_SIZES = [(1366, 768), (1600, 900), (1920, 1080), (412, 915), (915, 412)]
_HEAP_MB, _STATE_PERIOD_S, _STATES_PER_PICTURE, _FIRST_STATES = 20.0, 0.15, 10, 200
_TIME_S = float(
    os.environ.get("DCMP_PANEL_S", "300")
)  # of states that are pushed; `make panel-hour` asks 3,600
# A run comes whose phase the page cannot draw; then words that it cannot read: may STOP be pressed?
_STOP_AFTER_FAILURES = """
const [stop, phase] = ["stop", "phase"].map((id) => document.getElementById(id));
panel.take({ connection: "none" });
const without = stop.disabled;
phase.id = "";
panel.take({ connection: "live", phase: "running" });
phase.id = "phase";
const failed = stop.disabled;
panel.take({ connection: "none" });
panel.take(panel.read('{"high": Infinity}'));
return [without, failed || stop.disabled, phase.textContent];
"""


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    needed()
    with own_folder(monkeypatch):
        yield


def test_page_is_read_at_every_size_opens_with_history_and_writes_what_is_accepted(tmp_path: Path) -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    rig = tmp_path / "ours.toml"
    copy_rig("bench-1khz", rig)
    arguments = ("run", str(rig), "--viewer", "none", "--no-record", "--duration", "0")
    with (
        started(tmp_path, *arguments, "--set", "backend.kind=sim-board") as run,
        started(tmp_path, "panel", "--port", str(free_port())) as panel,
        browser(tmp_path / "chromium") as page,
    ):
        until_running(run)
        until(lambda: status(run.pid)["t_s"] > 4.0, "there is history")
        change(run.pid, ["controller.kp_1_s2=5200"])
        page.get(address_of(panel))
        until(lambda: text(page, "phase") == "running", "the page showed the phase")
        until(lambda: _has_all_since_the_start(page), "the page had the time before it was opened")
        until(lambda: "5200" in text(page, "applied-controller.kp_1_s2"), "the gain was read back")
        ((t, _),) = status(run.pid)["marks"]
        check_marked(page, t, CHANGE_RGB)
        for width, height in _SIZES:
            check_size(page, width, height, "run")
        resize(page, 1366, 768)
        _keys_reach_everything(page)
        _diff_is_accepted(page, rig)
        page.find_element("id", "back").click()
        until(lambda: text(page, "applied-controller.kp_1_s2") == "4000", "the gain is that of the start")
        assert not page.find_element("id", "back").is_enabled()
        _drawing_that_fails_does_not_keep_from_stop(page)
        run.communicate(timeout=TIMEOUT_S)
        assert run.returncode == 0


def _has_all_since_the_start(page: Chrome) -> bool:
    first, last = module(page, "return [trace.trace.t[0] ?? 0, trace.trace.t.at(-1) ?? 0]")
    return bool(last > 4.0 and last - first > min(last, HISTORY_S) - 0.5)


def _keys_reach_everything(page: Chrome) -> None:
    """Go through the page by Tab: STOP is first, every control comes, and the focus leaves again."""
    page.execute_script("document.activeElement.blur(); scrollTo(0, 0)")
    body = page.find_element("tag name", "body")
    seen = []
    for _ in range(40):
        body.parent.switch_to.active_element.send_keys("\ue004")
        seen.append(page.execute_script("return document.activeElement.id"))
    assert seen[0] == "stop"
    for name in ("choice-controller.kind", "slider-observer.mu0_rad_s", "number-reference.rate_rad_s"):
        assert name in seen
    assert {"back", "write"} <= set(seen)
    words = "return document.querySelector('#plot-disturbance [role=img]').ariaLabel"
    until(lambda: "gravity from" in str(page.execute_script(words)), "the plots were described")
    names = "input, select, button, [role=img]"
    assert len(page.find_elements("css selector", "[role=img]")) == len(PLOTS)
    unnamed = page.execute_script(
        "return [...document.querySelectorAll(arguments[0])]"
        ".filter((e) => !(e.ariaLabel || e.textContent.trim() || e.labels?.length))"
        ".map((e) => e.id || e.outerHTML)",
        names,
    )
    assert unnamed == []


def _diff_is_accepted(page: Chrome, rig: Path) -> None:
    """Claim nothing without an answer; refuse over a file that changed; then write once, at two clicks."""
    page.find_element("id", "write").click()
    until(lambda: "+kp_1_s2 = 5200" in text(page, "sheet-text"), "the diff was shown")
    page.save_screenshot(str(PICTURES / "panel-diff-1366x768.png"))
    assert within(page, "stop")
    page.execute_script(
        "const own = fetch; window.fetch = async () => { window.fetch = own; throw Error(); }"
    )
    page.find_element("id", "sheet-accept").click()
    until(lambda: text(page, "sheet-title") == "Not confirmed", "the page said that it does not know")
    page.find_element("id", "sheet-close").click()
    page.find_element("id", "write").click()
    until(lambda: "+kp_1_s2 = 5200" in text(page, "sheet-text"), "the diff was shown")
    rig.write_text(rig.read_text("utf-8") + "# of mine\n", "utf-8")
    page.find_element("id", "sheet-accept").click()
    until(lambda: "changed meanwhile" in text(page, "sheet-said"), "it was refused")
    assert "5200" not in rig.read_text("utf-8")
    page.find_element("id", "sheet-close").click()
    page.find_element("id", "write").click()
    until(lambda: "+kp_1_s2 = 5200" in text(page, "sheet-text"), "the diff was shown again")
    page.execute_script(
        "const own = fetch; window.asked = 0;"
        "window.fetch = (...all) => { window.asked += 1; return own(...all); };"
        "const accept = document.getElementById('sheet-accept'); accept.click(); accept.click();"
    )
    until(lambda: text(page, "sheet-title") == "Written", "it was written")
    assert page.execute_script("return window.asked") == 1
    page.find_element("id", "sheet-close").click()
    assert value_of(load_rig(rig), "controller.kp_1_s2") == 5200.0
    assert rig.read_text("utf-8").endswith("# of mine\n")


def _drawing_that_fails_does_not_keep_from_stop(page: Chrome) -> None:
    """Break what draws, then take uPlot away, then the page's own script: STOP stops."""
    module(page, "window.uPlot.prototype = null; trace.trace.columns = null; trace.trace.t = null")
    _numbers_go_on(page)
    assert "STOP works" in text(page, "log")
    _reload_without(page, "*uplot.js")
    _numbers_go_on(page)
    until(lambda: "cannot draw its plots" in text(page, "log"), "the page said what it lacks")
    assert module(page, _STOP_AFTER_FAILURES) == [True, False, "not read"]
    _reload_without(page, "*panel.js")
    assert text(page, "phase") == "not known yet"
    page.find_element("id", "stop").click()
    until(lambda: "STOP: confirmed" in text(page, "log"), "STOP was confirmed")


def _numbers_go_on(page: Chrome) -> None:
    until(lambda: text(page, "time"), "the time was shown")
    shown = text(page, "time")
    until(lambda: text(page, "time") != shown, "the numbers went on")


def _reload_without(page: Chrome, file: str) -> None:
    page.execute_cdp_cmd("Network.enable", {})
    page.execute_cdp_cmd("Network.setBlockedURLs", {"urls": [file]})
    page.refresh()


def test_a_trip_is_found_on_the_page_with_its_cause_and_states_do_not_grow_its_memory(
    tmp_path: Path, figure: Callable[[str], None]
) -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    arguments = ("run", "bench-1khz", "--viewer", "none", "--no-record", "--duration", "0")
    with (
        started(tmp_path, "panel", "--port", str(free_port())) as panel,
        browser(tmp_path / "chromium") as page,
    ):
        page.get(address_of(panel))
        with started(tmp_path, *arguments, "--fault", "plant.enc_stuck:at=6s") as run:
            _, err = run.communicate(timeout=TIMEOUT_S)
        until(lambda: text(page, "phase") == "run ended", "the page said that the run ended")
        assert text(page, "banner").startswith("Run ended: ")
        sentence = text(page, "banner").removeprefix("Run ended: ").partition(". ")[0]
        assert " ".join(sentence.split())[:60] in " ".join(err.split())
        assert page.execute_script("return document.getElementById('banner').className") == "bad"
        page.refresh()  # a page that is opened after the end
        until(lambda: _has_the_end(page), "the last seconds were there")
        for width, height in _SIZES:
            resize(page, width, height)
            page.save_screenshot(str(PICTURES / f"panel-tripped-{width}x{height}.png"))
            assert page.execute_script(CLIPPED) == []
            check_axes(page)
            check_marked(page, module(page, "return trace.trace.t.at(-1)"), ALARM_RGB)
        assert module(page, "return marks.marksIn(0, 1e9).map(([, label]) => label)") == ["trip"]
        assert module(page, "return getComputedStyle(document.querySelector('#charts')).opacity") == "1"
        module(page, "panel.source.close()")  # the states are this test's from here on
        pushed_states_are_drawn(page)
        _heap_stays(page, figure)


def _has_the_end(page: Chrome) -> bool:
    count, last = module(page, "return [trace.trace.t.length, trace.trace.t.at(-1) ?? 0]")
    return bool(count > 100 and last > float(text(page, "time").split()[0]) - 0.2)


def _heap(page: Chrome) -> float:
    page.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    return 1e-6 * float(page.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"])


def _heap_stays(page: Chrome, figure: Callable[[str], None]) -> None:
    """Push states as fast as the page takes them, as texts that it parses: the share of 20 MB an hour."""
    state: dict[str, Any] = {"connection": "live", "pid": 2, "phase": "running", "columns": COLUMNS}
    push = (
        "const [text, first, count] = given;"
        "for (let k = first; k < first + count; k += 1) {"
        "  const state = JSON.parse(text); state.t_s = 0.15 * k; state.position_rad = Math.sin(k);"
        "  state.buckets = [0, 1, 2, 3].map((j) => [0.15 * k + 0.0375 * j, j % 2, "
        "    ...state.columns.flatMap(() => [Math.sin(k + j), 1 + Math.sin(k + j)])]);"
        "  panel.take(state);"
        "}"
        "await new Promise(requestAnimationFrame);"
    )
    line, before = json.dumps(state), 0.0
    for first in range(0, round(_TIME_S / _STATE_PERIOD_S), _STATES_PER_PICTURE):
        if first == _FIRST_STATES:  # 30 s: more than the page keeps
            before = _heap(page)
        module(page, push, line, first, _STATES_PER_PICTURE)
    after = _heap(page)
    figure(f"heap of the page, {_TIME_S:g} s of states: {before:.1f} -> {after:.1f} MB")
    assert module(page, "return trace.trace.t.at(-1)") > _TIME_S - 1.0
    assert module(page, "return trace.trace.t.length") <= 600
    assert after - before < _HEAP_MB * _TIME_S / 3600.0
