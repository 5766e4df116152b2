"""Quality of a link: counters, and the problems that they show."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

HEALTH_COUNTER_MAX = 255
"""Where the counters of HEALTH stop."""
_EVENTS_MIN = 10  # events that make a share worth a warning
_EVENTS_OF_LARGE_SHARE_MIN = 3  # events: enough if they are a large share of the periods, as in a short run
_LARGE_SHARE_MIN = 0.05  # of the periods


@dataclass(frozen=True, slots=True)
class DeviceCounters:
    """By how much the counters of HEALTH grew in a run.

    A device counts to 255 and stops there: where it has, these are lower bounds, and `full` is set.
    """

    crc_errors: int = 0  # frames that reached the device damaged
    sequence_gaps: int = 0  # DRIVEs refused for their age or order, and periods without a DRIVE
    ring_overruns: int = 0  # reports that were replaced because the line was blocked
    bus_offs: int = 0  # times the link went down
    late_ticks: int = 0  # ticks that the board was late for
    full: tuple[str, ...] = ()  # names of the counters that stand at 255


@dataclass(slots=True)
class LinkCounters:
    """Counts of errors on the link that the run survived."""

    samples: int = 0  # SAMPLEs that arrived, the device in RUN
    lost: int = 0  # SAMPLEs that never came
    stale: int = 0  # SAMPLEs that came too late, or twice
    skipped: int = 0  # SAMPLEs that were waiting behind a newer one
    corrupt: int = 0  # frames that arrived damaged: framing, length, CRC-16, crc8, CAN error frames
    missed: int = 0  # SAMPLEs that say: no command was accepted since the one before
    limited: int = 0  # SAMPLEs that say: the last command was clamped or slewed
    late: int = 0  # SAMPLEs that this computer fetched, or answered, more than half a period late
    device: DeviceCounters | None = None  # None before the device's HEALTH was heard twice
    clock_error: float | None = None  # device's clock against this computer's: 0.02 is 2 % fast

    def since(self, before: LinkCounters) -> LinkCounters:
        """Return what was added since a copy was made; the clock as it is."""
        names = [field.name for field in fields(self) if isinstance(getattr(self, field.name), int)]
        grown = {name: getattr(self, name) - getattr(before, name) for name in names}
        return replace(self, **grown, device=_growth(self.device, before.device))


_COUNTED_EVENTS = ("crc_errors", "sequence_gaps", "ring_overruns", "bus_offs", "late_ticks")


def _growth(now: DeviceCounters | None, before: DeviceCounters | None) -> DeviceCounters | None:
    if now is None or before is None:
        return now
    return replace(now, **{name: getattr(now, name) - getattr(before, name) for name in _COUNTED_EVENTS})


def growth(first: tuple[int, ...], last: tuple[int, ...]) -> DeviceCounters:
    """Compare two HEALTHs of a device.

    Parameters
    ----------
    first, last
        Their counters, in the order of the message. Counters that went back were reset with the device:
        they count from 0.
    """
    grown = {
        name: newer - older if newer >= older else newer
        for name, older, newer in zip(_COUNTED_EVENTS, first, last, strict=False)
    }
    full = tuple(
        name for name, newer in zip(_COUNTED_EVENTS, last, strict=False) if newer >= HEALTH_COUNTER_MAX
    )
    return DeviceCounters(**grown, full=full)


class Concern(NamedTuple):
    """Something about a link that a person should know."""

    cause: str  # one word that stays the same from release to release
    share: float  # of the periods, or of the clock
    text: str


def judge(counters: LinkCounters, most: float, most_clock: float) -> list[Concern]:
    """Return the problems of a link, the likely cause first.

    Parameters
    ----------
    counters
        Of a run, or of a part of it.
    most
        Share of the periods above which losses and damage are told; ten at least, or three where that is more
        than 5 % of the periods.
    most_clock
        Share by which the device's clock may be off.
    """
    periods = max(1, counters.samples + counters.lost)
    found = [
        _concern(cause, count, periods if cause != "samples_damaged" else counters.samples + count, text)
        for cause, count, text in _losses(counters)
        if count > most * periods
        and (
            count >= _EVENTS_MIN
            or (count >= _EVENTS_OF_LARGE_SHARE_MIN and count > _LARGE_SHARE_MIN * periods)
        )
    ]
    device = counters.device
    if device and device.bus_offs:
        found.append(Concern("bus_off", device.bus_offs / periods, _BUS_OFF.format(count=device.bus_offs)))
    error = counters.clock_error
    if error is not None and abs(error) > most_clock:
        way = "fast" if error > 0 else "slow"
        found.append(
            Concern("device_clock", error, _CLOCK_WARNING.format(share=_percent(abs(error)), way=way))
        )
    return found


def _concern(cause: str, count: int, of: int, text: str) -> Concern:
    share = min(1.0, count / of)  # noise makes several frames of one, and a device sends more than SAMPLEs
    return Concern(cause, share, text.format(count=count, share=_percent(share)))


def _losses(counters: LinkCounters) -> list[tuple[str, int, str]]:
    device = counters.device or DeviceCounters()
    unheard = max(0, counters.missed - counters.lost - counters.skipped - counters.late)
    damaged_up = "crc_errors" in device.full or 2 * device.crc_errors >= unheard
    return [
        ("commands_lost", 0 if damaged_up else unheard, _COMMANDS_WARNING),
        ("commands_damaged", max(device.crc_errors, unheard if damaged_up else 0), _DAMAGED_UP),
        ("samples_damaged", counters.corrupt, _DAMAGED_DOWN),
        # Where the end of a frame is damaged it takes the next one along.
        ("samples_lost", max(0, counters.lost - 2 * counters.corrupt), _SAMPLES_WARNING),
        ("line_too_slow", device.ring_overruns, _BLOCKED_WARNING),
        ("device_late", device.late_ticks, _LATE_WARNING),
    ]


def _percent(share: float) -> str:
    return f"{1e2 * share:.2g} %" if share < 0.1 else f"{1e2 * share:.0f} %"  # noqa: PLR2004


_COMMANDS_WARNING = (
    "{share} of the commands never reached the device, or came too old ({count} periods without one), though "
    "this computer sent them in time. Check the way from host to device: TX wire, adapter, input buffer."
)
_DAMAGED_UP = (
    "{share} of the commands reached the device damaged (at least {count}). Check cable, shield, ground and "
    "termination of the way from host to device, and the baud or bit rate."
)
_DAMAGED_DOWN = (
    "{share} of what the device sent arrived damaged ({count} frames). Check cable, shield, ground and "
    "termination of the way from device to host, and the baud or bit rate."
)
_SAMPLES_WARNING = (
    "{share} of the samples never arrived ({count}), and not because of damage. Check the way from device to "
    "host: adapter, buffers, another program on the same bus."
)
_BLOCKED_WARNING = (
    "{share} of the device's reports waited so long that newer ones replaced them ({count}). The line is too "
    "slow for this rate, or its reader was: raise the baud or bit rate, or lower loop.rate_hz."
)
_LATE_WARNING = (
    "The device was late for {share} of its ticks ({count}). Its processor is too slow for this rate, or "
    "something on the board blocks it: lower loop.rate_hz, or look at the firmware."
)
_BUS_OFF = "The device's link went down {count} times. Check connectors, and on CAN termination and bit rate."
_CLOCK_WARNING = (
    "The device's clock is {share} {way} against this computer's: velocities and times are wrong by as much. "
    "Check the timer's prescaler and the crystal's frequency in the firmware (a build for another board?)."
)
