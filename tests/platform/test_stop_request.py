"""Signals become a request; a second Ctrl-C is the way out of a stage that hangs."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from dcmp_hil.platform.stop_request import StopRequest

_ALL = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize("number", _ALL)
def test_stop_request_notes_the_signal_and_puts_the_handlers_back(number: signal.Signals) -> None:
    before = [signal.getsignal(each) for each in _ALL]
    with StopRequest() as stop:
        asked = [stop.requested]
        os.kill(os.getpid(), number)
        asked.append(stop.requested)
    assert asked == [False, True]
    assert stop.signal is number
    assert [signal.getsignal(each) for each in _ALL] == before


@pytest.mark.parametrize(
    ("number", "code"), [(None, 0), (signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_exit_code_is_that_of_the_signal_but_for_ctrl_c(number: signal.Signals | None, code: int) -> None:
    with StopRequest() as stop:
        if number is not None:
            os.kill(os.getpid(), number)
        assert stop.exit_code == code


def test_stop_request_keeps_the_first_signal() -> None:
    with StopRequest() as stop:
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGHUP)
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.signal is signal.SIGTERM


def test_stop_request_raises_when_ctrl_c_comes_twice() -> None:
    before = signal.getsignal(signal.SIGINT)
    stop = StopRequest()

    def twice() -> None:
        with stop:
            for _ in range(2):
                os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        twice()
    assert stop.requested
    assert signal.getsignal(signal.SIGINT) is before


def test_stop_request_puts_the_handlers_back_when_the_run_raises() -> None:
    before = [signal.getsignal(each) for each in _ALL]
    stop = StopRequest()

    def fails() -> None:
        with stop:
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fails()
    assert [signal.getsignal(each) for each in _ALL] == before


def test_stop_request_keeps_its_handlers_until_the_outermost_leaves() -> None:
    # The command line enters it before the session does, so that no signal falls in between.
    before = signal.getsignal(signal.SIGTERM)
    stop = StopRequest()
    with stop:
        with stop:
            inner = signal.getsignal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) == inner != before
        os.kill(os.getpid(), signal.SIGTERM)
    assert stop.signal is signal.SIGTERM
    assert signal.getsignal(signal.SIGTERM) == before


def test_stop_request_leaves_the_handlers_alone_outside_the_main_thread() -> None:
    before = [signal.getsignal(each) for each in _ALL]
    inside: list[object] = []

    def enter() -> None:
        with StopRequest() as stop:
            inside.extend(signal.getsignal(each) for each in _ALL)
            stop.requested = True

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join(10.0)
    assert inside == before


def test_second_interrupt_waits_where_files_are_written() -> None:
    with StopRequest() as stop:
        signal.raise_signal(signal.SIGINT)
        with stop.held():
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert stop.exit_code == 0
