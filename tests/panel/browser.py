"""Debian's Chromium without a screen, driven through its own driver."""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from selenium.webdriver import Chrome

_PROGRAMS = ("chromium", "chromedriver")
_QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--force-device-scale-factor=1", "--hide-scrollbars", "--window-size=1280,800"),
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)


def needed() -> None:
    """Skip without a browser, saying how to get it; under CI that is a failure."""
    if all(shutil.which(program) for program in _PROGRAMS):
        return
    sentence = "no browser: apt-get install --no-install-recommends chromium chromium-driver"
    if os.environ.get("CI") == "true":
        pytest.fail(sentence)
    pytest.skip(sentence)


_DRAWS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
"""Instead of --disable-gpu: the web viewer draws through WebGL, here without a graphics card."""


@contextmanager
def browser(folder: Path, *, draws: bool = False) -> Iterator[Chrome]:
    """Start a browser whose settings, cache and history are in `folder`.

    Parameters
    ----------
    folder
        Empty at first.
    draws
        Whether pages need WebGL.
    """
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService

    options = ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    quiet = [*(word for word in _QUIET if word != "--disable-gpu"), *_DRAWS] if draws else _QUIET
    for argument in (*quiet, f"--user-data-dir={folder}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = Chrome(options, ChromeService(shutil.which("chromedriver")))
    try:
        driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": 1280, "height": 800, "deviceScaleFactor": 1, "mobile": False},
        )
        yield driver
    finally:
        driver.quit()
