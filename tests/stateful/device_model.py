"""A model of the device: docs/protocol.md, sections 5 to 8, with time in whole periods."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class State(IntEnum):
    """States of the device, numbered as in SAMPLE."""

    BOOT = 0
    IDLE = 1
    ARMING = 2
    RUN = 3
    FAULT = 4


B, N, A, R, F = State
ARM, ARM_LAST, DRIVE, DISARM, CLEAR, RELEASE = "arm", "arm last", "drive", "disarm", "clear", "release"
TICK, SILENCE, LINK_DOWN, LIMIT, CORRUPTION, STOP = "tick", "silence", "link", "limit", "corruption", "stop"

Table = dict[str, tuple[State, ...]]
NEXT: Table = {  # from BOOT, IDLE, ARMING, RUN, FAULT
    TICK: (N, N, A, R, F),
    ARM: (B, A, A, R, F),
    ARM_LAST: (B, A, R, R, F),
    DRIVE: (B, N, N, R, F),
    DISARM: (B, N, N, N, F),
    CLEAR: (B, N, N, N, N),
    RELEASE: (B, N, N, N, F),
    SILENCE: (B, N, N, F, F),
    LINK_DOWN: (B, N, N, F, F),
    LIMIT: (B, N, A, F, F),
    CORRUPTION: (B, N, A, F, F),
    STOP: (B, F, F, F, F),
}
"""In the order of enum dcmp_event."""


class Command(NamedTuple):
    """Content of a DRIVE."""

    session: int
    age: int = 0  # periods since the SAMPLE that it answers
    volts: bool = False
    flag: str = "arm"  # or clear, release, or nothing


class Device(NamedTuple):
    """What of a device decides what it does next."""

    state: State = State.BOOT
    owner: int = 0
    counted: int = 0
    lowered: bool = False
    fed: int = 0  # periods since the watchdog was, while it matters
    last: int = 0  # age of the newest command accepted in this session, or beyond reckoning
    asked: bool = False  # for a voltage other than 0
    out: bool = False  # puts one out
    up: bool = True  # the link


class Rules:
    """Transitions of the device model.

    Parameters
    ----------
    arming
        Commands to RUN.
    oldest
        Periods that a command may be old.
    watchdog
        Periods.
    table
        Of its states.
    """

    def __init__(self, arming: int, oldest: int, watchdog: int, table: Table = NEXT) -> None:
        self.arming, self.oldest, self.watchdog, self.table = arming, oldest, watchdog, table
        self.far = 2 * oldest + 1  # an age from which on it does not matter

    def boot(self) -> Device:
        """Return a device after a reset."""
        return Device(last=self.far)

    def tick(self, device: Device, *, limit: bool = False) -> Device:
        """Let a period pass."""
        fed = min(device.fed + 1, self.watchdog + 1) if device.state in (A, R) else 0
        device = device._replace(fed=fed, last=min(device.last + 1, self.far))
        device = self.event(device, TICK)
        if limit:
            device = self.event(device, LIMIT)
        device = self.guard(device)
        return device._replace(out=device.asked) if device.state == R else device

    def guard(self, device: Device) -> Device:
        """Look at watchdog and link."""
        if device.state in (A, R) and self.expired(device):
            device = self.event(device, SILENCE)
        return device if device.up else self.event(device, LINK_DOWN)

    def expired(self, device: Device) -> bool:
        """Whether the watchdog bites."""
        return device.fed > self.watchdog

    def event(self, device: Device, event: str) -> Device:
        """Follow the table, and keep what goes with a state."""
        state = self.table[event][device.state]
        if state != device.state or state not in (A, R, F):
            device = device._replace(state=state, counted=device.counted if state == A else 0)
        if state != F:
            device = device._replace(lowered=False)
        if state not in (A, R):
            device = device._replace(fed=0)
        return device if state == R else device._replace(asked=False, out=False)

    def link(self, device: Device, *, up: bool) -> Device:
        """Plug or unplug."""
        return self.guard(device._replace(up=up))

    def corrupt(self, device: Device) -> Device:
        """Hear ten corrupt frames."""
        return self.event(self.guard(device), CORRUPTION)

    def stop(self, device: Device) -> Device:
        """Return the device after a STOP."""
        return self.event(self.guard(device), STOP)

    def hello(self, device: Device, session: int) -> Device:
        """Return the device after a HELLO."""
        device = self.guard(device)
        if device.owner:
            return device
        return device._replace(owner=session, last=self.far, lowered=False)

    def lapse(self, device: Device) -> Device:
        """Forget an owner that has not been heard of for long."""
        return device if device.state in (A, R) else device._replace(owner=0, last=self.far)

    def accepts(self, device: Device, command: Command) -> bool:
        """Return whether the device accepts a command."""
        mine = command.session == device.owner != 0
        return device.state != B and mine and command.age <= self.oldest and command.age < device.last

    def command(self, device: Device, command: Command) -> Device:
        """Hear a DRIVE."""
        device = self.guard(device)
        if not self.accepts(device, command):
            return device
        close = device.last - command.age <= self.oldest
        device = self.event(device._replace(fed=0), self.classify(device, command, close=close))
        device = device._replace(last=command.age)
        if device.state == A:
            device = device._replace(counted=device.counted + 1)
        if device.state == R:
            device = device._replace(asked=command.volts)
        if device.state == F and command.flag != "clear":
            device = device._replace(lowered=True)
        return device._replace(owner=0, last=self.far) if command.flag == "release" else device

    def classify(self, device: Device, command: Command, *, close: bool) -> str:
        """Return the event of the table that a command is."""
        if command.flag == "release":
            return RELEASE
        if command.flag == "clear" and not command.volts and device.lowered:
            return CLEAR
        if command.flag != "arm":
            return DISARM
        if command.volts or (device.state == A and not close):
            return DRIVE
        return ARM if device.state != A or device.counted + 1 < self.arming else ARM_LAST
