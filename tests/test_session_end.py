"""The orderly end of a run: lowering, a request to stop, a signal."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import run, session
from dcmp_hil.errors import TripError
from tests.helpers import STEADY, HeldRun, T, bench
from tests.stages import texts_of

if TYPE_CHECKING:
    from types import FrameType

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event, Sample

_LINES_BEHIND_ZERO_MIN = 10


def test_run_lowers_the_arm_after_its_duration() -> None:
    duration = 0.25 + 3.0 * math.pi  # x_r = sin(3 pi / 2) = -1 rad
    held = HeldRun("run.end=lower", duration=duration)
    result = held.run()
    t, columns = result.columns["time_s"], result.columns
    assert t[-1] == pytest.approx(duration + 2.0, abs=4 * T)  # theory and rig.toml: a 2 s move
    end = int(np.flatnonzero(t >= duration - 0.5 * T)[0])
    assert columns["position_true_rad"][end] == pytest.approx(-1.0, abs=0.02)
    assert columns["position_true_rad"][-1] == pytest.approx(0.0, abs=3e-3)
    assert abs(columns["velocity_true_rad_s"][-1]) < 0.1
    assert np.abs(columns["tracking_error_mrad"][end:]).max() < 5.0
    assert "lowering the arm" in texts_of(result)
    assert not [event for event in result.events if event.level == "WARN"]
    assert not held.backend.live


@pytest.mark.parametrize("rate", [0.5, 2.0])  # rad/s
def test_run_lowers_without_a_kick_when_the_arm_moves_fastest(rate: float) -> None:
    # at the zero of the sine the arm has its full velocity, amplitude x rate
    duration = 0.25 + 2.0 * math.pi / rate * math.ceil(1.0 + rate)
    rig = bench("supervisor.probe=off", "run.end=lower", f"reference.rate_rad_s={rate}")
    result = run(rig, duration=duration, fast=True)
    t, volts = result.columns["time_s"], result.columns["voltage_sent_V"]
    down = t > duration
    assert np.abs(result.columns["velocity_reference_rad_s"][~down][-1]) == pytest.approx(rate, rel=0.01)
    # holding 1 rad takes (14.03 + 1.3 + 1.04)/5.4 = 3 V; 12 V x rate / 0.5 was the kick of a sudden stop
    assert np.abs(volts[down]).max() < 5.0
    assert np.abs(np.diff(volts[t > 3.0])).max() < 2.0  # no jump from one period to the next


@pytest.mark.parametrize("way", ["stop", "trip"])
def test_run_does_not_lower_when_it_did_not_end_normally(way: str) -> None:
    def end_it(n: int, sample: Sample) -> Sample:
        if n == 700 and way == "stop":
            held.session.stop.requested = True
        return sample._replace(fault=9) if n == 700 and way == "trip" else sample

    held = HeldRun("run.end=lower", duration=1.0, on_read=end_it)
    if way == "trip":
        with pytest.raises(TripError):
            held.run()
    else:
        held.run()
    assert held.reads == 701
    assert "lowering the arm" not in texts_of(held.session.result())
    assert not held.backend.live


def test_run_keeps_its_result_when_it_is_asked_to_stop() -> None:
    def ask(n: int, sample: Sample) -> Sample:
        held.session.stop.requested = n == 600
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=ask)
    result = held.run()
    assert result.summary.periods == 601
    assert result.columns["time_s"][-1] == pytest.approx(0.6)
    assert not held.backend.live
    assert texts_of(result)[-1] == "amplifier at 0 V"


def test_nothing_is_armed_where_the_end_was_asked_for_before() -> None:
    held = HeldRun(*STEADY, duration=1.0, on_read=lambda _, sample: sample)
    held.session.stop.requested = True
    result = held.run()
    assert (held.reads, result.summary.periods, held.backend.live) == (0, 0, False)
    assert texts_of(result)[-1] == "the device was not armed"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_run_ends_in_the_same_period_when_a_signal_comes(number: signal.Signals) -> None:
    assert threading.current_thread() is threading.main_thread()
    before = signal.getsignal(number)

    def kill(n: int, sample: Sample) -> Sample:
        if n == 100:
            os.kill(os.getpid(), number)
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=kill)
    result = held.run()
    assert held.reads == 101
    assert result.summary.periods == 101
    assert held.session.stop.signal is number
    assert not held.backend.live
    assert signal.getsignal(number) is before


class _Kept:
    """A sink that says whether it was closed."""

    def __init__(self) -> None:
        self.closed = False

    def block(self, block: Block) -> None:
        """Take nothing."""

    def event(self, event: Event) -> None:
        """Take nothing."""

    def close(self) -> None:
        """Say so."""
        self.closed = True


def _interrupted_at_zero(step: int) -> bool:
    """End a run by Ctrl-C, and press it again at a line behind 0 V; return whether there is such a line."""

    def first(n: int, sample: Sample) -> Sample:
        if n == 20:
            os.kill(os.getpid(), signal.SIGINT)
        return sample

    kept, left = _Kept(), step
    held = HeldRun(*STEADY, duration=30.0, on_read=first, sinks=[kept])

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal left
        if frame.f_code.co_filename != session.__file__:
            return None
        if event == "line" and held.reads > 20 and not held.backend.live:
            left -= 1
            if not left:
                os.kill(os.getpid(), signal.SIGINT)
        return trace

    handler, before = signal.getsignal(signal.SIGINT), sys.gettrace()
    sys.settrace(trace)
    try:
        with suppress(KeyboardInterrupt):
            held.run()
    finally:
        sys.settrace(before)
    assert signal.getsignal(signal.SIGINT) is handler
    assert kept.closed, step
    assert held.session.result().summary.periods == 21
    return left <= 0


def test_a_second_ctrl_c_behind_0_V_keeps_no_recording_open() -> None:
    step = 1
    while _interrupted_at_zero(step):
        step += 1
    assert step > _LINES_BEHIND_ZERO_MIN


def test_run_raises_at_once_when_ctrl_c_comes_twice() -> None:
    def kill(n: int, sample: Sample) -> Sample:
        for _ in range(2 if n == 100 else 0):
            os.kill(os.getpid(), signal.SIGINT)
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=kill)
    with pytest.raises(KeyboardInterrupt):
        held.run()
    assert not held.backend.live
    assert held.session.result().summary.periods == 100
