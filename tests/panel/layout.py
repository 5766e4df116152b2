"""The page's layout as a browser shows it: sizes, boxes, axes, and the page's own modules."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.live.processes import until

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

_PHONE_PX = 915  # longer side of a phone's screen
PICTURES = Path("reports/pictures")
_PLOTS = ("position", "error", "voltage", "disturbance", "lateness")

# What sticks out of its tile, by as little as a pixel.
CLIPPED = """
const names = ".number, .number *, header *, .deeds *, .knob, .knob *, #banner, figcaption";
return [...document.querySelectorAll(names)]
  .filter((e) => e.getClientRects().length && getComputedStyle(e).display !== "inline")
  .filter((e) => e.scrollWidth > e.clientWidth + 1
    || (e.closest(".number") && e.scrollHeight > e.clientHeight + 1))
  .map((e) => `${e.tagName} ${e.id} ${e.textContent}`)
"""
_OVERLAPPING = """
const names = ".number h2, .number b, .number p span, .number em, header > *";
const boxes = [...document.querySelectorAll(names)].filter((e) => e.getClientRects().length)
  .map((e) => [e.id || e.textContent, e.getBoundingClientRect()]);
return boxes.flatMap(([a, p], k) => boxes.slice(k + 1)
  .filter(([, q]) => p.left < q.right - 1 && q.left < p.right - 1)
  .filter(([, q]) => p.top < q.bottom - 3 && q.top < p.bottom - 3)
  .map(([b]) => [a, b]));
"""


def text(page: Chrome, name: str) -> str:
    return str(page.execute_script("return document.getElementById(arguments[0])?.textContent", name))


def resize(page: Chrome, width: int, height: int) -> None:
    """Give the page a size, and wait until its plots have it, too."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width <= _PHONE_PX}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    script = (
        "const boxes = [...document.querySelectorAll('.canvas')];"
        "return innerWidth === arguments[0] && innerHeight === arguments[1] && boxes.length === 5"
        " && boxes.every((box) => box.firstChild"
        " && Math.abs(box.clientWidth - box.firstChild.clientWidth) < 2"
        " && Math.abs(box.clientHeight - box.firstChild.clientHeight) < 2)"
    )
    until(lambda: page.execute_script(script, width, height), "the plots had the page's size")


def within(page: Chrome, name: str) -> bool:
    """Return whether all of an element is on the screen, and a click in its middle reaches it."""
    script = (
        "const e = document.getElementById(arguments[0]); const b = e.getBoundingClientRect();"
        "const hit = document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2);"
        "return b.top >= 0 && b.left >= 0 && b.right <= innerWidth && b.bottom <= innerHeight"
        " && b.height >= 40"
        " && (hit === e || e.contains(hit))"
    )
    return bool(page.execute_script(script, name))


def module(page: Chrome, body: str, *arguments: object) -> Any:
    """Run a script with the page's own modules as `panel`, `plots` and `trace`."""
    script = (
        "const done = arguments[arguments.length - 1]; const given = [...arguments].slice(0, -1);"
        "Promise.all(['panel', 'plots', 'trace'].map((name) => import(`/${name}.js`)))"
        f".then(async ([panel, plots, trace]) => {{ {body} }}).then(done, (e) => done(String(e)));"
    )
    return page.execute_async_script(script, *arguments)


def check_size(page: Chrome, width: int, height: int, name: str) -> None:
    resize(page, width, height)
    page.save_screenshot(str(PICTURES / f"panel-{name}-{width}x{height}.png"))
    assert page.execute_script("return document.documentElement.scrollWidth") <= width
    assert page.execute_script(CLIPPED) == []
    assert page.execute_script(_OVERLAPPING) == []
    check_axes(page)
    assert within(page, "stop")
    page.execute_script("scrollTo(0, document.documentElement.scrollHeight)")
    assert within(page, "stop")
    page.execute_script("scrollTo(0, 0)")


def check_axes(page: Chrome) -> None:
    for plot in _PLOTS:
        across, up = module(page, "return plots.ticksOf(given[0])", plot)
        assert across >= 3, plot
        assert up >= (2 if plot == "lateness" else 3), plot
