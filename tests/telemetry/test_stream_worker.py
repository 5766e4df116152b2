"""A thread that may get stuck in Rerun without harm to other threads."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.telemetry.rerun import stream_worker as module
from dcmp_hil.telemetry.rerun.stream_worker import StreamWorker

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class Stream:
    """A recording stream that notes what is done with it, and can be full."""

    def __init__(self, *, full: bool = False) -> None:
        self.done: list[Any] = []
        self._full = full

    def flush(self, *, timeout_sec: float) -> None:
        if self._full:
            raise RuntimeError(f"Flush timed out after {timeout_sec} s")
        self.done.append("flushed")

    def disconnect(self) -> None:
        self.done.append("disconnected")


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    """Yield what a stuck job waits for; it is let go at the end."""
    event = threading.Event()
    yield event
    event.set()


def outlet(stream: Stream, *, patience: float = 10.0, ending: float = 10.0) -> StreamWorker:
    return StreamWorker(stream, patience, ending)  # type: ignore[arg-type]


def test_jobs_are_done_in_order_and_the_stream_is_ended() -> None:
    stream = Stream()
    way = outlet(stream)
    way.farewell = lambda: stream.done.append("farewell")
    for k in range(100):
        assert way.do(lambda s, k=k: s.done.append(k))  # type: ignore[misc]
    way.close(10.0)
    assert stream.done == [*range(100), "flushed", "farewell", "disconnected"]
    way.close(10.0)
    assert stream.done[-2:] == ["farewell", "disconnected"]


def test_a_stuck_job_is_noticed_and_close_returns(gate: threading.Event) -> None:
    stream = Stream()
    way = outlet(stream, patience=0.01, ending=0.05)
    way.do(lambda _: gate.wait())  # type: ignore[arg-type]
    answers = [way.do(lambda _: None) for _ in range(module._JOBS_MAX + 2)]  # noqa: SLF001
    assert answers[0]
    assert not answers[-1]
    way.close(10.0)
    assert stream.done == []


def test_a_stream_that_is_dropped_ends_with_the_job_at_hand(gate: threading.Event) -> None:
    """What waits could be megabytes, on a disk that is to keep room for the data."""
    stream, begun = Stream(), threading.Event()
    way = outlet(stream)

    def first(s: Any) -> None:
        begun.set()
        gate.wait()
        s.done.append("first")

    way.do(first)
    assert begun.wait(10.0)
    for k in range(5):
        way.do(lambda s, k=k: s.done.append(k))  # type: ignore[misc]
    way.drop()
    gate.set()
    way.close(10.0)
    assert stream.done == ["first", "flushed", "disconnected"]


def test_a_stream_that_cannot_be_flushed_is_left_as_it_is() -> None:
    stream = Stream(full=True)
    outlet(stream).close(10.0)
    assert stream.done == []


def test_a_file_that_does_not_grow_is_told_of_with_what_was_measured(
    gate: threading.Event, tmp_path: Path
) -> None:
    way = StreamWorker(Stream(), 1.0, 0.3, file=tmp_path / "run.rrd")  # type: ignore[arg-type]
    way.do(lambda _: gate.wait())  # type: ignore[arg-type]
    with pytest.raises(TimeoutError, match=r"it did not grow for \d+\.\d s"):
        way.close(60.0)


def test_a_file_that_cannot_grow_is_not_waited_for(
    gate: threading.Event, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_FULL_DISK_STALL_TIMEOUT_S", 0.1)
    monkeypatch.setattr(module, "room_for", lambda _: 0)
    way = StreamWorker(Stream(), 1.0, 60.0, file=tmp_path / "run.rrd")  # type: ignore[arg-type]
    way.do(lambda _: gate.wait())  # type: ignore[arg-type]
    with pytest.raises(TimeoutError, match=r"it did not grow for"):
        way.close(60.0)


def test_a_file_that_grows_slowly_is_waited_for(
    gate: threading.Event, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_FULL_DISK_STALL_TIMEOUT_S", 60.0)
    file = tmp_path / "run.rrd"

    def slowly(_: object) -> None:
        for _ in range(10):
            with file.open("ab") as growing:
                growing.write(b"x")
            gate.wait(0.05)

    way = StreamWorker(Stream(), 1.0, 60.0, file=file)  # type: ignore[arg-type]
    way.do(slowly)
    way.close(60.0)
    assert file.stat().st_size == 10


def test_what_a_job_raised_reaches_the_next_caller() -> None:
    way = outlet(Stream())
    way.do(lambda _: os.environ["NOT_THERE"])  # type: ignore[arg-type]
    with pytest.raises(KeyError):
        way.close(10.0)
    way.close(10.0)  # told once


_LAZY = """
import sys
from dcmp_hil.ipc import ring
from dcmp_hil.telemetry import block, recorder, run_plot, signals
sys.exit(bool({"rerun", "matplotlib"} & set(sys.modules)))
"""


def test_the_loop_s_side_of_telemetry_imports_neither_rerun_nor_matplotlib() -> None:
    assert subprocess.run([sys.executable, "-c", _LAZY], timeout=60, check=False).returncode == 0
