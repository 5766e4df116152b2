"""The recorder: everything in order, a sink that raises or hangs harms no other."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.telemetry import recorder as module
from dcmp_hil.telemetry.block import ReferenceAligner
from dcmp_hil.telemetry.recorder import Recorder
from dcmp_hil.values import UNKNOWN_TRUTH, Event, EventKind, Reference
from tests.helpers import cycle

if TYPE_CHECKING:
    from dcmp_hil.telemetry.block import Block

_T = 1e-3  # s


class _Sink:
    def __init__(self) -> None:
        self.t: list[float] = []
        self.events: list[Event] = []
        self.order: list[str] = []
        self.closed = 0

    def block(self, block: Block) -> None:
        self.t += block["t"].tolist()
        self.order.append("block")

    def event(self, event: Event) -> None:
        self.events.append(event)
        self.order.append(event.text)

    def close(self) -> None:
        self.closed += 1


class _Raises(_Sink):
    """Gives up at the named call."""

    def __init__(self, at: str) -> None:
        super().__init__()
        self._at = at

    def block(self, block: Block) -> None:
        if self._at == "block":
            raise OSError("disk full")
        super().block(block)

    def event(self, event: Event) -> None:
        if self._at == "event":
            raise ValueError("no such channel")
        super().event(event)

    def close(self) -> None:
        if self._at == "close":
            raise RuntimeError("cannot finish")
        super().close()


class _Hangs(_Sink):
    """Does not come back from its first block until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.inside, self.let_go = threading.Event(), threading.Event()

    def block(self, block: Block) -> None:
        self.inside.set()
        self.let_go.wait(60.0)
        super().block(block)


def _recorder(*sinks: _Sink, in_line: bool = True, recent: int = 100) -> Recorder:
    aligner = ReferenceAligner(lambda _: Reference(0.0, 0.0, 0.0), 0.0)
    return Recorder(lambda: UNKNOWN_TRUTH, aligner, sinks, recent=recent, in_line=in_line)


def _record(recorder: Recorder, n: int, start: int = 0) -> None:
    for k in range(start, start + n):
        recorder.record(cycle(k * _T))


@pytest.mark.parametrize("in_line", [True, False])
def test_recorder_delivers_everything_in_order(in_line: bool) -> None:
    sink, other = _Sink(), _Sink()
    recorder = _recorder(sink, other, in_line=in_line)
    for part in range(10):
        recorder.event(Event(float(part), "INFO", EventKind.OTHER, f"part {part}"))
        _record(recorder, 1000, 1000 * part)
    recorder.close()
    for each in (sink, other):
        assert each.t == [k * _T for k in range(10_000)]
        assert [event.t for event in each.events] == [float(part) for part in range(10)]
        assert each.closed == 1
    assert recorder.dropped == 0


def test_recorder_keeps_the_last_cycles_only() -> None:
    recorder = _recorder(recent=100)
    _record(recorder, 1234)
    assert [each.sample.t for each in recorder.recent] == [k * _T for k in range(1134, 1234)]


@pytest.mark.parametrize("at", ["block", "event", "close"])
@pytest.mark.parametrize("in_line", [True, False])
def test_recorder_drops_a_sink_that_raises_and_tells_the_others(in_line: bool, at: str) -> None:
    sink = _Sink()
    recorder = _recorder(sink, _Raises(at), in_line=in_line)  # a session's own sinks come first
    recorder.event(Event(0.0, "INFO", EventKind.OTHER, "begun"))
    _record(recorder, 5000)
    recorder.close()
    assert len(sink.t) == 5000
    assert sink.closed == 1
    told = [event.text for event in sink.events if event.level == "WARN"]
    assert len(told) == 1
    assert "_Raises" in told[0]


def test_recorder_outlives_every_sink_that_raises() -> None:
    sinks = [_Raises(at) for at in ("block", "close", "event", "close", "block")]
    recorder = _recorder(*sinks)
    recorder.event(Event(0.0, "INFO", EventKind.OTHER, "begun"))
    _record(recorder, 5000)
    recorder.close()
    assert len(recorder.recent) == 100


def test_recorder_does_not_wait_for_a_sink_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_END_TIMEOUT_S", 0.05)  # s, instead of 2
    stuck = _Hangs()
    recorder = _recorder(stuck, in_line=False)
    _record(recorder, 10)
    assert stuck.inside.wait(30.0)
    _record(recorder, 100, 10)  # no wait for the sink here either
    recorder.close()
    assert not stuck.let_go.is_set()  # close() came back although the sink did not
    assert stuck.closed == 0
    stuck.let_go.set()


def test_recorder_counts_what_a_hanging_sink_kept_from_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    # What session.Result promises: periods lost because a sink was slow are counted, and in no figure.
    monkeypatch.setattr(module, "_END_TIMEOUT_S", 0.05)
    sink, stuck = _Sink(), _Hangs()
    recorder = _recorder(sink, stuck, in_line=False)
    _record(recorder, 10)
    assert stuck.inside.wait(30.0)
    seen = len(sink.t)
    _record(recorder, 110 - seen, seen)
    recorder.close()
    assert len(sink.t) == seen
    total, dropped = 10 + 110 - seen, recorder.dropped
    stuck.let_go.set()
    assert seen + dropped == total


def test_recorder_overwrites_the_oldest_and_counts_when_not_drained(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_CAPACITY_ROWS", 64)
    sink, stuck = _Sink(), _Hangs()
    recorder = _recorder(stuck, sink, in_line=False)
    _record(recorder, 1)
    assert stuck.inside.wait(30.0)
    _record(recorder, 1000, 1)
    stuck.let_go.set()
    recorder.close()
    assert sink.t[-1] == pytest.approx(1000 * _T)
    assert len(sink.t) + recorder.dropped == 1001
    assert len(sink.t) <= 1 + 64
