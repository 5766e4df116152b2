"""Leaving a device: 0 V three times, disarmed, the echo seen, and the session given back."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.safety.device_faults import name_of
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Drive, Health, State

if TYPE_CHECKING:
    from dcmp_hil.device.client import DeviceClient
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.messages import SampleReport

_ZERO_ANSWERS_MIN = 3  # answers at 0 V
_ANSWER_TIMEOUT_NS = 250_000_000
_HEALTH_TIMEOUT_NS = 120_000_000  # HEALTH comes every 100 ms
_OF_THE_LINK = (Fault.HOST_SILENT, Fault.LINK_DOWN, Fault.CORRUPT_LINK)
_AT_REST = (State.BOOT, State.IDLE, State.FAULT)


class DeviceEnd(NamedTuple):
    """Last state and fault of a device after a run."""

    state: str  # IDLE, FAULT ...
    fault: str  # its name; empty without one

    @property
    def warning(self) -> str:
        """Return what a fault means for a run that ended as it was asked to."""
        return (
            f"the device ended the run by itself, in fault {self.fault}: the last commands, 0 V and disarm, "
            "did not reach it. Check the way from host to device."
        )


class DisarmSequence:
    """The end of a session.

    Parameters
    ----------
    client
        On the link; it knows the tick of the newest SAMPLE.
    clock
        Bounds the waiting.
    session
        To give back.
    ttl_ms
        ms, of the last commands.
    """

    def __init__(self, client: DeviceClient, clock: Clock, session: int, ttl_ms: int) -> None:
        self._client, self._clock = client, clock
        self._session, self._ttl_ms = session, ttl_ms

    def run(self, *, answered: bool) -> DeviceEnd | None:
        """Disarm the device; return its last state, None if it did not confirm 0 V and disarmed.

        Parameters
        ----------
        answered
            Whether the newest SAMPLE has its answer already; otherwise 0 V is said at once.
        """
        said = 0
        if not answered:
            self._say(release=False)
            said = 1
        deadline_ns = self._clock.now_ns() + _ANSWER_TIMEOUT_NS
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            sample = self._client.receive_sample(1e-9 * left_ns)
            if sample is None:
                return None
            confirmed = sample.state in _AT_REST and sample.voltage_mV == 0
            if confirmed and said >= _ZERO_ANSWERS_MIN:
                self._say(release=True)
                self._hear_health(sample)
                return DeviceEnd(State(sample.state).name, self._fault_of(sample))
            self._say(release=False)
            said += 1
        return None

    def _hear_health(self, sample: SampleReport) -> None:
        """Wait for the counters of a device that the link has brought to a fault: they show why."""
        if sample.state != State.FAULT or sample.fault_class not in _OF_THE_LINK:
            return
        until_ns = self._clock.now_ns() + _HEALTH_TIMEOUT_NS
        while (left_ns := until_ns - self._clock.now_ns()) > 0:
            if isinstance(self._client.receive(1e-9 * left_ns), Health):
                return

    def _fault_of(self, sample: SampleReport) -> str:
        if sample.state != State.FAULT:
            return ""
        return name_of(self._client.fault or sample.fault_class)

    def _say(self, *, release: bool) -> None:
        seq = self._client.tick & 0x1FFF
        self._client.send(Drive(0, seq, False, False, release, self._session, self._ttl_ms))
