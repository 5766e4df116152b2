"""Leaving a device: 0 V three times, disarmed, the echo seen, and the session given back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.counters import nearest
from dcmp_hil.wire.messages import Drive, State

if TYPE_CHECKING:
    from dcmp_hil.backends.caller import Caller
    from dcmp_hil.clock import Clock

_LEAST = 3  # answers at 0 V
_PATIENCE_NS = 250_000_000
_AT_REST = (State.BOOT, State.IDLE, State.FAULT)


class Goodbye:
    """The end of a session.

    Parameters
    ----------
    caller
        On the link.
    clock
        Bounds the waiting.
    session
        To give back.
    ttl_ms
        ms, of the last commands.
    tick
        Of the last SAMPLE.
    """

    def __init__(self, caller: Caller, clock: Clock, session: int, ttl_ms: int, tick: int) -> None:
        self._caller, self._clock = caller, clock
        self._session, self._ttl_ms = session, ttl_ms
        self._tick = tick

    def say_only(self) -> None:
        """Disarm without waiting for the echo."""
        self._say(release=False)

    def run(self) -> bool:
        """Say goodbye; True if the device confirmed 0 V, disarmed."""
        self.say_only()  # at once: a sample may be a period away
        deadline_ns = self._clock.now_ns() + _PATIENCE_NS
        answered = 1
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            sample = self._caller.hear_sample(1e-9 * left_ns)
            if sample is None:
                return False
            self._tick = nearest(self._tick, sample.tick, 8)
            confirmed = sample.state in _AT_REST and sample.voltage_mV == 0
            if confirmed and answered >= _LEAST:
                self._say(release=True)
                return True
            self._say(release=False)
            answered += 1
        return False

    def _say(self, *, release: bool) -> None:
        drive = Drive(
            0,
            self._tick & 0x1FFF,
            arm=False,
            clear=False,
            release=release,
            session=self._session,
            ttl_ms=self._ttl_ms,
        )
        self._caller.say(drive)
