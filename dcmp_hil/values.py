"""The one vocabulary: what travels between the stages of a cycle, a unit on every line."""

import math
from collections.abc import Mapping
from enum import IntEnum, StrEnum
from typing import Literal, NamedTuple


class Fault(IntEnum):
    """Fault code reported by the device; 0 is healthy, every other value stops the run."""

    NONE = 0
    HOST_SILENT = 1  # the device heard no valid command for longer than its watchdog allows
    LINK_DOWN = 2  # the line hung up, or the bus went off
    STOPPED = 3  # STOP was sent
    CORRUPT_LINK = 4  # 10 of the last 100 frames were damaged
    OVER_SPEED = 5
    OVER_TRAVEL = 6
    ENCODER_JUMP = 7
    BREAK_INPUT = 8  # the amplifier's own protection
    INTERNAL = 9  # the board found something wrong with itself
    TWO_DEVICES = 253  # two devices send under one node; never on the wire
    DISARMED = 254  # the device left RUN without a fault, as after a reset; never on the wire
    UNKNOWN = 255  # a code that this version does not know: treated like any other fault


class Sample(NamedTuple):
    """Measurement of the device at one instant."""

    t: float  # s, device time since opening, unwrapped: lost samples show as a larger step
    position: float  # rad, unwrapped; 0 = hanging at rest
    voltage: float  # V, really applied over the period that ended at t
    fault: int = Fault.NONE  # a Fault; a plain int is accepted so that an unknown code survives


class Estimate(NamedTuple):
    """Estimate of the observer at the instant of the sample."""

    position: float  # rad
    velocity: float  # rad/s
    disturbance: float  # rad/s2, the w of eq. (2)


class Truth(NamedTuple):
    """True state of the simulated plant, hidden from the loop; NaN on a real rig."""

    position: float  # rad
    velocity: float  # rad/s
    disturbance: float  # rad/s2, by the model's f0 and ku/J


class Reference(NamedTuple):
    """Desired position, velocity and acceleration at one instant."""

    position: float  # rad
    velocity: float  # rad/s
    acceleration: float  # rad/s2


class Timing(NamedTuple):
    """When one period really ran, by the host's monotonic clock."""

    period: float  # s, from the previous sample's arrival to this one's
    lateness: float  # s, arrival after the instant that the first sample and device time promise
    compute: float  # s, from the sample's arrival to the command's departure


class Cycle(NamedTuple):
    """Values of one complete cycle, as telemetry and the black box get them."""

    sample: Sample
    estimate: Estimate
    reference: Reference  # at sample.t + delay, when this period's command takes effect
    demand: float  # V, what the controller asked for
    voltage: float  # V, what the supervisor let through
    timing: Timing


class EventKind(StrEnum):
    """Kinds of events. Programs read kind and data; the text is for people, and no program reads it."""

    HOST = "host"  # the computer
    GRANT = "grant"  # what the operating system granted, or refused
    DEVICE = "device"  # which device answered, and what it remarked
    PHASE = "phase"
    PROBE = "probe"  # what the probe found of the motor
    LIMIT = "limit"  # a limit acts
    LINK = "link"  # counters, once a second
    LINK_CONCERN = "link_concern"  # what the counters mean, each cause once
    CHANGE = "change"  # made while the run went on
    CONTROL = "control"  # a change that failed, or live changes that are not possible any more
    TELEMETRY = "telemetry"  # what of telemetry the run goes on without
    LOWERING = "lowering"  # the way down begins with the next cycle
    TRIP = "trip"
    DEADLINE = "deadline"
    DEVICE_END = "device_end"  # the device ended the run by a fault of its own
    END = "end"  # where the amplifier is after the run, and what ended it by force
    OTHER = "other"  # read from a recording of another version


class PhaseData(NamedTuple):
    """Data of an event of kind PHASE."""

    phase: str  # a value of `dcmp_hil.safety.supervisor.Phase`


class ProbeData(NamedTuple):
    """Data of an event of kind PROBE."""

    gain_rad_s2_V: float
    deviation_rad_s2_V: float
    ratio: float  # measured over believed


class LimitData(NamedTuple):
    """Data of an event of kind LIMIT."""

    limit: str  # reference, velocity, acceleration, way, voltage or slew


class LinkData(NamedTuple):
    """Data of an event of kind LINK."""

    counters: Mapping[str, int]  # by the names of `dcmp_hil.telemetry.link_events`; without what was not told


class ChangeData(NamedTuple):
    """Data of an event of kind CHANGE."""

    values: Mapping[str, float | str]  # new values by dotted key, to the bit


class CauseData(NamedTuple):
    """Data of an event of kind TRIP, DEADLINE or LINK_CONCERN."""

    cause: str  # a word that stays the same from release to release


class EndData(NamedTuple):
    """Data of an event of kind END where a run did not end as it was asked to; None where it did."""

    cause: str  # the reason of a trip, "deadline", or the class of the error
    words: str  # the error's own, for people


EventData = PhaseData | ProbeData | LimitData | LinkData | ChangeData | CauseData | EndData

DATA: Mapping[EventKind, type[EventData]] = {
    EventKind.PHASE: PhaseData,
    EventKind.PROBE: ProbeData,
    EventKind.LIMIT: LimitData,
    EventKind.LINK: LinkData,
    EventKind.LINK_CONCERN: CauseData,
    EventKind.CHANGE: ChangeData,
    EventKind.TRIP: CauseData,
    EventKind.DEADLINE: CauseData,
    EventKind.END: EndData,
}
"""What the data of each kind are; events of every other kind have none."""
OPTIONAL_DATA = frozenset({EventKind.END})
"""Kinds whose events may be without data."""

Level = Literal["DEBUG", "INFO", "WARN", "ERROR"]


class Event(NamedTuple):
    """Something worth a line of text."""

    t: float  # s, device time
    level: Level
    kind: EventKind
    text: str
    data: EventData | None = None  # as DATA says


UNKNOWN_TRUTH = Truth(math.nan, math.nan, math.nan)
