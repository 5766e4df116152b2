"""Out of a fault of an earlier run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.device import open_errors
from dcmp_hil.device.client import ANSWER_TIMEOUT_S
from dcmp_hil.safety.device_faults import name_of
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Drive, State, StopReason

if TYPE_CHECKING:
    from dcmp_hil.device.client import DeviceClient
    from dcmp_hil.platform.clock import Clock

_FAULT_REPORT_TIMEOUT_S = 0.25  # s: FAULT comes every 100 ms
_OTHER_FAULT_CLASS = 7  # fault class of every code from 7 on
_SEQUENCE_MASK = 0x1FFF
_OF_A_RUN = (
    *(Fault.HOST_SILENT, Fault.LINK_DOWN, Fault.CORRUPT_LINK),
    *(Fault.OVER_SPEED, Fault.OVER_TRAVEL, Fault.ENCODER_JUMP),
)
"""Faults that the next run may clear."""


class Clearing:
    """Clears the one fault that the device has, and no other.

    Some faults wait for a person: STOP that a person sent, the amplifier's own protection, what the board
    found wrong with itself, and what the device did not name.

    A command may be lost, so `clear` alternates: every 1 that arrives follows a 0 that did.

    Parameters
    ----------
    name
        What to call the link.
    client
        On it; it has joined the device's ticks.
    clock
        Bounds the waiting.
    session
        That owns the device.
    ttl_ms
        ms, of the commands.
    allowed
        Whether a person has said that faults of every kind may be cleared.
    """

    def __init__(
        self,
        name: str,
        client: DeviceClient,
        clock: Clock,
        session: int,
        ttl_ms: int,
        *,
        allowed: bool = False,
    ) -> None:
        self._name, self._client, self._clock = name, client, clock
        self._session, self._ttl_ms, self._allowed = session, ttl_ms, allowed

    def run(self) -> str:
        """Clear the fault; return its name, empty if there was none.

        Raises
        ------
        OpenError
            If it waits for a person, does not clear within 500 ms, or another fault takes its place.
        """
        code = self._named()
        if not code:
            return ""
        if not self._allowed and self._waits_for_person(code):
            raise open_errors.latched(self._name, code)
        clear = False
        deadline_ns = self._clock.now_ns() + int(1e9 * ANSWER_TIMEOUT_S)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            sample = self._client.receive_sample(1e-9 * left_ns)
            if sample is None:
                break
            if sample.state != State.FAULT:
                return name_of(code)
            self._check_same(code)
            seq = self._client.tick & _SEQUENCE_MASK
            self._client.send(Drive(0, seq, False, clear, False, self._session, self._ttl_ms))
            clear = not clear
        raise open_errors.faulty(self._name, name_of(code))

    def _named(self) -> int:
        """Return the code of the fault that is latched; 0 if none is."""
        client = self._client
        if client.sample is None or client.sample.state != State.FAULT:
            return 0
        client.fault = 0  # of before
        deadline_ns = self._clock.now_ns() + int(1e9 * _FAULT_REPORT_TIMEOUT_S)
        while not client.fault and (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            client.receive(1e-9 * left_ns)
        if client.sample.state != State.FAULT:
            return 0
        known = client.sample.fault_class if client.sample.fault_class < _OTHER_FAULT_CLASS else Fault.UNKNOWN
        return client.fault or known

    def _waits_for_person(self, code: int) -> bool:
        """Whether this fault is cleared only where a person has said so."""
        if code == Fault.STOPPED:  # by a program, at a trip or where samples were missing: as any other fault
            return self._client.fault != code or self._client.fault_detail == StopReason.PERSON
        return code not in _OF_A_RUN

    def _check_same(self, code: int) -> None:
        """Stop where the device names another fault than at the start."""
        sample, told = self._client.sample, self._client.fault
        seen = sample.fault_class if sample is not None else 0
        if told not in {0, code}:
            raise open_errors.other_fault(self._name, name_of(code), name_of(told))
        if code != Fault.UNKNOWN and seen != min(code, _OTHER_FAULT_CLASS):
            raise open_errors.other_fault(self._name, name_of(code), name_of(seen))
