"""The only file that sleeps or asks what time it is: integer nanoseconds, absolute deadlines."""

import time
from datetime import UTC, datetime
from typing import Protocol


class Clock(Protocol):
    """Monotonic time, and waiting for an instant of it."""

    def now_ns(self) -> int:
        """Return the present instant in ns; only differences mean anything."""
        ...

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Return no earlier than `deadline_ns`; at once if it has passed."""
        ...


class MonotonicClock:
    """The machine's own monotonic clock; a jump of the wall clock does not reach it."""

    now_ns = staticmethod(time.monotonic_ns)

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Sleep until `deadline_ns`."""
        remaining_ns = deadline_ns - time.monotonic_ns()
        if remaining_ns > 0:
            time.sleep(remaining_ns * 1e-9)


class SimulatedClock:
    """Virtual time: sleeping is a jump, so a run takes no longer than its arithmetic."""

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the instant last slept until, in ns."""
        return self._now_ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Jump to `deadline_ns`; never backwards."""
        self._now_ns = max(self._now_ns, deadline_ns)


def cpu_ns() -> int:
    """Return the time for which this process has computed, ns; only differences mean anything."""
    return time.process_time_ns()


def pause(seconds: float) -> None:
    """Sleep for `seconds`: for helpers beside the loop, never inside it."""
    time.sleep(seconds)


def utc_now() -> datetime:
    """Return the wall clock's time, for names and stamps only; nothing is ever timed with it."""
    return datetime.now(UTC)
