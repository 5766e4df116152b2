"""The web viewer in the panel's frame, in a real browser: it draws, and the page around it works."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.signals import ERROR_RGB, VOLTAGE_RGB
from tests.live.processes import own_folder, started, until, until_running
from tests.panel.browser import browser, needed
from tests.panel.test_browser import address_of, free_port

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray
    from selenium.webdriver import Chrome

_REPORTS = Path("reports")
_FIRST_PORT = 22_000  # of the ports; no other test serves there
_RUN = ("run", "bench-1khz", "--viewer", "serve", "--no-record", "--duration", "0")


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    needed()
    with own_folder(monkeypatch):
        yield


def _pixels(page: Chrome) -> NDArray[np.int16]:
    """Return what is in the frame, shape (height, width, 3)."""
    picture = page.find_element("id", "viewer").screenshot_as_png
    with Image.open(io.BytesIO(picture)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int16)


def _coloured(page: Chrome, colour: tuple[int, int, int]) -> int:
    """Count the pixels of about that colour in the frame."""
    return int((np.abs(_pixels(page) - np.array(colour)).max(axis=-1) < 24).sum())


def _is_dark(page: Chrome) -> bool:
    assert page.execute_script("return matchMedia('(prefers-color-scheme: light)').matches")
    return float(np.median(_pixels(page))) < 60.0


def test_the_dashboard_is_drawn_in_the_panel(tmp_path: Path) -> None:
    with (
        started(tmp_path, *_RUN, first=_FIRST_PORT) as run,
        browser(tmp_path / "chromium", draws=True) as page,
    ):
        until_running(run)
        until(lambda: window.served(_FIRST_PORT), "the run was served")
        with started(tmp_path, "panel", "--web", "--port", str(free_port()), first=_FIRST_PORT) as panel:
            page.get(address_of(panel))
            until(lambda: _coloured(page, VOLTAGE_RGB) > 50, "the voltage was drawn")
            until(lambda: _coloured(page, ERROR_RGB) > 50, "the tracking error was drawn")
            assert _is_dark(page)  # in a browser that is set to light
            _REPORTS.mkdir(exist_ok=True)
            page.save_screenshot(str(_REPORTS / "panel-web.png"))
            page.find_element("id", "stop").click()
            run.communicate(timeout=30.0)
    assert run.returncode == 0
