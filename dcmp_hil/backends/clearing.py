"""Out of a fault of an earlier run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.backends import refusals
from dcmp_hil.backends.caller import PATIENCE
from dcmp_hil.faults import name_of
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Drive, State

if TYPE_CHECKING:
    from dcmp_hil.backends.caller import Caller
    from dcmp_hil.clock import Clock

_REPORT = 0.25  # s: FAULT comes every 100 ms
_OTHER = 7  # fault class of every code from 7 on
_SEQ = 0x1FFF


class Clearing:
    """Clears the one fault that the device has, and no other.

    A command may be lost, so `clear` alternates: every 1 that arrives follows a 0 that did.

    Parameters
    ----------
    name
        What to call the link.
    caller
        On it; it has joined the device's ticks.
    clock
        Bounds the waiting.
    session
        That owns the device.
    ttl_ms
        ms, of the commands.
    """

    def __init__(self, name: str, caller: Caller, clock: Clock, session: int, ttl_ms: int) -> None:
        self._name, self._caller, self._clock = name, caller, clock
        self._session, self._ttl_ms = session, ttl_ms

    def run(self) -> str:
        """Clear the fault; return its name, empty if there was none.

        Raises
        ------
        OpenError
            If it does not clear within 500 ms, or another fault takes its place.
        """
        code = self._named()
        if not code:
            return ""
        clear = False
        deadline_ns = self._clock.now_ns() + int(1e9 * PATIENCE)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            sample = self._caller.hear_sample(1e-9 * left_ns)
            if sample is None:
                break
            if sample.state != State.FAULT:
                return name_of(code)
            self._check_same(code)
            seq = self._caller.tick & _SEQ
            self._caller.say(Drive(0, seq, False, clear, False, self._session, self._ttl_ms))
            clear = not clear
        raise refusals.faulty(self._name, name_of(code))

    def _named(self) -> int:
        """Return the code of the fault that is latched; 0 if none is."""
        caller = self._caller
        if caller.sample is None or caller.sample.state != State.FAULT:
            return 0
        caller.fault = 0  # of before
        deadline_ns = self._clock.now_ns() + int(1e9 * _REPORT)
        while not caller.fault and (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            caller.hear(1e-9 * left_ns)
        if caller.sample.state != State.FAULT:
            return 0
        known = caller.sample.fault_class if caller.sample.fault_class < _OTHER else Fault.UNKNOWN
        return caller.fault or known

    def _check_same(self, code: int) -> None:
        """Stop where the device names another fault than at the start."""
        sample, told = self._caller.sample, self._caller.fault
        seen = sample.fault_class if sample is not None else 0
        if told not in {0, code}:
            raise refusals.other_fault(self._name, name_of(code), name_of(told))
        if code != Fault.UNKNOWN and seen != min(code, _OTHER):
            raise refusals.other_fault(self._name, name_of(code), name_of(seen))
