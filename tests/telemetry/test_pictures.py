"""The dashboard on screens of three sizes: what must be seen is on the pictures of its plots."""

from __future__ import annotations

import shutil
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from PIL import Image

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.telemetry.rerun.marks import MARKS
from dcmp_hil.telemetry.rerun.plots import Plot, plots
from tests.panel.browser import needed
from tests.telemetry.drawn_once import drawn_once
from tests.telemetry.pixels import near, pixels
from tools.pictures import CHANGED_AT_S, PUSHED_AT_S, SIZES, native, web
from tools.screenshot import Seen, save

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rerun.experimental import ViewerClient

pytestmark = pytest.mark.usefixtures("vulkan")
_PICTURES = Path("reports/pictures")
_SECOND_PIXELS_MIN = 65.0  # pixels: below that Rerun leaves labels out
_LABELS_MIN = 6  # of the 6.5 s of an axis
_NUMBERS_MIN = 3  # of a vertical axis
_TOP_ROWS, _LABEL_ROWS = 2, 16  # of the picture of a view, above and below the plot
_MARK_NEAR = 65  # of a channel: a line of 1.5 pixels that lies on two has three quarters of its colour
_MARK_SHARE = 0.6  # of a plot's height, which a mark crosses at least
_MARGIN_ROWS = 4  # below the words of the banner, dark
_COLUMN_EDGES = (0.17, 0.585, 1.0)  # of a page's width: the two columns of plots
_LINE_GREY = 53  # of the lines between views, around a plot and below its title
_PAGE_TITLE_ROWS, _PAGE_LABEL_ROWS = range(28, 31), range(15, 17)  # between two such lines, on a page
_DOT_PIXELS_MAX = 100  # of a legend's dot, with its rim: it has 44
_GREY_SPREAD_MAX = 20  # of the channels of a grey, which is the colour of letters, too


class Shown(NamedTuple):
    """Picture of one plot."""

    plot: Plot
    picture: Path

    def columns_of(self, colour: tuple[int, int, int]) -> list[int]:
        """Return the columns in which a colour crosses most of the plot."""
        found = near(self.picture, colour, _MARK_NEAR)[_TOP_ROWS:-_LABEL_ROWS]
        return [int(column) for column in np.flatnonzero(found.mean(axis=0) > _MARK_SHARE)]

    def behind(self, column: int, colour: tuple[int, int, int]) -> int:
        """Count the pixels of a line's colour on the right of a column."""
        return int(near(self.picture, colour)[_TOP_ROWS:-_LABEL_ROWS, column + 6 :].sum())

    @property
    def covered(self) -> list[str]:
        """Return the lines that are drawn on the right of the cursor, where the legend stands."""
        coloured = [one for one in self.plot.lines if max(one.colour) - min(one.colour) > _GREY_SPREAD_MAX]
        behind = self.cursor
        return [one.label for one in coloured if self.behind(behind, one.colour) >= _DOT_PIXELS_MAX]

    @property
    def columns(self) -> NDArray[np.float64]:
        """Return the brightness that half of each column's pixels have, shape (width,)."""
        rows = pixels(self.picture)[_TOP_ROWS:-_LABEL_ROWS]
        middle: NDArray[np.float64] = np.median(rows, axis=0).max(axis=-1)
        return middle

    @property
    def cursor(self) -> int:
        """Return the column of the time cursor, the last of the upright lines."""
        return int(np.flatnonzero((self.columns > 140) & (self.columns < 180))[-1])

    @property
    def time_labels(self) -> int:
        """Count the words below the plot: between two of them is more space than in one."""
        rows = pixels(self.picture)[-_LABEL_ROWS + 2 :].max(axis=-1)
        return _groups((rows > 100).any(axis=0), 12)

    @property
    def numbers(self) -> int:
        """Count the numbers on the left of the plot's frame."""
        (frame, *_) = np.flatnonzero(self.columns > 30)
        margin = pixels(self.picture)[: -_LABEL_ROWS + 4, :frame].max(axis=-1)
        return _groups((margin > 100).any(axis=1), 4)


def _groups(lit: NDArray[np.bool_], gap: int) -> int:
    """Count the stretches of a line that more than `gap` dark pixels part."""
    places = np.flatnonzero(lit).tolist()
    return bool(places) + sum(after - before > gap for before, after in pairwise(places))


class Screen(NamedTuple):
    """One state on one screen."""

    plots: list[Shown]
    banner: Path
    complaints: list[str]


def _draw_plots(viewer: ViewerClient, folder: Path, state: str) -> list[str]:
    """Save a picture of each plot of a state; return their titles."""
    titles = {plot.titled for plot in plots()}
    views = [view for view in viewer.get_state().views if view.visible and view.name in titles]
    for number, view in enumerate(views):
        save(viewer, folder / f"{state}-{number}.png", view.view_id)
    return [view.name for view in views]


