"""One motion as many loggers write it, and the figure that is right of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import pytest

from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay
from tests.offline.synthetic import Truth, swing

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

T = 0.002  # s
COUNTS_PER_REV = 4096
DEG_PER_RAD = math.degrees(1.0)
EPOCH_S = 1_767_225_600
TOLERANCE_RAD_S = 1e-4  # rad/s
HEADER = "time_s,position_rad,voltage_V"

Content = bytes | str | Sequence[str]


@cache
def motion() -> Truth:
    return swing(ticks=20, duration=3.0, counts=COUNTS_PER_REV)


@cache
def figure() -> float:
    truth = motion()
    settings = ReplaySettings(ku=5.4, counts_per_rev=COUNTS_PER_REV)
    return replay(truth.recording(), settings).figures.velocity_error_rms_rad_s


class Columns(NamedTuple):
    """The motion as text: time, position, voltage, a row each."""

    t: list[str]
    q: list[str]
    u: list[str]

    def lines(self, delimiter: str = ",", comma: bool = False) -> list[str]:
        rows = [delimiter.join(row) for row in zip(*self, strict=True)]
        return [row.replace(".", ",") for row in rows] if comma else rows


def columns(
    t: str | Callable[[float], str] = "{:.6f}",
    q: str | Callable[[float], str] = "{:.8f}",
    u: str | Callable[[float], str] = "{:.6f}",
) -> Columns:
    def write(form: str | Callable[[float], str], values: Iterable[float]) -> list[str]:
        return [form.format(value) if isinstance(form, str) else form(value) for value in values]

    truth = motion()
    return Columns(
        write(t, truth.time.tolist()), write(q, truth.position.tolist()), write(u, truth.voltage.tolist())
    )


def usual(*, end: str = "\n") -> str:
    return end.join([HEADER, *columns().lines()]) + end


def between(*texts: str, at: int = 500) -> list[str]:
    rows = columns().lines()
    return [HEADER, *rows[:at], *texts, *rows[at:]]


def with_cell(place: int, *cells: str) -> list[str]:
    """Put cells into one column of rows 500, 510, ..."""
    rows = [row.split(",") for row in columns().lines()]
    for k, cell in enumerate(cells):
        rows[500 + 10 * k][place] = cell
    return [HEADER, *map(",".join, rows)]


def clocked(form: Callable[[float], str], name: str = "timestamp") -> list[str]:
    return [f"{name},position_rad,voltage_V", *columns(t=form).lines()]


def iso(t: float, zone: str = "", sep: str = "T", digits: int = 6, start: float = 36672.0) -> str:
    """Write a time of 2026-03-02, from 10:11:12 on unless told otherwise."""
    day, second = divmod(start + t, 86400.0)
    hour, second = divmod(second, 3600.0)
    minute, second = divmod(second, 60.0)
    clock = f"{int(hour):02d}:{int(minute):02d}:{second:0{3 + digits}.{digits}f}"
    return f"2026-03-{2 + int(day):02d}{sep}{clock}{zone}"


def stamped(form: Callable[[int], str], name: str) -> list[str]:
    """Write the time of each row from its number."""
    return [f"{name},position_rad,voltage_V", *columns(t=lambda t: form(round(t / T))).lines()]


class Expect(NamedTuple):
    """What is right of a file, where it is not the usual."""

    near: float | None = None  # rad/s; then rows may be missing
    out: int | None = None  # rows left out
    restarts: int = 0
    note: str = ""


class Case(NamedTuple):
    content: Callable[[], Content]
    options: Mapping[str, object]
    expect: Expect


class Cases(dict[str, Case]):
    def add(
        self, name: str, content: Callable[[], Content], *, expect: Expect | None = None, **options: object
    ) -> None:
        self[name] = Case(content, options, expect or Expect())


def check(case: Case, folder: Path) -> None:
    """Write the file, read it, and compare the figure with the one of the motion itself."""
    made, expect = case.content(), case.expect
    text = made if isinstance(made, bytes | str) else "\n".join(made) + "\n"
    path = folder / "rec.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    recording = read_recording(path, ColumnOptions(**case.options))  # type: ignore[arg-type]
    result = replay(recording, ReplaySettings(ku=5.4, counts_per_rev=COUNTS_PER_REV))
    near = TOLERANCE_RAD_S if expect.near is None else expect.near
    assert result.figures.velocity_error_rms_rad_s == pytest.approx(figure(), abs=near)
    rows = len(motion().time)
    assert result.figures.rows_left_out == (
        result.figures.rows_left_out if expect.out is None else expect.out
    )
    assert result.figures.rows >= rows - 12
    if expect.near is None:
        assert result.figures.rows == rows
    assert result.figures.restarts == expect.restarts
    assert expect.note in " ".join(result.notes)
