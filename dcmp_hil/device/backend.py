"""A device behind any link, as a backend: whole numbers on one side, radians and volts on the other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NoReturn, Self

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.device import open_errors
from dcmp_hil.device.client import SKIPPED_FRAMES_MAX, DeviceClient
from dcmp_hil.device.device_config import DeviceConfig
from dcmp_hil.device.disarm import DeviceEnd, DisarmSequence
from dcmp_hil.device.handshake import Handshake
from dcmp_hil.device.link_statistics import LinkStatistics
from dcmp_hil.device.run_state_exit import another_runs, why_left
from dcmp_hil.errors import BackendError, LinkError, TripError
from dcmp_hil.values import UNKNOWN_TRUTH, Fault, Sample, Truth
from dcmp_hil.wire.codec import CorruptFrameError, has_wrong_length, pack, unpack
from dcmp_hil.wire.link_diagnosis import judge
from dcmp_hil.wire.messages import Drive, FaultReport, Health, SampleReport, State, Stop, StopReason
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.config import Rig
    from dcmp_hil.device.links.base import Link
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.link_diagnosis import Concern, LinkCounters

_SEQUENCE_MASK = 0x1FFF
_RUN = int(State.RUN)
_HEALTHY = Fault.NONE  # found here faster than in its class
_MOST_mV = 32_767.0  # what 16 bits hold
_LOST_PERIODS_MAX = 127  # periods that a tick of 8 bits can bridge
_WATCHDOG_TIME_MAX_NS = 200_000_000  # after which any watchdog has acted
_SILENT_PERIODS, _SILENT_S = 10, 20e-3  # no sample for the longer of the two: the end


class DeviceBackend:
    """Reads SAMPLEs, writes DRIVEs, and leaves the amplifier at 0 V.

    Signs, counts per revolution and zero are applied in this class only. The device is the sample clock:
    `read` waits for its next frame.

    Parameters
    ----------
    rig
        Its `[backend]`, `[encoder]`, `[amplifier]` and `[loop]` tables are used.
    link
        Not yet open.
    clock
        Times the waiting.
    """

    def __init__(self, rig: Rig, link: Link, clock: Clock) -> None:
        self._config = config = DeviceConfig.of(rig)
        self._link, self._clock = link, clock
        self._node, self._period = config.node, rig.period
        self._patience_ns = int(1e9 * max(_SILENT_PERIODS * rig.period, _SILENT_S))
        self._open = False
        self._session = 0
        self._tick = self._first_tick = 0
        self._count = self._zero = self._hanging = 0
        self._has_count = False
        self._t = 0.0
        self._fault: int = Fault.NONE
        self._left = 0  # the fault that ended RUN
        self._ttl_ms = config.watchdog_ms
        self._memory = math.ceil(1e-3 * config.watchdog_ms / rig.period) + 2  # periods that a command holds
        self._bridge_ns = int(_LOST_PERIODS_MAX * 1e9 * rig.period)
        self._heard_ns = 0
        self._forgotten = False  # the device has ended our session, and another host may own it
        self._answered = 0  # tick of the SAMPLE that was answered last
        self._statistics = LinkStatistics(link, 1e9 * rig.period)
        self._rates = config.warn_share, config.warn_clock_share
        self.firmware = self._cleared = self._history = ""
        self.clear = False  # whether a person has said that a latched fault of every kind may be cleared
        self.remarks: tuple[str, ...] = ()  # what a person should know of this device
        self.device_end: DeviceEnd | None = None  # how it was left, as far as it said so

    def __enter__(self) -> Self:
        """Open the link, make the device ours, and arm it at 0 V.

        Raises
        ------
        OpenError
            If the link cannot be opened, or the device does not arm.
        ConfigError
            If the device is not what the rig says.
        """
        self._link.open()
        try:
            client = DeviceClient(self._link, self._clock, self._node)
            greeting = Handshake(self._link, client, self._config, self._clock, clear=self.clear).run()
        except BaseException:
            self._link.close()
            raise
        self._session, self.firmware = greeting.session, greeting.firmware
        self._cleared, self._history, self.remarks = greeting.cleared, greeting.history, greeting.remarks
        self._tick, self._hanging = greeting.tick, greeting.zero
        self._first_tick = greeting.tick + 1
        self._answered = greeting.tick
        self._heard_ns = self._clock.now_ns()
        self._statistics.start(greeting.tick, self._heard_ns, client.health)
        self._open = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Drive 0 V, disarm, wait for the echo, give the device back, close.

        After a trip that left no time for a ramp it is STOP, which the device keeps as a fault.

        Raises
        ------
        LinkError
            If the device did not confirm 0 V. Where something else was wrong before, that has it as a note.
        """
        if not self._open:
            return
        self._open = False
        try:
            self._leave(error)
        except BackendError as unconfirmed:
            if error is None:
                raise
            if not isinstance(error, BackendError):  # a link that broke says so again, in other words
                error.add_note(str(unconfirmed))
        finally:
            self._link.close()

    @property
    def counters(self) -> LinkCounters:
        """Return a copy of the counts of lost, late and damaged frames since the device was armed."""
        return self._statistics.counters

    @property
    def health(self) -> Health | None:
        """The newest HEALTH of the device."""
        return self._statistics.health

    def concerns(self, counters: LinkCounters) -> list[Concern]:
        """Return the problems that these counters show, by the rates of `[backend]`."""
        return judge(counters, *self._rates)

    @property
    def described(self) -> str:
        """Return the device's description of itself, once it is open."""
        cleared = f", its fault {self._cleared} was cleared" if self._cleared else ""
        firmware = f"firmware {self.firmware}, protocol {PROTOCOL_HASH:08x}"
        return f"{self._link.name}, node {self._node}, {firmware}, {self._history}{cleared}"

    def read(self) -> Sample:
        """Wait for the next SAMPLE and return the newest.

        Raises
        ------
        SampleTimeoutError
            If none came for 10 periods or 20 ms, whichever is longer; STOP was sent.
        LinkError
            If the link broke, or the backend is not open.
        """
        if not self._open:
            raise LinkError("The device is not open. Use it as a context manager: with backend: ...")
        last = self._tick
        report = self._next_report()
        _, voltage_mV, _, state, _, _, _ = report
        if state == _RUN and self._tick - self._answered > self._memory:
            raise open_errors.taken_over(self._link.name)
        position = (self._count - self._zero) * self._config.rad_per_count
        fault = _HEALTHY if state == _RUN else self._fault_in(report, last)
        # 0.09 us less than the constructor
        return make(Sample, (self._t, position, voltage_mV / self._config.mV_per_V, fault))

    def write(self, voltage: float) -> None:
        """Send a voltage, V; a number that is not finite is sent as 0 V."""
        asked_mV = voltage * self._config.mV_per_V
        if not -_MOST_mV <= asked_mV <= _MOST_mV:
            asked_mV = math.copysign(_MOST_mV, asked_mV) if math.isfinite(asked_mV) else 0.0
        sequence = self._tick & _SEQUENCE_MASK
        fields = (round(asked_mV), sequence, True, False, False, self._session, self._ttl_ms)
        drive = make(Drive, fields)  # 0.11 us less
        self._answered = self._tick
        self._link.send(pack(drive, self._node))
        self._statistics.answered(self._clock.now_ns())

    def truth(self) -> Truth:
        """Return NaN for every value: a real device has no access to the true state."""
        return UNKNOWN_TRUTH

    def _give_up_after(self, gap_ns: int) -> NoReturn:
        """Raise after a gap in which periods can no longer be counted; the device has its watchdog."""
        self._forgotten = gap_ns > _WATCHDOG_TIME_MAX_NS
        raise open_errors.stood_still(self._link.name, 1e-9 * gap_ns)

    def _next_report(self) -> SampleReport:
        """Wait for a SAMPLE; where several are waiting, the newest."""
        link, now_ns, newest = self._link, self._clock.now_ns, None
        began_ns = heard_ns = now_ns()
        damaged, stale = self._statistics.damaged, self._statistics.counts.stale
        if began_ns - self._heard_ns > self._bridge_ns:
            self._give_up_after(began_ns - self._heard_ns)
        while newest is None:
            left_ns = began_ns + self._patience_ns - heard_ns
            if left_ns <= 0:
                self._give_up(self._statistics.damaged - damaged, self._statistics.counts.stale - stale)
            frame = link.receive(1e-9 * left_ns)
            if frame is not None:
                newest = self._take(frame)
            heard_ns = now_ns()
        if link.pending and newest.state == _RUN:  # the end of a run is not skipped
            newest = self._newest_after(newest)
        self._heard_ns = heard_ns
        self._statistics.heard(self._tick, heard_ns)
        return newest

    def _newest_after(self, newest: SampleReport) -> SampleReport:
        for _ in range(SKIPPED_FRAMES_MAX):
            frame = self._link.receive(0.0) if newest.state == _RUN and self._link.pending else None
            if frame is None:
                break
            if (newer := self._take(frame)) is not None:
                self._statistics.counts.skipped += 1
                newest = newer
        return newest

    def _take(self, frame: Frame) -> SampleReport | None:
        """Return the SAMPLE in a frame if it is a new one; keep what else tells something."""
        try:
            message = unpack(frame, self._node)
        except CorruptFrameError:
            self._statistics.counts.corrupt += 1
            return None
        if type(message) is SampleReport:
            return self._taken(message)
        if type(message) is FaultReport:
            self._fault = message.code
        elif type(message) is Health:
            self._statistics.take_health(message)
        elif message is None and has_wrong_length(frame, self._node):
            self._statistics.counts.corrupt += 1
        return None

    def _taken(self, report: SampleReport) -> SampleReport | None:
        """Advance device time and position; lost samples show as a larger step, late ones as nothing."""
        last = self._tick
        counts, _, raw_tick, state, _, _, _ = report
        tick = unwrap(last, raw_tick, 8)
        if tick <= last:
            if state == _RUN:
                self._statistics.counts.stale += 1
                return None
            tick = last + 1  # a device that was reset counts anew
        self._statistics.counts.lost += tick - last - 1
        if state == _RUN:
            self._statistics.sample(report)
        self._tick = tick
        self._t = (tick - self._first_tick) * self._period
        if self._has_count:
            self._count = unwrap(self._count, counts, 24)
        else:
            self._start_counting(counts)
        return report

    def _start_counting(self, raw: int) -> None:
        self._has_count = True
        zero = self._config.zero
        self._zero = unwrap(0, self._hanging, 24) if zero is None else zero
        self._count = unwrap(self._zero, raw, 24)  # near the counter's wrap it matters

    def _fault_in(self, report: SampleReport, last: int) -> int:
        """Return the fault of a device that is not in RUN; `last` is the tick at which it was."""
        if not self._left:
            another = another_runs(self._link, self._clock, self._node, (last, report.tick), self._period)
            self._left = Fault.TWO_DEVICES if another else why_left(report, self._fault)
        return self._left

    def _give_up(self, damaged: int, stale: int) -> NoReturn:
        self._link.send(pack(Stop(StopReason.NO_SAMPLE), self._node))
        raise open_errors.no_sample(self._link.name, 1e-9 * self._patience_ns, damaged, stale)

    def _leave(self, error: BaseException | None) -> None:
        """Disarm the device; STOP comes first after a trip, alone after its error, last without an answer."""
        client = DeviceClient(self._link, self._clock, self._node, self._tick)
        if isinstance(error, BackendError):
            if not self._forgotten:
                client.send(Stop(StopReason.NO_SAMPLE))
            return
        if isinstance(error, TripError) and not error.orderly:
            client.send(Stop(StopReason.SUPERVISOR))
        sequence = DisarmSequence(client, self._clock, self._session, self._ttl_ms)
        self.device_end = sequence.run(answered=self._answered == self._tick)
        self._statistics.take_health(client.health)
        if self.device_end is None:
            client.send(Stop(StopReason.NO_SAMPLE))
            raise open_errors.not_confirmed(self._link.name, self._ttl_ms)
