"""The status line by the width of the terminal: what is left out first, and what never is."""

from __future__ import annotations

import fcntl
import math
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from rich.cells import cell_len
from rich.console import Console

from dcmp_hil.cli.status_line import Field, StatusLine, fitted
from dcmp_hil.values import Event, EventKind, PhaseData
from tests.installed import environment
from tests.telemetry.runs import T, blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

NAMES = re.compile(r"running|pos(?:ition)?|err(?:or)?|voltage|\bu\b|\bw\b|late\b|lateness|[\d.]+ s\b")
RUNNING = Event(0.0, "INFO", EventKind.PHASE, "it runs", PhaseData("running"))
WITHOUT_UNIT = 40
TIMEOUT_S = 120.0


def line_on(columns: int) -> str:
    """Return the status line of a run on a terminal of so many columns."""
    console = Console(width=columns, force_terminal=True, color_system=None)
    line = StatusLine(console, T)
    line.event(RUNNING)
    with console.capture() as shown:
        for block in blocks(300):  # every 97th period is 700 us late
            line.block(block)
        line.close()
    drawn = [re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]", "", text).strip("\r") for text in shown.get().split("\n")]
    return [text for text in drawn if "err" in text][-1].rsplit("\r", maxsplit=1)[-1]


@pytest.mark.parametrize("columns", [200, 120, 100, 80, 60, 40])
def test_error_disturbance_and_late_periods_are_on_every_line(columns: int) -> None:
    line = line_on(columns)
    assert cell_len(line) <= columns
    unit = r"" if columns == WITHOUT_UNIT else " mrad"
    assert re.search(rf"\berr(or)? +[+-]\d+\.\d\d{unit}  ", line), line
    assert re.search(rf"\bw +[+-]\d+\.\d\d{unit and ' rad/s²'}  ", line), line
    assert re.search(r"\blate 3\b", line), line


@pytest.mark.parametrize(
    ("columns", "fields"),
    [
        (200, ["0.30 s", "running", "position", "error", "voltage", "w", "late", "lateness"]),
        (120, ["0.30 s", "running", "position", "error", "voltage", "w", "late"]),
        (100, ["0.30 s", "running", "pos", "err", "u", "w", "late"]),
        (80, ["0.30 s", "running", "err", "u", "w", "late"]),
        (60, ["0.30 s", "err", "w", "late"]),
        (40, ["err", "w", "late"]),
        (20, ["err", "w"]),
    ],
)
def test_the_least_important_field_is_left_out_first(columns: int, fields: list[str]) -> None:
    line = line_on(columns)
    assert NAMES.findall(line) == fields, line


def test_no_width_hides_what_a_narrower_one_shows() -> None:
    def names(columns: int) -> set[str]:
        long = {"pos": "position", "err": "error", "u": "voltage"}
        return {long.get(name, name) for name in NAMES.findall(line_on(columns))}

    shown = [names(columns) for columns in range(34, 160, 7)]
    assert all(narrow <= wide for narrow, wide in pairwise(shown))


def test_an_error_before_the_trajectory_is_a_dash() -> None:
    console = Console(width=80, force_terminal=True, color_system=None)
    line = StatusLine(console, T)
    with console.capture() as shown:
        for block in blocks(20):
            block["began"][:] = math.inf
            line.block(block)
    assert "err       - mrad" in shown.get()
    assert "nan" not in shown.get()


def test_wide_characters_are_counted_by_columns() -> None:
    fields = (Field(0, "慢慢慢 1", "慢 1", "慢"), Field(1, "ab", "ab"))
    assert fitted(fields, 12) == "慢慢慢 1  ab"
    assert fitted(fields, 11) == "慢 1  ab"
    assert fitted(fields, 8) == "慢 1  ab"
    assert fitted(fields, 7) == "慢 1"
    assert fitted(fields, 3) == "慢"


@pytest.fixture
def terminal() -> Iterator[tuple[int, int, Callable[[int], None]]]:
    """Yield the end of a pseudo terminal that is read, the end of programs, and what sets its width."""
    ours, theirs = pty.openpty()

    def resize(columns: int) -> None:
        fcntl.ioctl(ours, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

    yield ours, theirs, resize
    os.close(ours)
    os.close(theirs)


def test_a_resize_during_a_run_changes_the_next_line(
    terminal: tuple[int, int, Callable[[int], None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, theirs, resize = terminal
    monkeypatch.setenv("TERM", "xterm")
    with os.fdopen(os.dup(theirs), "w") as file:
        console = Console(file=file, force_terminal=True, color_system=None)
        line = StatusLine(console, T)
        widths = [200, 80, 40, 120]
        for columns, block in zip(widths, blocks(400), strict=False):
            resize(columns)
            with console.capture() as shown:
                line.block(block)
            (drawn,) = re.findall(r"[^\x1b\r\n]*\blate \d+[^\x1b\r\n]*", shown.get())
            assert cell_len(drawn) <= columns
            assert ("lateness" in drawn, " mrad" in drawn) == (columns == 200, columns > 40)
        line.close()


def test_a_run_follows_the_terminal_of_its_standard_error(
    installed: Path, terminal: tuple[int, int, Callable[[int], None]], tmp_path: Path
) -> None:
    """Its other streams are no terminal, and the line is drawn by another process of the run."""
    ours, theirs, resize = terminal
    resize(120)
    command = (*("run", "--duration", "0", "--no-record"), *("--viewer", "none", "--no-control"))
    with subprocess.Popen(
        [installed, *command, "--set", "supervisor.monitors=finite"],
        cwd=tmp_path,
        env=environment(TERM="xterm", COLUMNS=None),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
    ) as process:
        try:
            _drawn(ours, lambda line: 80 < len(line) <= 120 and "position" in line)
            resize(60)
            _drawn(ours, lambda line: len(line) <= 60 and " mrad  w " in line)
            process.send_signal(signal.SIGINT)
            end = time.monotonic() + TIMEOUT_S
            while process.poll() is None and time.monotonic() < end:
                _lines(ours)
        finally:
            process.kill()
    assert process.returncode == 0


def _drawn(terminal: int, wanted: Callable[[str], bool]) -> None:
    """Wait for a status line like that."""
    end = time.monotonic() + TIMEOUT_S
    while not any(re.search(r"late \d", line) and wanted(line) for line in _lines(terminal)):
        assert time.monotonic() < end


def _lines(terminal: int) -> list[str]:
    """Return what was written in the last moments: each time a line is drawn, it is written whole."""
    if not select.select([terminal], [], [], 0.2)[0]:
        return []
    shown = os.read(terminal, 65536).decode("utf-8", "replace")
    return re.split(r"[\r\n]+", re.sub(r"\x1b\[[?\d;]*[a-zA-Z]", "", shown))
