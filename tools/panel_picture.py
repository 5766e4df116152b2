"""The panel as a browser shows it: a real run of 25 s, in which a gain is changed."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from unittest import mock

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.client import change, status
from tests.live.processes import started, until, until_running
from tests.panel.browser import browser
from tests.panel.layout import module, resize, text
from tests.panel.test_browser import address_of, free_port

_RUN = ("run", "bench-1khz", "--viewer", "none", "--no-record", "--duration", "0")
_CHANGED_AT_S, _SHOWN_AT_S = 20.4, 25.0
_LAST_TIME = "return trace.trace.t.at(-1) ?? 0"  # s, that the plots have
_TIMEOUT_S = 120.0  # s: generous, for a run in real time


def draw_panel(picture: Path, width: int = 1366, height: int = 768) -> None:
    """Save a picture of the panel.

    Parameters
    ----------
    picture
        The .png file.
    width, height
        Of the page, pixels.
    """
    with (
        tempfile.TemporaryDirectory(prefix="dcmp") as name,
        mock.patch.dict(os.environ, XDG_RUNTIME_DIR=name),
        started(Path(name), *_RUN) as run,
        started(Path(name), "panel", "--port", str(free_port())) as panel,
        browser(Path(name) / "chromium") as page,
    ):
        until_running(run)
        page.get(address_of(panel))
        until(lambda: text(page, "phase") == "running", "the page showed the run")
        resize(page, width, height)
        until(lambda: _time(run.pid) > _CHANGED_AT_S, "the change was due", _TIMEOUT_S)
        until(lambda: _is_changed(run.pid), "the change was made", _TIMEOUT_S)
        until(lambda: module(page, _LAST_TIME) > _SHOWN_AT_S, "the picture was due", _TIMEOUT_S)
        page.save_screenshot(str(picture))


def _time(run: int) -> float:
    """Return the time of a run, s; -1 where it is too busy to answer."""
    try:
        return float(status(run)["t_s"] or 0.0)
    except ConfigError:
        return -1.0


def _is_changed(run: int) -> bool:
    """Change a gain; return whether that was answered."""
    try:
        return bool(change(run, ["controller.kp_1_s2=5200"]))
    except ConfigError:
        return False
