"""The page at every size: STOP within reach, nothing clipped, plots that are read, history, diff, memory."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config import copy_rig, load_rig
from dcmp_hil.live.client import change, status
from dcmp_hil.live.envelopes import COLUMNS, HISTORY_S
from dcmp_hil.live.tunables import value_of
from tests.live.processes import TIMEOUT_S, own_folder, started, until, until_running
from tests.panel.browser import browser, needed
from tests.panel.layout import CLIPPED, PICTURES, check_axes, check_size, module, resize, text, within
from tests.panel.test_browser import address_of, free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from selenium.webdriver import Chrome

_SIZES = [(1366, 768), (1600, 900), (1920, 1080), (412, 915), (915, 412)]
_HEAP_MB, _FRAME_S, _FRAMES_AT_ONCE = 20.0, 0.15, 200
_TIME_S = float(
    os.environ.get("DCMP_PANEL_S", "300")
)  # of states that are pushed; `make panel-hour` asks 3,600
_OUTLIER_RAD = 3.21


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
        first, last = module(page, "return [trace.trace.t[0], trace.trace.t.at(-1)]")
        assert last - first > min(last, HISTORY_S) - 0.5  # the page was not there
        until(lambda: "5200" in text(page, "applied-controller.kp_1_s2"), "the gain was read back")
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
    names = "input, select, button, canvas + *, [role=img]"
    unnamed = page.execute_script(
        "return [...document.querySelectorAll(arguments[0])]"
        ".filter((e) => !(e.ariaLabel || e.textContent.trim() || e.labels?.length)).map((e) => e.outerHTML)",
        names,
    )
    assert [one for one in unnamed if "u-" not in one] == []
    words = "return document.querySelector('#plot-disturbance [role=img]').ariaLabel"
    until(lambda: "gravity from" in str(page.execute_script(words)), "the plot was described")


def _diff_is_accepted(page: Chrome, rig: Path) -> None:
    """Refuse over a file that changed, then write; STOP stays within reach meanwhile."""
    page.find_element("id", "write").click()
    until(lambda: "+kp_1_s2 = 5200" in text(page, "sheet-text"), "the diff was shown")
    page.save_screenshot(str(PICTURES / "panel-diff-1366x768.png"))
    assert within(page, "stop")
    rig.write_text(rig.read_text("utf-8") + "# of mine\n", "utf-8")
    page.find_element("id", "sheet-accept").click()
    until(lambda: "changed meanwhile" in text(page, "sheet-said"), "it was refused")
    assert "5200" not in rig.read_text("utf-8")
    page.find_element("id", "sheet-close").click()
    page.find_element("id", "write").click()
    until(lambda: "+kp_1_s2 = 5200" in text(page, "sheet-text"), "the diff was shown again")
    page.find_element("id", "sheet-accept").click()
    until(lambda: text(page, "sheet-title") == "Written", "it was written")
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
    _reload_without(page, "*panel.js")
    assert text(page, "phase") == "no run"  # it does not know better
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
        until(lambda: module(page, "return trace.trace.t.length") > 100, "the last seconds were there")
        for width, height in _SIZES:
            resize(page, width, height)
            page.save_screenshot(str(PICTURES / f"panel-tripped-{width}x{height}.png"))
            assert page.execute_script(CLIPPED) == []
            check_axes(page)
        assert module(page, "return getComputedStyle(document.querySelector('#charts')).opacity") == "1"
        panel.send_signal(signal.SIGSTOP)  # the states are this test's from here on
        _one_cycle_is_drawn(page)
        _a_fault_is_said_while_the_run_goes_on(page)
        _heap_stays(page, figure)


def _one_cycle_is_drawn(page: Chrome) -> None:
    """Send a bucket in which one cycle is far off: the plot reaches up to it."""
    low_high = [0.0, 0.0] * len(COLUMNS)
    low_high[1] = _OUTLIER_RAD
    state = {"connection": "live", "pid": 1, "t_s": 1.0, "phase": "running", "columns": COLUMNS}
    state["buckets"] = [[0.04 * k, 0, *(low_high if k == 30 else [0.0] * len(low_high))] for k in range(100)]
    draw = (  # again, should a state of before have been on its way
        "panel.take(given[0]); await new Promise(requestAnimationFrame);return plots.rangeOf('position')[1]"
    )
    until(lambda: module(page, draw, state) > _OUTLIER_RAD, "the plot reached up to the one cycle")


def _a_fault_is_said_while_the_run_goes_on(page: Chrome) -> None:
    """Send a state with a fault of the device: the banner says cause and cure, in red, and goes with it."""
    state = {"connection": "live", "pid": 1, "t_s": 1.1, "phase": "tripped", "fault": "It hung. Look at it."}
    said = (
        "panel.take(given[0]); const b = document.getElementById('banner');"
        "return [b.textContent, b.className, b.hidden, b.getAttribute('role')]"
    )
    assert module(page, said, state) == ["Fault: It hung. Look at it.", "bad", False, "alert"]
    assert module(page, said, {**state, "fault": "", "phase": "running"})[2] is True


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
    line = json.dumps(state)
    module(page, push, line, 0, _FRAMES_AT_ONCE)  # 30 s: more than the page keeps
    before = _heap(page)
    for first in range(_FRAMES_AT_ONCE, round(_TIME_S / _FRAME_S), _FRAMES_AT_ONCE):
        module(page, push, line, first, _FRAMES_AT_ONCE)
    after = _heap(page)
    figure(f"heap of the page, {_TIME_S:g} s of states: {before:.1f} -> {after:.1f} MB")
    assert module(page, "return trace.trace.t.at(-1)") > _TIME_S - 1.0
    assert module(page, "return trace.trace.t.length") <= 600
    assert after - before < _HEAP_MB * _TIME_S / 3600.0
