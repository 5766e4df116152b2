"""From a link just opened to a device in RUN at 0 V, or a sentence that says why not."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.backends.caller import PATIENCE
from dcmp_hil.errors import ConfigError, OpenError
from dcmp_hil.wire.counters import nearest
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
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from dcmp_hil.backends.caller import Caller
    from dcmp_hil.backends.link import Link
    from dcmp_hil.backends.terms import Terms
    from dcmp_hil.clock import Clock

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
        self._tick = 0

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
        self._compare()
        self._check_round_trip()
        self._clear()
        self._set_limits()
        self._arm()
        return Greeting(self._session, self._tick, firmware)

    def _listen(self) -> None:
        caller, name = self._caller, self._link.name
        if caller.hear_sample(PATIENCE) is not None:
            return
        if self._link.corrupt or caller.corrupt:
            raise OpenError(
                f"{name}: something arrives, but no valid frame. Check the baud or bit rate (backend.baud, "
                "backend.bitrate) and that the device is set to the same carrier."
            )
        if caller.foreign:
            raise OpenError(
                f"{name}: frames arrive, but none from node {self._terms.node}. Check backend.node; "
                "`dcmp-hil ports` lists who is there."
            )
        raise OpenError(
            f"{name}: nothing arrives within {1e3 * PATIENCE:.0f} ms. Check that the device has power, "
            f"that the "
            "cable is the right one, and the rate; `dcmp-hil ports` lists what answers where."
        )

    def _introduce(self) -> str:
        identity = self._caller.ask(Hello(self._session, PROTOCOL_HASH), Identity)
        name = self._link.name
        if identity is None:
            raise OpenError(
                f"{name}: the device sends samples but does not answer. Check the wire from host to "
                f"device (TX)."
            )
        firmware = f"{identity.firmware_version >> 8}.{identity.firmware_version & 0xFF}"
        if identity.mismatch or identity.protocol_hash != PROTOCOL_HASH:
            raise OpenError(
                f"{name}: firmware {firmware} speaks protocol {identity.protocol_hash:08x}, this host "
                f"{PROTOCOL_HASH:08x}. Flash the firmware that comes with this version of dcmp-hil, or "
                f"install "
                "the dcmp-hil that the firmware came with."
            )
        if identity.busy or not identity.owned:
            raise OpenError(
                f"{name}: another host owns the device. End its run first; what it leaves behind is given "
                "up by the device after half a second."
            )
        return firmware

    def _compare(self) -> None:
        terms = self._terms
        counts = self._get(Parameter.COUNTS_PER_REV)
        period_us = self._get(Parameter.PERIOD_US)
        limit_mV = self._get(Parameter.VOLTAGE_LIMIT_MV)
        faults = []
        if counts != terms.counts_per_rev:
            faults.append(
                f"encoder.counts_per_rev: the rig says {terms.counts_per_rev}, the device {counts}. "
                f"Correct the "
                "rig, or build the firmware for this encoder."
            )
        if period_us != terms.period_us:
            faults.append(
                f"loop.rate_hz: the rig says {1e6 / terms.period_us:g}, the device {1e6 / period_us:g}. "
                f"Correct "
                "the rig, or build the firmware for this rate."
            )
        if limit_mV < terms.voltage_limit_mV:
            faults.append(
                f"amplifier.voltage_limit_V: the rig says {1e-3 * terms.voltage_limit_mV:g}, the device "
                f"allows "
                f"{1e-3 * limit_mV:g}. Lower it in the rig."
            )
        if faults:
            raise ConfigError(*faults)

    def _check_round_trip(self) -> None:
        """Refuse a USB adapter that collects bytes for 16 ms: every command would be too old."""
        best = min(self._round_trip() for _ in range(_ROUND_TRIPS))
        if best > _SLOWEST + 1e-6 * self._terms.period_us:
            raise OpenError(
                f"{self._link.name}: an answer takes {1e3 * best:.1f} ms, and commands older than 3 ms "
                f"are refused. "
                "Lower the USB adapter's latency timer: "
                "echo 1 > /sys/bus/usb-serial/devices/ttyUSB0/latency_timer"
            )

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
            raise OpenError(
                f"{self._link.name}: the device stays in fault {sample.fault_class}. Look at what "
                f"`dcmp-hil monitor` "
                "says, mend the cause, and switch the device off and on."
            )

    def _set_limits(self) -> None:
        terms = self._terms
        for parameter, value in (
            (Parameter.WATCHDOG_MS, terms.watchdog_ms),
            (Parameter.VOLTAGE_LIMIT_MV, terms.voltage_limit_mV),
            (Parameter.SLEW_MV_PER_MS, terms.slew_mV_per_ms),
        ):
            if value is None:
                continue
            question = ParameterSet(self._session, parameter, value)
            found = self._ask(question)
            if found is None or found.result != Result.OK or found.value != value:
                raise OpenError(
                    f"{self._link.name}: the device does not take {parameter.name} = {value}"
                    f"{'' if found is None else f' and stays at {found.value}'}. Use what it allows, or "
                    f"build the "
                    "firmware with a higher limit."
                )

    def _arm(self) -> None:
        self._join_ticks()
        if not self._answer_until(State.RUN, arm=True):
            state = "no state" if self._caller.sample is None else State(self._caller.sample.state).name
            raise OpenError(
                f"{self._link.name}: the device did not arm within {1e3 * PATIENCE:.0f} ms and is in "
                f"{state}. Commands "
                "may arrive too late (a slow adapter, a busy computer); `dcmp-hil monitor` shows what it "
                "counts."
            )

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
        self._tick = nearest(self._tick, sample.tick, 8)
        drive = Drive(0, self._tick & 0x1FFF, arm, clear, False, self._session, self._terms.watchdog_ms)
        self._caller.say(drive)
        return sample.state

    def _join_ticks(self) -> None:
        """Find the whole tick of which SAMPLE shows the low byte."""
        self._tick = self._get(Parameter.TICK)

    def _ask(self, question: ParameterGet | ParameterSet) -> ParameterValue | None:
        return self._caller.ask(question, ParameterValue, lambda answer: answer.id == question.id)

    def _get(self, parameter: Parameter) -> int:
        found = self._ask(ParameterGet(parameter))
        if found is None or found.result != Result.OK:
            raise OpenError(
                f"{self._link.name}: the device does not say its {parameter.name}. Flash the firmware "
                f"that comes "
                "with this version of dcmp-hil."
            )
        return found.value
