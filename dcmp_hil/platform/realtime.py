"""Real time: what a paced run asks of the operating system, each thing tried, reported, and undone.

Why none of it can lock the machine or starve telemetry: the loop sleeps until its next tick, and gives up CPU
and interpreter lock with that. Should a late loop not get to sleep for 80 ms, RLIMIT_RTTIME brings SIGXCPU
and every thread goes back to normal; should Python not get to run that handler, the kernel keeps 5 % of each
second for all other processes. Telemetry is a process of its own, and children start as normal processes; a
thread of ours runs below the loop, and gets the interpreter lock within the switch interval.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, Self

from dcmp_hil.errors import DeadlineError
from dcmp_hil.platform.host_info import privileges

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType, TracebackType


_HELPER_PRIORITY = 1  # the lowest real-time priority
_RUN_WITHOUT_SLEEP_MAX_US = 80_000
"""Microseconds that a real-time thread may run without a sleep; a helper may wake it every 100 ms."""
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4  # mlockall
_PR_SET_TIMERSLACK = 29  # prctl: PR_SET_TIMERSLACK
_USUAL_SLACK_NS = 0  # ns; 0 means: as the process began

_LIMITS_REMEDY = (
    "put a line `YOU - {limit}`, YOU being your user name, into /etc/security/limits.conf and log in again"
)
_RTPRIO_REMEDY = f"To allow it, {_LIMITS_REMEDY.format(limit='rtprio 98')}"
_MEMLOCK_REMEDY = f"To allow it, {_LIMITS_REMEDY.format(limit='memlock unlimited')}"
_CPU_REMEDY = "Name one that this process may use in timing.cpu: `taskset -cp $$` lists them"


@dataclass(frozen=True, slots=True)
class Grant:
    """One request to the operating system and its result.

    Parameters
    ----------
    what
        Its name.
    refusal
        Why it was not granted, and the remedy; empty if it was.
    """

    what: str
    refusal: str = ""

    @property
    def granted(self) -> bool:
        """Whether the operating system granted the request."""
        return not self.refusal


class RealtimeSettings(Protocol):
    """Requests of a run to the operating system, as in `[timing]` of rig.toml."""

    @property
    def realtime(self) -> Literal["try", "enforce", "off"]:
        """Whether to ask, and whether to insist."""
        ...

    @property
    def priority(self) -> int:
        """SCHED_FIFO priority of the loop."""
        ...

    @property
    def cpu(self) -> int | Literal["any"]:
        """Number of the CPU of the loop."""
        ...

    @property
    def switch_interval_us(self) -> int:
        """Switch interval of Python's threads, us."""
        ...


class _Wish(NamedTuple):
    """One request to the operating system, before it is made."""

    what: str
    take: Callable[[RealtimeSettings, ExitStack], None]  # OSError if refused; pushes how to undo it
    remedy: str
    matters: bool  # to "enforce"


