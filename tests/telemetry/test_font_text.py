"""Text that the viewers' fonts lack: it is named, and ends no viewer."""

from __future__ import annotations

import ast
import dataclasses
import io
import mmap
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from fontTools.ttLib import TTFont  # type: ignore[import-untyped]
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.font_text import _MISSING, drawable, drawable_path, markdown
from dcmp_hil.telemetry.rerun.series import write_series
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.text_stream import _layout
from dcmp_hil.values import ChangeData, Event, EventKind
from tests.telemetry.runs import VIEW, blocks, chunks, read_back
from tools.screenshot import screenshot

if TYPE_CHECKING:
    from collections.abc import Iterator

_PACKAGE = Path(__file__).parents[2] / "dcmp_hil"
_FOREIGN = "弹簧 \U0001f680 \udcff\x1b"
_FOREIGN_RIG = dataclasses.replace(
    VIEW,
    name="弹簧",
    parameters=(("note", "\U0001f680"), ("observer.增益", "5.0")),
    about=(("computer", "机器"),),
    numbers={"observer.增益": 5.0},
)


def _fonts() -> Iterator[TTFont]:
    """Yield the fonts in the viewer's program."""
    with (
        window.viewer_binary().open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as program,
    ):
        for magic in (b"OTTO", b"\0\1\0\0\0"):
            place = program.find(magic)
            while place >= 0:
                (count,) = struct.unpack_from(">H", program, place + 4)
                tables = [
                    struct.unpack_from(">4s3I", program, place + 12 + 16 * k)
                    for k in range(count if count < 40 else 0)
                ]
                if b"cmap" in [tag for tag, *_ in tables]:
                    length = max(offset + size for _, _, offset, size in tables)
                    yield TTFont(io.BytesIO(program[place : place + length]))
                place = program.find(magic, place + 1)


def test_what_is_left_as_it_is_is_in_both_fonts_of_the_viewer() -> None:
    fonts = {str(font["name"].getDebugName(4)): set(font.getBestCmap()) for font in _fonts()}
    assert set(fonts) == {"Inter V", "JetBrains Mono Regular"}
    known = set.intersection(*fonts.values())
    drawn = {code for code in range(0x10000) if not _MISSING.match(chr(code))}
    assert drawn - known == {ord("\n"), ord("\t")}
    assert len(drawn) > 600


def test_words_of_this_project_and_of_europe_stay_as_they_are() -> None:
    for text in (
        *("plain ASCII [rad/s²] ± 5 µs → ≤ 3 ● ■ ▲ ← · \u2212", "Fußgängerübergänge, dziękuję, Příliš"),
        *("Ελληνικά ώμος", "Съешь ещё этих булок", "Tiếng Việt"),
    ):
        assert drawable(text) == text


def test_others_are_named_by_their_number() -> None:
    assert drawable("a 中文 \U0001f680!") == "a {U+4E2D U+6587} {U+1F680}!"
    assert drawable("e\u0301\r\n\x1b\udcff") == "é\n{U+001B U+DCFF}"
    assert drawable_path("params/observer/中文") == "params/observer/_4E2D_6587_"


def test_markdown_shows_a_text_as_it_is_and_in_one_line() -> None:
    assert markdown("kp_1_s2 4000 -> 4500, 8 % #1.") == "kp_1_s2 4000 -> 4500, 8 % #1."
    assert markdown("a|b `c` *d* [e] <f> &g; ~h~ $i$ \\ _j_") == (
        r"a\|b \`c\` \*d\* \[e\] \<f> \&g; \~h\~ \$i\$ \\ \_j\_"
    )
    assert markdown("No space left.\r\n\n  # 0 bytes\udcff") == "No space left. # 0 bytes{U+DCFF}"


@given(st.text(st.characters()))
def test_every_text_can_be_drawn_and_is_changed_once(text: str) -> None:
    drawn = drawable(text)
    assert not _MISSING.search(drawn)
    assert drawable(drawn) == drawn
    assert not _MISSING.search(drawable_path(text))


def test_no_module_makes_a_stream_of_another_kind() -> None:
    """The functions of Rerun's own that write to a stream, as well: they go round it."""
    writing = {
        "RecordingStream",
        "init",
        "log",
        "send_columns",
        "send_blueprint",
        "send_recording_name",
        "save",
    }
    found = []
    for file in sorted(_PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                called, owner = node.func.attr, ast.unparse(node.func.value)
                if owner in {"rr", "rerun"} and called in writing:
                    found.append(f"{file.name}: {owner}.{called}")
    assert found == []


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, list | dict):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _texts(one)


def _foreign_texts(path: Path) -> list[str]:
    """Return the texts and paths of a recording that a viewer cannot draw."""
    texts = [chunk.entity_path for chunk in chunks(path)]
    for chunk in chunks(path):
        batch = chunk.to_record_batch()
        texts += [text for column in batch.columns for text in _texts(column.to_pylist())]
    assert len(texts) >= 7
    return [text for text in texts if _MISSING.search(text)]


def _feed(sink: RerunSink) -> None:
    sink.event(Event(0.0, "INFO", EventKind.OTHER, _FOREIGN))
    for block in blocks(1000):
        sink.block(block)
    sink.event(Event(0.9, "INFO", EventKind.CHANGE, _FOREIGN, ChangeData({"observer.增益": 6.0})))
    sink.close()


def test_a_recording_has_no_text_that_a_viewer_cannot_draw(tmp_path: Path) -> None:
    _feed(RerunSink(_FOREIGN_RIG, tmp_path / "run.rrd", "none", "应用"))
    assert _foreign_texts(tmp_path / "run.rrd") == []
    assert "{U+5F39 U+7C27}" in str(read_back(tmp_path / "run.rrd", "params")["TextDocument:text"])
    assert "{U+DCFF U+001B}" in str(read_back(tmp_path / "run.rrd", "events/log")["TextLog:text"])
    assert read_back(tmp_path / "run.rrd", "params/observer/_589E_76CA_")["Scalars:scalars"] == [[5.0], [6.0]]


def test_plots_of_a_replay_neither(tmp_path: Path) -> None:
    t = np.arange(5.0)
    write_series(tmp_path / "弹.rrd", "应用", t, {"joint/弹_rad": {"弹簧": t, "estimate": t}})
    assert _foreign_texts(tmp_path / "弹.rrd") == []


def test_names_and_contents_of_views_are_drawn() -> None:
    view = rrb.TimeSeriesView(origin="joint/弹", contents=["/弹/**"], name="弹簧")
    layout = _layout(rrb.Blueprint(rrb.Tabs(view, name="\U0001f680")))
    assert layout.root_container.name == "{U+1F680}"
    assert (view.name, view.origin) == ("{U+5F39 U+7C27}", "joint/_5F39_")
    assert view.contents == ["/_5F39_/**"]


@pytest.mark.usefixtures("vulkan")
def test_a_chinese_name_and_an_emoji_end_no_viewer(tmp_path: Path) -> None:
    _feed(RerunSink(_FOREIGN_RIG, tmp_path / "run.rrd", "none", "应用"))
    seen = screenshot(tmp_path / "run.rrd", tmp_path / "run.png", at=0.5)
    assert seen.complaints == []
    assert seen.state.views
