"""The page as a browser shows it: sizes, boxes, axes, what is drawn, and the page's own modules."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.live.processes import until

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

_PHONE_PX = 915  # longer side of a phone's screen
PICTURES = Path("reports/pictures")
PLOTS = ("position", "error", "voltage", "disturbance", "lateness")

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

CHANGE_RGB, ALARM_RGB = (255, 160, 40), (240, 80, 80)
# Which plots have no mark of a colour at a time: in the margin above, where no data are drawn.
_UNMARKED = """
const [names, t, rgb] = given;
return names.filter((name) => {
  const { ctx, bbox, valToPos } = plots.plotOf(name);
  const { data } = ctx.getImageData(Math.round(valToPos(t, "x", true)) - 1, Math.round(bbox.top) - 12, 2, 3);
  return ![...data].every((value, k) => (k % 4 === 3 ? value > 200 : Math.abs(value - rgb[k % 4]) < 40));
});
"""
# How many pixels of a part of a plot are red, also over a line of the grid; places in the units of its axes.
_RED = """
const [name, t, level, above, width, height] = given;
const { ctx, bbox, valToPos } = plots.plotOf(name);
const x = t === null ? bbox.left : Math.floor(valToPos(t, "x", true));
const y = level === null ? bbox.top + bbox.height - above : valToPos(level, "y", true) - above;
const { data } = ctx.getImageData(x, Math.round(y), width ?? bbox.width, height);
let found = 0;
for (let k = 0; k < data.length; k += 4) {
  found += data[k] > 120 && data[k + 1] < 110 && data[k + 2] < 110 && data[k + 3] > 40;
}
return found;
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
    """Run a script with the page's own modules as `panel`, `plots`, `trace` and `marks`."""
    script = (
        "const done = arguments[arguments.length - 1]; const given = [...arguments].slice(0, -1);"
        "Promise.all(['panel', 'plots', 'trace', 'marks'].map((name) => import(`/${name}.js`)))"
        f".then(async ([panel, plots, trace, marks]) => {{ {body} }}).then(done, (e) => done(String(e)));"
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


def unmarked(page: Chrome, t: float, rgb: tuple[int, int, int]) -> list[str]:
    """Return the plots that have no mark of a colour at a time."""
    found: list[str] = module(page, _UNMARKED, PLOTS, t, rgb)
    return found


def check_marked(page: Chrome, t: float, rgb: tuple[int, int, int]) -> None:
    """Wait for a mark in every plot; there is none 3 s before it."""
    until(lambda: unmarked(page, t, rgb) == [], f"every plot had a mark at {t} s")
    assert unmarked(page, t - 3.0, rgb) == list(PLOTS)


def late_pixels(page: Chrome, t: float) -> int:
    """Count the red pixels at the foot of the lateness at a time."""
    return int(module(page, _RED, "lateness", t, None, 6, 1, 4))


def limit_pixels(page: Chrome, volts: float) -> int:
    """Count the red pixels along a level of the voltage."""
    return int(module(page, _RED, "voltage", None, volts, 1, None, 3))


def check_axes(page: Chrome) -> None:
    for plot in PLOTS:
        across, up = module(page, "return plots.ticksOf(given[0])", plot)
        assert across >= 3, plot
        assert up >= (2 if plot == "lateness" else 3), plot
