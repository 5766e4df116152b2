"""The page as people use it: a slider is moved, STOP is pressed, in a real browser, on a real run."""

from __future__ import annotations

import json
import os
import signal
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.live.processes import TIMEOUT_S, command_process_of, own_folder, started, until, until_running
from tests.panel.browser import browser, needed

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator

    from selenium.webdriver import Chrome
    from selenium.webdriver.remote.webelement import WebElement

_RUN = ("run", "bench-1khz", "--viewer", "none", "--no-record", "--duration", "0")
_BOARD = ("--set", "backend.kind=sim-board")  # the firmware's own C
_REPORTS = Path("reports")
_NOT_KNOWN = "\N{EN DASH}"  # in the place of a number


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    needed()
    with own_folder(monkeypatch):
        yield


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


def address_of(panel: subprocess.Popen[str]) -> str:
    assert panel.stdout is not None
    line = panel.stdout.readline()
    assert line.startswith("open http://127.0.0.1:"), panel.communicate()
    return line.removeprefix("open ").strip()


def _by(page: Chrome, name: str) -> WebElement:
    return page.find_element("id", name)


def _text(page: Chrome, name: str) -> str:
    return str(page.execute_script("return document.getElementById(arguments[0])?.textContent", name))


def _slide(page: Chrome, key: str, to: float) -> None:
    """Move a slider to a part of its way, as a hand does."""
    page.execute_script(
        "const s = document.getElementById(arguments[0]);"
        "s.value = Number(s.min) + arguments[1] * (s.max - s.min);"
        "s.dispatchEvent(new Event('input', {bubbles: true}));",
        f"slider-{key}",
        to,
    )


def _type(page: Chrome, key: str, text: str) -> None:
    """Type over a number: all of it selected, for the page rewrites an input without focus."""
    control, a, tab = "\ue009", "a", "\ue004"
    _by(page, f"number-{key}").send_keys(control + a, "\ue000" + text + tab)


def _complaints(page: Chrome) -> list[dict[str, Any]]:
    log: list[dict[str, Any]] = page.get_log("browser")  # type: ignore[no-untyped-call]
    return [entry for entry in log if "favicon" not in entry["message"]]


def test_page_changes_a_run_shows_what_was_applied_and_stops_it(tmp_path: Path) -> None:
    figures = tmp_path / "figures.json"
    with (
        started(tmp_path, *_RUN, *_BOARD, "--json", str(figures)) as run,
        started(tmp_path, "panel", "--port", str(free_port())) as panel,
        browser(tmp_path / "chromium") as page,
    ):
        page.get(address_of(panel))
        until_running(run)
        until(lambda: _text(page, "phase") == "running", "the page showed the phase")
        assert "token" not in page.current_url
        assert _text(page, "applied-controller.kp_1_s2") == "4000"
        _slide(page, "controller.kp_1_s2", 0.8)
        until(lambda: _text(page, "applied-controller.kp_1_s2") != "4000", "the gain was read back")
        applied = _text(page, "applied-controller.kp_1_s2")
        until(lambda: "applied at" in _text(page, "log"), "the page said when")
        _type(page, "reference.amplitude_rad", "0.6")
        until(lambda: _text(page, "applied-reference.amplitude_rad") == "0.6", "the amplitude was read back")
        until(lambda: float(_text(page, "time").split()[0]) > 4.0, "a few seconds to look at")
        _keep_picture(page, "panel.png")
        _by(page, "stop").click()
        run.communicate(timeout=TIMEOUT_S)
        until(lambda: _text(page, "phase") == "run ended", "the page said that the run ended")
        until(lambda: "Amplifier at 0 V." in _text(page, "banner"), "the page said how")
        assert _text(page, "voltage") == "0.00"
        _keep_picture(page, "panel-ended.png")
        assert _complaints(page) == []
    document = json.loads(figures.read_text())
    assert run.returncode == 0
    assert document["ended_by"] == "STOP"
    assert [change.split(", applied")[0] for change in document["changes"]] == [
        f"controller.kp_1_s2: 4000 -> {applied}",
        "reference.amplitude_rad: 1 -> 0.6",
    ]


def test_page_finds_the_next_run_and_escape_stops_it(tmp_path: Path) -> None:
    with (
        started(tmp_path, "panel", "--port", str(free_port())) as panel,
        browser(tmp_path / "chromium") as page,
    ):
        page.get(address_of(panel))
        until(lambda: _text(page, "phase") == "no run", "the page said that there is none")
        for _ in range(2):
            with started(tmp_path, *_RUN) as run:
                until_running(run)
                until(lambda: _text(page, "process") == f"process {run.pid}", "the page found the run")
                until(lambda: _text(page, "phase") == "running", "the page showed the phase")
                control = command_process_of(run.pid)
                os.kill(control, signal.SIGSTOP)
                until(lambda: _text(page, "phase") == "no answer", "the page said that the run is silent")
                assert _text(page, "voltage") == _NOT_KNOWN  # and not the voltage of before
                os.kill(control, signal.SIGCONT)
                until(lambda: _text(page, "phase") == "running", "the page heard of the run again")
                until(lambda: _text(page, "voltage") != _NOT_KNOWN, "the voltage came back")
                page.find_element("tag name", "body").send_keys("\ue00c")  # Escape
                run.communicate(timeout=TIMEOUT_S)
                assert run.returncode == 0
            until(lambda: _text(page, "phase") == "run ended", "the page said that the run ended")


def test_page_says_why_a_change_was_refused_and_stops_a_run_whose_command_process_is_gone(
    tmp_path: Path,
) -> None:
    with (
        started(tmp_path, *_RUN) as run,
        started(tmp_path, "panel", "--port", str(free_port())) as panel,
        browser(tmp_path / "chromium") as page,
    ):
        page.get(address_of(panel))
        until_running(run)
        until(lambda: _text(page, "phase") == "running", "the page showed the phase")
        _type(page, "observer.mu0_rad_s", "5000")
        until(lambda: "too fast for loop.rate_hz" in _text(page, "log"), "the page said why")
        assert _text(page, "applied-observer.mu0_rad_s") == "40"
        os.kill(command_process_of(run.pid), signal.SIGKILL)
        until(lambda: _text(page, "phase") == "not seen", "the page said that it has lost the run")
        assert "it may go on" in _text(page, "banner")
        assert run.poll() is None
        _by(page, "stop").click()
        run.communicate(timeout=TIMEOUT_S)
        assert run.returncode == 0
        until(lambda: "Amplifier at 0 V." in _text(page, "banner"), "the page said how the run ended")
        assert (_text(page, "phase"), _text(page, "voltage")) == ("run ended", "0.00")


def _keep_picture(page: Chrome, name: str) -> None:
    """Keep what the page looks like, and see that it fits one screen."""
    _REPORTS.mkdir(exist_ok=True)
    page.save_screenshot(str(_REPORTS / name))
    height, width = page.execute_script(
        "return [document.documentElement.scrollHeight, document.documentElement.scrollWidth]"
    )
    assert height <= 800
    assert width <= 1280
