"""Real time: everything is tried, reported, and given back, granted or not.

What the machine of the tests grants is not known, so the system's own calls are recorded and answered here.
"""

from __future__ import annotations

import gc
import os
import resource
import signal
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config.sections import TimingSection
from dcmp_hil.errors import DeadlineError
from dcmp_hil.platform import realtime
from dcmp_hil.platform.realtime import RealTime
from dcmp_hil.session import Session
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def _eperm() -> PermissionError:
    return PermissionError(1, "Operation not permitted")


class _System:
    """Answers the calls, and notes them; those named in `refused` fail."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.refused: set[str] = set()

    def fake(self, name: str, answer: Any = None) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            self.calls.append((name, *arguments))
            if name in self.refused or (name == "libc" and arguments[0] in self.refused):
                raise _eperm()
            return answer

        return call

    def priorities(self) -> dict[int, list[tuple[int, int]]]:
        """Return what each thread was set to: policy and priority, in order."""
        found: dict[int, list[tuple[int, int]]] = {}
        for name, *arguments in self.calls:
            if name == "set":
                thread, policy, parameter = arguments
                found.setdefault(thread, []).append((policy, parameter.sched_priority))
        return found


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> _System:
    fake = _System()
    monkeypatch.setattr(os, "sched_setscheduler", fake.fake("set"))
    monkeypatch.setattr(os, "sched_getscheduler", fake.fake("get", os.SCHED_OTHER))
    monkeypatch.setattr(os, "sched_getparam", fake.fake("param", os.sched_param(0)))
    monkeypatch.setattr(os, "sched_getaffinity", fake.fake("affinity", {0, 1, 2, 3}))
    monkeypatch.setattr(os, "sched_setaffinity", fake.fake("pin"))
    monkeypatch.setattr(realtime, "_call_libc", fake.fake("libc"))
    monkeypatch.setattr(realtime, "privileges", lambda: {"cap_ipc_lock": False, "memlock_limit": "unlimited"})
    return fake


@pytest.fixture
def helper() -> Iterator[int]:
    """Start a thread that only waits; yield its number."""
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    assert thread.native_id is not None
    yield thread.native_id
    done.set()
    thread.join()


def _state() -> tuple[Any, ...]:
    gc.collect()  # in Python 3.12 this freezes immortal objects too
    return (
        gc.isenabled(), gc.get_freeze_count(), sys.getswitchinterval(),
        signal.getsignal(signal.SIGXCPU), resource.getrlimit(resource.RLIMIT_RTTIME),
    )  # fmt: skip


def test_realtime_takes_all_of_it_and_gives_it_back(system: _System, helper: int) -> None:
    before, mine = _state(), threading.get_native_id()
    with RealTime(TimingSection(priority=70, cpu=2, switch_interval_us=250)) as taken:
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
        assert sys.getswitchinterval() == pytest.approx(250e-6)
        assert resource.getrlimit(resource.RLIMIT_RTTIME)[0] == 80_000
        fifo = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        assert system.priorities()[mine] == [(fifo, 70)]
        assert system.priorities()[helper] == [(fifo, 1)]  # below the loop, above every normal program
        assert ("pin", 0, {2}) in system.calls
        assert ("libc", "mlockall", 7) in system.calls
    assert _state() == before
    assert system.priorities()[mine][-1] == system.priorities()[helper][-1] == (os.SCHED_OTHER, 0)
    assert ("pin", 0, {0, 1, 2, 3}) in system.calls
    assert ("libc", "munlockall") in system.calls
    assert [grant.what for grant in taken.grants] == [
        "collector off", "switch interval", "timer slack", "locked memory", "CPU 2", "SCHED_FIFO",
    ]  # fmt: skip
    assert all(grant.granted for grant in taken.grants)


def test_realtime_does_nothing_when_it_is_off(system: _System) -> None:
    before = _state()
    with RealTime(TimingSection(realtime="off")) as taken:
        assert _state() == before
    assert system.calls == []
    assert taken.grants == []


@pytest.mark.parametrize(
    ("refused", "what", "remedy"),
    [
        ("set", "SCHED_FIFO", "rtprio 98"),
        ("mlockall", "locked memory", "memlock unlimited"),
        ("pin", "CPU 3", "timing.cpu"),
    ],
)
def test_realtime_goes_on_or_refuses_when_something_is_not_granted(
    system: _System, refused: str, what: str, remedy: str
) -> None:
    system.refused = {refused}
    before = _state()
    with RealTime(TimingSection(cpu=3)) as taken:
        pass
    (grant,) = [grant for grant in taken.grants if not grant.granted]
    assert grant.what == what
    assert grant.refusal.startswith("Operation not permitted. ")
    assert remedy in grant.refusal
    with (
        pytest.raises(DeadlineError, match=what) as caught,
        RealTime(TimingSection(cpu=3, realtime="enforce")),
    ):
        pytest.fail("it must not start")
    assert remedy in str(caught.value)
    assert caught.value.exit_code == 5
    assert _state() == before


def test_realtime_is_enforced_without_what_does_not_matter(system: _System) -> None:
    system.refused = {"prctl"}
    with RealTime(TimingSection(realtime="enforce")) as taken:
        pass
    assert [grant.what for grant in taken.grants if not grant.granted] == ["timer slack"]


def test_realtime_locks_nothing_in_advance_when_memory_is_limited(
    system: _System, monkeypatch: pytest.MonkeyPatch
) -> None:
    limited = {"cap_ipc_lock": False, "memlock_limit": 1 << 33}
    monkeypatch.setattr(realtime, "privileges", lambda: limited)
    with RealTime(TimingSection()):
        assert ("libc", "mlockall", 5) in system.calls


def test_realtime_steps_down_when_a_thread_does_not_sleep(system: _System, helper: int) -> None:
    with RealTime(TimingSection()) as taken:
        os.kill(os.getpid(), signal.SIGXCPU)
        for thread in (threading.get_native_id(), helper):
            assert system.priorities()[thread][-1] == (os.SCHED_OTHER, 0)
    assert "lower loop.rate_hz" in taken.grants[-1].refusal


def test_realtime_gives_back_without_privileges_what_a_child_would_not_have(
    system: _System, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Without CAP_SYS_NICE the kernel refuses to take SCHED_RESET_ON_FORK away again.
    def set_it(thread: int, policy: int, parameter: os.sched_param) -> None:
        system.calls.append(("set", thread, policy, parameter))
        if not policy & os.SCHED_RESET_ON_FORK:
            raise _eperm()

    monkeypatch.setattr(os, "sched_setscheduler", set_it)
    with RealTime(TimingSection()):
        pass
    kept = os.SCHED_OTHER | os.SCHED_RESET_ON_FORK
    assert system.priorities()[threading.get_native_id()][-1] == (kept, 0)


def test_realtime_asks_for_no_signal_outside_the_main_thread(system: _System) -> None:
    before, found = _state(), []

    def enter() -> None:
        with RealTime(TimingSection()) as taken:
            found.append((_state()[3:], taken.grants))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert system.calls
    assert found[0][0] == before[3:]
    assert _state() == before


def test_libc_says_why_it_refuses() -> None:
    with pytest.raises(OSError, match="Invalid argument"):
        realtime._call_libc("mlockall", 1 << 20)  # noqa: SLF001 - the one door to the C library


def test_run_on_the_walls_clock_reports_what_was_granted(system: _System) -> None:
    system.refused = {"set"}
    session = Session(bench(), duration=0.02)
    session.run()
    result = session.result()
    assert {grant.what: grant.granted for grant in result.grants}["SCHED_FIFO"] is False
    assert any(event.text.startswith("SCHED_FIFO: Operation not permitted") for event in result.events)
    assert any("preemption" in event.text for event in result.events)
    assert result.host["cpus"] == 4


def test_run_refuses_to_start_when_enforced_and_not_granted(system: _System) -> None:
    system.refused = {"set"}
    session = Session(bench("timing.realtime=enforce"), duration=1.0)
    with pytest.raises(DeadlineError, match="rtprio"):
        session.run()
    assert session.result().summary.periods == 0


def test_run_asks_for_nothing_in_virtual_time(system: _System) -> None:
    session = Session(bench("timing.realtime=enforce"), duration=0.1, fast=True)
    session.run()
    assert session.result().grants == ()
    assert {name for name, *_ in system.calls} == {"affinity"}  # the facts of the host