class RealTime:
    """Takes what `[timing]` asks for while it is entered, and gives all of it back.

    The priority, the CPU and the timer belong to the thread that enters, which must be the one that runs the
    loop; the rest to the process.

    Parameters
    ----------
    timing
        Its table.

    Attributes
    ----------
    grants
        What was asked for and what came of it, once entered.
    """

    def __init__(self, timing: RealtimeSettings) -> None:
        self._timing = timing
        self._undo = ExitStack()
        self.grants: list[Grant] = []

    def __enter__(self) -> Self:
        """Request every setting of `[timing]` from the operating system.

        Raises
        ------
        DeadlineError
            Under `realtime = "enforce"`, if what matters is refused.
        """
        if self._timing.realtime == "off":
            return self
        with ExitStack() as undo:
            wishes = _wishes(self._timing)
            self.grants = [_ask(wish, self._timing, undo) for wish in wishes]
            if self._timing.realtime == "enforce":
                _insist(wishes, self.grants)
            _watch(undo, self._step_down)
            self._undo = undo.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Undo every setting; an error here never hides how the run ended."""
        with suppress(OSError):
            self._undo.close()

    def _step_down(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - what a handler is given
        """Restore normal priorities: one of our threads ran for too long without a sleep."""
        _restore(dict.fromkeys(_threads(), (os.SCHED_OTHER, 0)))
        self.grants.append(
            Grant(
                "SCHED_FIFO to the end",
                f"taken back after {1e-3 * _RUN_WITHOUT_SLEEP_MAX_US:.0f} ms without a sleep. If that "
                "happens again, a period has more to do than time for it: lower loop.rate_hz",
            )
        )


def _wishes(timing: RealtimeSettings) -> list[_Wish]:
    pinned = [_Wish(f"CPU {timing.cpu}", _pin, _CPU_REMEDY, matters=True)] if timing.cpu != "any" else []
    return [
        _Wish("collector off", _quiet_collector, "", matters=False),
        _Wish("switch interval", _switch_sooner, "", matters=False),
        _Wish("timer slack", _sharpen_timer, "", matters=False),
        _Wish("locked memory", _lock_memory, _MEMLOCK_REMEDY, matters=True),
        *pinned,
        _Wish("SCHED_FIFO", _be_first, _RTPRIO_REMEDY, matters=True),
    ]


def _ask(wish: _Wish, timing: RealtimeSettings, undo: ExitStack) -> Grant:
    try:
        wish.take(timing, undo)
    except OSError as error:
        why = error.strerror or str(error)
        return Grant(wish.what, f"{why}. {wish.remedy}" if wish.remedy else why)
    return Grant(wish.what)


def _insist(wishes: list[_Wish], grants: list[Grant]) -> None:
    refused = [
        f"{grant.what}: {grant.refusal}."
        for wish, grant in zip(wishes, grants, strict=True)
        if wish.matters and not grant.granted
    ]
    if refused:
        raise DeadlineError(
            "\n".join([*refused, 'timing.realtime = "enforce" asks for it; "try" would do without.'])
        )


# ---------------------------------------------------------------- one function a wish


def _quiet_collector(timing: RealtimeSettings, undo: ExitStack) -> None:  # noqa: ARG001 - all are called alike
    """Make no pause for garbage: what is there now is never looked at again, and no collection begins."""
    was_on = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    undo.callback(gc.unfreeze)
    if was_on:
        undo.callback(gc.enable)


def _switch_sooner(timing: RealtimeSettings, undo: ExitStack) -> None:
    """Bound the time for which another thread holds the interpreter lock while the loop waits for it."""
    undo.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(1e-6 * timing.switch_interval_us)


def _sharpen_timer(timing: RealtimeSettings, undo: ExitStack) -> None:  # noqa: ARG001
    """Set the timer slack so that a normal thread wakes on time, not 50 us later, as with SCHED_FIFO."""
    _call_libc("prctl", _PR_SET_TIMERSLACK, 1, 0, 0, 0)
    undo.callback(_call_libc, "prctl", _PR_SET_TIMERSLACK, _USUAL_SLACK_NS, 0, 0, 0)


def _lock_memory(timing: RealtimeSettings, undo: ExitStack) -> None:  # noqa: ARG001
    """Keep our pages in memory, each from its first touch on, so that stacks do not cost their whole size."""
    held = privileges()
    for_ever = held["cap_ipc_lock"] or held["memlock_limit"] == "unlimited"
    # Under a limit, locking what is still to come would turn the limit into a failing malloc later.
    _call_libc("mlockall", _MCL_CURRENT | _MCL_ONFAULT | (_MCL_FUTURE if for_ever else 0))
    undo.callback(_call_libc, "munlockall")


def _pin(timing: RealtimeSettings, undo: ExitStack) -> None:
    """Pin the loop's thread alone: the others would be in its way there."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {int(timing.cpu)})
    undo.callback(os.sched_setaffinity, 0, before)


def _be_first(timing: RealtimeSettings, undo: ExitStack) -> None:
    """Give the loop the highest priority, and our other threads one above every normal program.

    Without the latter a thread that holds the interpreter lock could lose its CPU to such a program, and the
    loop would wait for both.
    """
    mine = threading.get_native_id()
    _raise_to(timing.priority, mine, undo)
    for helper in set(_threads()) - {mine}:
        with suppress(ProcessLookupError):  # it has just ended
            _raise_to(_HELPER_PRIORITY, helper, undo)


def _watch(undo: ExitStack, step_down: Callable[[int, FrameType | None], None]) -> None:
    """Ask to be told when a real-time thread of ours does not sleep; only the main thread can be."""
    if threading.current_thread() is not threading.main_thread():
        return
    import resource  # POSIX only, as all of this; the module is imported by runs in virtual time, too

    soft, hard = resource.getrlimit(resource.RLIMIT_RTTIME)
    if hard != resource.RLIM_INFINITY and hard <= _RUN_WITHOUT_SLEEP_MAX_US:
        return
    before = signal.signal(signal.SIGXCPU, step_down) or signal.SIG_DFL
    undo.callback(signal.signal, signal.SIGXCPU, before)
    undo.callback(resource.setrlimit, resource.RLIMIT_RTTIME, (soft, hard))
    resource.setrlimit(resource.RLIMIT_RTTIME, (_RUN_WITHOUT_SLEEP_MAX_US, hard))


# ---------------------------------------------------------------- the system itself


def _threads() -> list[int]:
    return [thread.native_id for thread in threading.enumerate() if thread.native_id is not None]


def _raise_to(priority: int, thread: int, undo: ExitStack) -> None:
    before = os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority
    os.sched_setscheduler(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    undo.callback(_restore, {thread: before})


def _restore(threads: dict[int, tuple[int, int]]) -> None:
    for thread, (policy, priority) in threads.items():
        with suppress(ProcessLookupError):
            try:
                os.sched_setscheduler(thread, policy, os.sched_param(priority))
            except PermissionError:  # without privileges the flag for children stays
                kept = policy | os.SCHED_RESET_ON_FORK
                os.sched_setscheduler(thread, kept, os.sched_param(priority))


def _call_libc(name: str, *arguments: int) -> None:
    """Call a function of the C library that answers 0, or sets errno."""
    libc = ctypes.CDLL(None, use_errno=True)
    if getattr(libc, name)(*map(ctypes.c_ulong, arguments)) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
