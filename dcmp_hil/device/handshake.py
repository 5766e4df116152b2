"""From a link just opened to a device in RUN at 0 V, or a sentence that says why not."""

from __future__ import annotations

import contextlib
import math
import secrets
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.device import open_errors
from dcmp_hil.device.boot_history import history_of
from dcmp_hil.device.client import ANSWER_TIMEOUT_S
from dcmp_hil.device.compatibility import differences, remarks
from dcmp_hil.device.fault_clearing import Clearing
from dcmp_hil.device.parameters import DeviceParameters
from dcmp_hil.errors import BackendError, ConfigError
from dcmp_hil.safety.device_faults import meaning_of
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import (
    Drive,
    Hello,
    Identity,
    Parameter,
    ParameterGet,
    ParameterValue,
    SampleReport,
    State,
    Stop,
    StopReason,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.device.client import DeviceClient
    from dcmp_hil.device.device_config import DeviceConfig
    from dcmp_hil.device.links.base import Link
    from dcmp_hil.errors import OpenError
    from dcmp_hil.platform.clock import Clock

_HELLO_ATTEMPTS, _OWNED_ANSWERS_MIN = 5, 2
_ROUND_TRIP_MEASUREMENTS = 5
_COMMAND_AGE_MAX_S = 3e-3  # s: a command older than that is refused by the device
_TICK_JOIN_ATTEMPTS = 3  # attempts to match a SAMPLE with an answer to TICK
_TICK_DIFFERENCE_MIN = -4  # ticks that a SAMPLE may differ from TICK
_TICK_DIFFERENCE_MAX = 32  # the same, upper bound
_HOT_SAMPLES = 5  # with a voltage, disarmed: the first ones may be those of a run that just ended
_TWIN_LISTEN_S = 0.1
_DAMAGED_FRAMES_PER_SECOND_MAX = 5  # frames, in a second
_RELEASE_ATTEMPTS, _NEXT_SAMPLE_TIMEOUT_S = 3, 0.1


class Greeting(NamedTuple):
    """Results of the handshake: session, firmware, history and zero of the device."""

    session: int
    tick: int  # of the newest SAMPLE, periods since the device's boot
    firmware: str
    cleared: str  # name of a fault of an earlier run; empty for none
    history: str  # boots, why it was reset, the fault before that
    remarks: tuple[str, ...]  # what a person should know of this device
    zero: int  # count modulo 2^24 at which the arm hangs, as the device was told


class Handshake:
    """Makes a device ours, step by step; every step says what is wrong and what to do.

    Parameters
    ----------
    link
        Open; its name and its count of damaged input are used.
    client
        On that link.
    config
        What the rig says of the device.
    clock
        Times round trips.
    clear
        Whether a person has said that a fault of every kind may be cleared.
    """

    def __init__(
        self, link: Link, client: DeviceClient, config: DeviceConfig, clock: Clock, *, clear: bool = False
    ) -> None:
        self._link, self._client, self._config, self._clock = link, client, config, clock
        self._clear = clear
        self._session = 1 + secrets.randbelow(0xFFFF)
        self._parameters = DeviceParameters(link.name, client, self._session)
        self._damaged_before = 0
        self._booted_ns = 0  # the latest that a board has booted

    def run(self) -> Greeting:
        """Run the whole handshake; afterwards the device is in RUN and receives 0 V.

        Raises
        ------
        OpenError
            If no device, a device of another host, or another version answers, if its answer is impossible,
            or if it does not arm.
        ConfigError
            If the device is not what the rig says.
        """
        self._booted_ns = self._clock.now_ns() + int(1e9 * self._config.boot_wait)
        self._listen()
        self._damaged_before = self._damaged
        arming = False
        try:
            firmware = self._introduce()
            self._check_round_trip()
            found = self._parameters.compared()
            told = self._compare(found)
            past = history_of(self._client)
            self._check_alone()
            self._join_ticks()
            cleared = self._clearing().run()
            zero = self._parameters.put_limits(self._config, found)
            self._join_ticks()
            self._check_cold()
            arming = True
            self._arm()
        except open_errors.NoAnswerError as error:
            self._give_back()
            raise self._blamed(error) from error
        except BaseException as error:  # Ctrl-C too
            if arming and not isinstance(error, BackendError):
                self._stop()
            else:
                self._give_back()
            raise
        remarks = (*told, *past.remarks, *_about(cleared))
        return Greeting(self._session, self._client.tick, firmware, cleared, past.sentence, remarks, zero)

    @property
    def _damaged(self) -> int:
        return self._link.corrupt + self._client.corrupt

    def _blamed(self, error: OpenError) -> OpenError:
        """Blame the line for it, where the line damages frames."""
        here, there = self._damaged - self._damaged_before, self._client.damaged_there
        if max(here, there) < _DAMAGED_FRAMES_PER_SECOND_MAX:
            return error
        return open_errors.damaged(self._link.name, here, there, error)

    def _stop(self) -> None:
        """Leave nothing armed; the end of a run that a person asked for here is cleared by the next start."""
        with contextlib.suppress(BackendError):
            self._client.send(Stop(StopReason.REQUESTED))

    def _give_back(self) -> None:
        """Release the session, so that the next host need not wait until it lapses."""
        with contextlib.suppress(BackendError):
            self._parameters.get(Parameter.TICK)
            for _ in range(_RELEASE_ATTEMPTS):
                self._client.receive_sample(_NEXT_SAMPLE_TIMEOUT_S)  # a command must answer a newer SAMPLE
                self._say(release=True)

    def _listen(self) -> None:
        client, wait = self._client, self._config.boot_wait
        if client.receive_sample(1e-9 * (self._booted_ns - self._clock.now_ns())) is not None:
            return
        name = self._link.name
        if client.heard:
            raise open_errors.no_samples(
                name, wait, " and ".join(kind.upper() for kind in sorted(client.heard))
            )
        if client.nodes:
            raise open_errors.other_node(name, self._config.node, client.nodes)
        if self._link.corrupt or client.corrupt:
            raise open_errors.only_damage(name, self._link.other_carrier)
        raise open_errors.silence(name, wait)

    def _introduce(self) -> str:
        """Become the owner, confirmed by two answers: on a bus an IDENTITY may answer another host."""
        told, identity = 0, None
        for _ in range(_HELLO_ATTEMPTS):
            identity = self._ask_who()
            firmware = f"{identity.firmware_version >> 8}.{identity.firmware_version & 0xFF}"
            self._check_identity(identity, firmware)
            if identity.owned and not identity.mismatch:
                told += 1
            else:
                told = 0
                self._client.listen(1e-3 * (5 + secrets.randbelow(20)))
            if told == _OWNED_ANSWERS_MIN:
                return firmware
        self._check_alone()
        if identity is not None and identity.mismatch:
            raise open_errors.impossible(self._link.name, "that this host's protocol is not its own; it is")
        raise open_errors.owned(self._link.name)

    def _ask_who(self) -> Identity:
        """Ask with HELLO; where all fell silent meanwhile, a board boots because its port was opened."""
        hello = Hello(self._session, PROTOCOL_HASH)
        while True:
            before = self._client.heard[SampleReport.__name__]
            identity = self._client.request(hello, Identity)
            if identity is not None:
                return identity
            booted = self._clock.now_ns() >= self._booted_ns
            if booted or self._client.heard[SampleReport.__name__] != before:
                raise open_errors.deaf(self._link.name)
            self._listen()

    def _check_identity(self, identity: Identity, firmware: str) -> None:
        name = self._link.name
        if identity.protocol_hash != PROTOCOL_HASH:
            raise open_errors.other_protocol(name, firmware, identity.protocol_hash)
        if identity.owned and identity.busy:
            raise open_errors.impossible(name, "that this host owns it and another one does")

    def _compare(self, found: Mapping[Parameter, int]) -> list[str]:
        """Hold the rig against the device, every difference at once; return what is worth a remark."""
        faults = differences(self._config, found)
        if faults:
            raise ConfigError(*faults)
        return remarks(self._config, found)

    def _check_round_trip(self) -> None:
        """Refuse a line on which every command would be too old: a USB adapter may collect bytes."""
        best, waited = math.inf, False
        for _ in range(_ROUND_TRIP_MEASUREMENTS):
            trip = self._client.time_answer(ParameterGet(Parameter.TICK), ParameterValue, _is_tick)
            best, waited = min(best, trip or math.inf), waited or trip is None
            if best <= _COMMAND_AGE_MAX_S + 1e-6 * self._config.period_us:
                break
        else:
            raise open_errors.slow(self._link.name, best)
        if waited:
            self._introduce()  # that may have cost the session

    def _check_alone(self) -> None:
        """Raise if a second device has the same node number; listen longer if the ticks are odd."""
        uniqueness = self._client.uniqueness
        if uniqueness.suspicious:
            self._client.listen(max(_TWIN_LISTEN_S, _TICK_DIFFERENCE_MAX * 1e-6 * self._config.period_us))
        if uniqueness.two_devices:
            raise open_errors.two_devices(self._link.name, self._config.node)

    def _check_cold(self) -> None:
        """Refuse a device that puts out a voltage before it is armed."""
        said = ""
        for _ in range(_HOT_SAMPLES):
            sample = self._client.receive_sample(ANSWER_TIMEOUT_S)
            if sample is None or sample.state == State.RUN or sample.voltage_mV == 0:
                return
            said = f"that it puts out {1e-3 * sample.voltage_mV:g} V and is not armed"
        raise open_errors.impossible(self._link.name, said)

    def _clearing(self) -> Clearing:
        return Clearing(
            self._link.name,
            self._client,
            self._clock,
            self._session,
            self._config.watchdog_ms,
            allowed=self._clear,
        )

    def _arm(self) -> None:
        """Answer SAMPLEs at 0 V until one says RUN."""
        deadline_ns = self._clock.now_ns() + int(1e9 * ANSWER_TIMEOUT_S)
        while self._clock.now_ns() < deadline_ns:
            sample = self._client.receive_sample(ANSWER_TIMEOUT_S)
            if sample is not None:
                self._say(arm=True)
                if sample.state == State.RUN:
                    return
        self._check_alone()
        sample = self._client.sample
        state = State(sample.state).name if sample and sample.state in set(State) else "an unknown state"
        raise open_errors.not_armed(self._link.name, state, ANSWER_TIMEOUT_S)

    def _say(self, *, arm: bool = False, release: bool = False) -> None:
        seq = self._client.tick & 0x1FFF
        self._client.send(Drive(0, seq, arm, False, release, self._session, self._config.watchdog_ms))

    def _join_ticks(self) -> None:
        """Find the whole tick of which SAMPLE shows the low byte; the caller counts on."""
        told = 0
        for _ in range(_TICK_JOIN_ATTEMPTS):
            told = self._parameters.get(Parameter.TICK)
            if self._client.receive_sample(ANSWER_TIMEOUT_S) is None:
                continue
            if _TICK_DIFFERENCE_MIN <= self._client.tick - told <= _TICK_DIFFERENCE_MAX:
                return
        raise open_errors.impossible(self._link.name, f"TICK = {told}, and its SAMPLEs have other ticks")


def _about(cleared: str) -> tuple[str, ...]:
    """Return a remark on the fault of an earlier run that was cleared."""
    if not cleared:
        return ()
    meaning = meaning_of(Fault[cleared]) if cleared in Fault.__members__ else meaning_of(Fault.UNKNOWN)
    sentence = f"The device was in fault {cleared} of an earlier run, which was cleared: {meaning.sentence}."
    return (f"{sentence} {meaning.remedy}",)


def _is_tick(answer: ParameterValue) -> bool:
    return answer.id == Parameter.TICK
