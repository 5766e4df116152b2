"""From a link just opened to a device in RUN at 0 V, or a sentence that says why not."""

from __future__ import annotations

import contextlib
import secrets
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.backends import refusals
from dcmp_hil.backends.caller import PATIENCE
from dcmp_hil.errors import BackendError, ConfigError, DcmpError
from dcmp_hil.faults import name_of
from dcmp_hil.wire.messages import (
    Drive,
    Hello,
    Identity,
    Parameter,
    ParameterGet,
    ParameterSet,
    ParameterValue,
    Result,
    State,
    Stop,
    StopReason,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from dcmp_hil.backends.caller import Caller
    from dcmp_hil.backends.link import Link
    from dcmp_hil.backends.terms import Terms
    from dcmp_hil.clock import Clock

_HELLOS, _TOLD = 5, 2
_ROUND_TRIPS = 5
_SLOWEST = 3e-3  # s: a command older than that is refused by the device


class Greeting(NamedTuple):
    """What the handshake found out."""

    session: int
    tick: int  # of the newest SAMPLE, periods since the device's boot
    firmware: str


class Handshake:
    """Makes a device ours, step by step; every step says what is wrong and what to do.

    Parameters
    ----------
    link
        Open; its name and its count of damaged input are used.
    caller
        On that link.
    terms
        What the rig says of the device.
    clock
        Times round trips.
    """

    def __init__(self, link: Link, caller: Caller, terms: Terms, clock: Clock) -> None:
        self._link, self._caller, self._terms, self._clock = link, caller, terms, clock
        self._session = 1 + secrets.randbelow(0xFFFF)

    def run(self) -> Greeting:
        """Go through all of it; afterwards the device is in RUN and hears 0 V.

        Raises
        ------
        OpenError
            If nobody, somebody else's device, or another version answers, or it does not arm.
        ConfigError
            If the device is not what the rig says.
        """
        self._listen()
        firmware = self._introduce()
        try:
            self._compare()
            self._check_round_trip()
            self._clear()
            self._set_limits()
            self._arm()
        except DcmpError:
            self._give_back()
            raise
        except BaseException:  # Ctrl-C: it may be armed by now
            with contextlib.suppress(BackendError):
                self._caller.say(Stop(StopReason.PERSON))
            raise
        return Greeting(self._session, self._caller.tick, firmware)

    def _give_back(self) -> None:
        """Release the session, so that whoever tries next need not wait until it lapses."""
        with contextlib.suppress(BackendError):
            self._join_ticks()
            self._say(release=True)

    def _listen(self) -> None:
        caller = self._caller
        if caller.hear_sample(PATIENCE) is not None:
            return
        if self._link.corrupt or caller.corrupt:
            raise refusals.only_damage(self._link.name)
        if caller.foreign:
            raise refusals.other_node(self._link.name, self._terms.node)
        raise refusals.silence(self._link.name, PATIENCE)

    def _introduce(self) -> str:
        """Become the owner, and be told so twice: on a bus an IDENTITY may be the answer to somebody else."""
        told = 0
        for _ in range(_HELLOS):
            identity = self._caller.ask(Hello(self._session, PROTOCOL_HASH), Identity)
            if identity is None:
                raise refusals.deaf(self._link.name)
            firmware = f"{identity.firmware_version >> 8}.{identity.firmware_version & 0xFF}"
            if identity.mismatch or identity.protocol_hash != PROTOCOL_HASH:
                raise refusals.other_protocol(self._link.name, firmware, identity.protocol_hash)
            if identity.owned and not identity.busy:
                told += 1
            else:
                told = 0
                self._caller.listen(1e-3 * (5 + secrets.randbelow(20)))
            if told == _TOLD:
                return firmware
        raise refusals.owned(self._link.name)

    def _compare(self) -> None:
        """Hold the rig against the device; every difference at once."""
        terms = self._terms
        counts = self._get(Parameter.COUNTS_PER_REV)
        rate_hz, allowed_V = (
            1e6 / self._get(Parameter.PERIOD_US),
            1e-3 * self._get(Parameter.VOLTAGE_LIMIT_MV),
        )
        asked_hz, asked_V = 1e6 / terms.period_us, 1e-3 * terms.voltage_limit_mV
        faults = []
        if counts != terms.counts_per_rev:
            faults.append(
                f"encoder.counts_per_rev: the rig says {terms.counts_per_rev}, the device {counts}. "
                "Correct the rig, or build the firmware for this encoder."
            )
        if rate_hz != asked_hz:
            faults.append(
                f"loop.rate_hz: the rig says {asked_hz:g}, the device {rate_hz:g}. "
                "Correct the rig, or build the firmware for this rate."
            )
        if allowed_V < asked_V:
            faults.append(
                f"amplifier.voltage_limit_V: the rig says {asked_V:g}, the device allows {allowed_V:g}. "
                "Lower it in the rig."
            )
        if faults:
            raise ConfigError(*faults)

    def _check_round_trip(self) -> None:
        """Refuse a USB adapter that collects bytes for 16 ms: every command would be too old."""
        best = min(self._round_trip() for _ in range(_ROUND_TRIPS))
        if best > _SLOWEST + 1e-6 * self._terms.period_us:
            raise refusals.slow(self._link.name, best)

    def _round_trip(self) -> float:
        began_ns = self._clock.now_ns()
        self._get(Parameter.TICK)
        return 1e-9 * (self._clock.now_ns() - began_ns)

    def _clear(self) -> None:
        """Leave a fault of an earlier run: whoever starts a run arms the device."""
        self._join_ticks()
        sample = self._caller.sample
        if sample is None or sample.state != State.FAULT:
            return
        self._answer(clear=False)
        if not self._answer_until(State.IDLE, clear=True):
            raise refusals.faulty(self._link.name, name_of(self._caller.fault or sample.fault_class))

    def _set_limits(self) -> None:
        terms = self._terms
        for parameter, value in (
            (Parameter.WATCHDOG_MS, terms.watchdog_ms),
            (Parameter.VOLTAGE_LIMIT_MV, terms.voltage_limit_mV),
            (Parameter.SLEW_MV_PER_MS, terms.slew_mV_per_ms),
        ):
            if value is None:
                continue
            found = self._ask(ParameterSet(self._session, parameter, value))
            if found is None or found.result != Result.OK or found.value != value:
                raise refusals.not_taken(self._link.name, parameter.name, value, found)

    def _arm(self) -> None:
        self._join_ticks()
        if not self._answer_until(State.RUN, arm=True):
            sample = self._caller.sample
            state = State(sample.state).name if sample and sample.state in set(State) else "no state"
            raise refusals.not_armed(self._link.name, state, PATIENCE)

    def _answer_until(self, state: State, *, arm: bool = False, clear: bool = False) -> bool:
        """Answer SAMPLEs at 0 V until one says `state`; False if none did in time."""
        deadline_ns = self._clock.now_ns() + int(1e9 * PATIENCE)
        while self._clock.now_ns() < deadline_ns:
            if self._answer(arm=arm, clear=clear) == state:
                return True
        return False

    def _answer(self, *, arm: bool = False, clear: bool = False) -> int | None:
        """Answer the next SAMPLE at 0 V; return its state."""
        sample = self._caller.hear_sample(PATIENCE)
        if sample is None:
            return None
        self._say(arm=arm, clear=clear)
        return sample.state

    def _say(self, *, arm: bool = False, clear: bool = False, release: bool = False) -> None:
        seq = self._caller.tick & 0x1FFF
        self._caller.say(Drive(0, seq, arm, clear, release, self._session, self._terms.watchdog_ms))

    def _join_ticks(self) -> None:
        """Find the whole tick of which SAMPLE shows the low byte; the caller counts on."""
        self._get(Parameter.TICK)

    def _ask(self, question: ParameterGet | ParameterSet) -> ParameterValue | None:
        return self._caller.ask(question, ParameterValue, lambda answer: answer.id == question.id)

    def _get(self, parameter: Parameter) -> int:
        found = self._ask(ParameterGet(parameter))
        if found is None or found.result != Result.OK:
            raise refusals.not_told(self._link.name, parameter.name)
        return found.value