def _draw(size: str, folder: Path) -> dict[str, dict[str, list[str]]]:
    """Draw both states on one screen; pictures of the whole are kept with the reports."""
    found = {}
    for state, picture, viewer in native(folder, size):
        _keep(picture)
        titles = _draw_plots(viewer, folder, state)
        (words,) = [view for view in viewer.get_state().views if view.name == "State"]
        save(viewer, folder / f"{state}-banner.png", words.view_id)
        seen = Seen(viewer.get_state(), viewer.get_logs())
        found[state] = {"titles": titles, "complaints": seen.complaints}
    return found


def _on_page(picture: Path, folder: Path) -> list[Shown]:
    """Return the plots of a page's picture, which has no views to ask for: the lines between them part it."""
    folder.mkdir()
    page = pixels(picture)
    width = page.shape[1]
    found: list[Shown] = []
    for (left, right), column in zip(pairwise(_COLUMN_EDGES), (plots()[:4], plots()[4:]), strict=True):
        across = slice(int(left * width) + 3, int(right * width) - 3)
        lines = np.flatnonzero(np.median(page[:, across].max(axis=-1), axis=1) == _LINE_GREY).tolist()
        tops = [row for above, row in pairwise(lines) if row - above in _PAGE_TITLE_ROWS]
        ends = [row for above, row in pairwise(lines) if row - above in _PAGE_LABEL_ROWS]
        assert len(tops) == len(ends) == len(column), (picture.name, lines)
        for plot, top, end in zip(column, tops, ends, strict=True):
            place = folder / f"{len(found)}.png"
            Image.fromarray(page[top + 1 : end, across].astype(np.uint8)).save(place)
            found.append(Shown(plot, place))
    return found


def _keep(picture: Path) -> None:
    """Keep a picture with the reports; two workers of a run may do so at once."""
    _PICTURES.mkdir(parents=True, exist_ok=True)
    with whole_file(_PICTURES / picture.name) as place:
        shutil.copyfile(picture, place)


@pytest.fixture(scope="module", params=SIZES)
def screens(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Screen]:
    """Return both states of a run on one screen."""
    folder, said = drawn_once(tmp_path_factory, request.param, partial(_draw, request.param))
    by_title = {plot.titled: plot for plot in plots()}
    return {
        state: Screen(
            [
                Shown(by_title[title], folder / f"{state}-{number}.png")
                for number, title in enumerate(of_state["titles"])
            ],
            folder / f"{state}-banner.png",
            of_state["complaints"],
        )
        for state, of_state in said.items()
    }


def test_the_viewer_complains_of_nothing_and_shows_every_plot(screens: dict[str, Screen]) -> None:
    wanted = {plot.titled for plot in plots()}
    for screen in screens.values():
        assert screen.complaints == []
        assert {shown.plot.titled for shown in screen.plots} == wanted


def test_every_second_has_its_label_and_every_axis_three_numbers(screens: dict[str, Screen]) -> None:
    for state, screen in screens.items():
        for shown in screen.plots:
            assert shown.time_labels >= _LABELS_MIN, (state, shown)
            assert shown.numbers >= _NUMBERS_MIN, (state, shown)


def test_the_change_is_a_mark_in_every_plot(screens: dict[str, Screen]) -> None:
    for state, screen in screens.items():
        for shown in screen.plots:
            assert shown.columns_of(MARKS["change"].colour), (state, shown)


def test_the_trip_is_a_mark_in_every_plot_with_the_warning_before_it(screens: dict[str, Screen]) -> None:
    for shown in screens["running"].plots:
        assert not shown.columns_of(MARKS["trip"].colour), shown
    for shown in screens["tripped"].plots:
        trip = shown.columns_of(MARKS["trip"].colour)
        assert trip, shown
        assert min(shown.columns_of(MARKS["warning"].colour)) < trip[0], shown
        (change, *_) = shown.columns_of(MARKS["change"].colour)
        assert (trip[0] - change) / (PUSHED_AT_S - CHANGED_AT_S) > _SECOND_PIXELS_MIN, shown


def test_the_legend_stands_where_no_data_are(screens: dict[str, Screen]) -> None:
    for state, screen in screens.items():
        for shown in screen.plots:
            assert shown.covered == [], (state, shown)


def test_no_word_of_a_trip_is_cut(screens: dict[str, Screen]) -> None:
    rows = pixels(screens["tripped"].banner).max(axis=-1)
    assert (rows > 150).any()
    assert rows[-_MARGIN_ROWS:].max() < 100


def test_the_web_viewer_shows_both_states_at_every_size(tmp_path: Path) -> None:
    """One browser draws all pictures: it takes longer to start than to draw one."""
    needed()
    for state, picture in web(tmp_path, *SIZES):
        _keep(picture)
        assert float(np.median(pixels(picture))) < 60.0  # it is dark
        for one in _on_page(picture, tmp_path / picture.stem):
            assert one.time_labels >= _LABELS_MIN, (picture.name, one)
            assert one.numbers >= _NUMBERS_MIN, (picture.name, one)
            assert one.covered == [], (picture.name, one)
            assert one.columns_of(MARKS["change"].colour), (picture.name, one)
            assert bool(one.columns_of(MARKS["trip"].colour)) == (state == "tripped"), (picture.name, one)
