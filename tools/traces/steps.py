"""Steps of a trace: played on a device and written down, or played again and compared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Drive, Hello, Parameter, ParameterSet, State, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.wire.frame import Frame

OUR_SESSION, OTHER_SESSION = 0x1234, 0x4321
FAULT, SAMPLE = 3, 4
REPORTED = (FAULT, SAMPLE)
"""Numbers of the messages that a trace has: IDENTITY and HEALTH have fields of the board's own."""
Step = dict[str, Any]
"""One of `tick` with `counts`, `frame`, `wait_us`, `line`; then `state`, `mV`, `enable` and `sent` after it.

A `line` has no `sent`."""


class Device(Protocol):
    """Protocol of a device in a trace."""

    @property
    def state(self) -> int:
        """State of the device, as in SAMPLE."""
        ...

    @property
    def applied_mV(self) -> int:
        """Output voltage of the amplifier, mV."""
        ...

    @property
    def enable(self) -> bool:
        """The amplifier's ENABLE."""
        ...

    def receive_frame(self, id: int, data: bytes, /) -> None:  # noqa: A002 - the identifier of a frame
        """Take a frame."""
        ...

    def transmit_frames(self) -> list[Frame]:
        """Return the frames that were sent since the last call."""
        ...

    def tick(self, counts: int, /) -> None:
        """Pass a period, the encoder showing `counts`."""
        ...

    def advance(self, us: int, /) -> None:
        """Advance time between two ticks."""
        ...

    def link(self, up: bool, /) -> None:
        """Set the link up or down."""
        ...


def shown(frame: Frame) -> str:
    """Return a frame as `identifier#payload`, in hex."""
    number, data = frame
    return f"{number:03X}#{data.hex().upper()}"


def read(text: str) -> Frame:
    """Return the frame that `shown` wrote."""
    number, _, data = text.partition("#")
    return int(number, 16), bytes.fromhex(data)


def play(device: Device, step: Step) -> Step:
    """Give a device what a step says; return the step with what the device then is."""
    if "tick" in step:
        device.tick(step["counts"])
    elif "frame" in step:
        device.receive_frame(*read(step["frame"]))
    elif "wait_us" in step:
        device.advance(step["wait_us"])
    else:
        device.link(step["line"] == "up")
    sent = [shown(frame) for frame in device.transmit_frames() if frame[0] >> 4 in REPORTED]
    given = {key: step[key] for key in ("tick", "counts", "frame", "means", "wait_us", "line") if key in step}
    then = {"state": State(device.state).name, "mV": device.applied_mV, "enable": int(device.enable)}
    return (
        given | then | ({} if "line" in step else {"sent": sent})
    )  # what waited for the line is the board's


def differences(device: Device, steps: Iterable[Step]) -> list[str]:
    """Play a trace on a device; say where it is not as the trace says, up to the first such step."""
    for number, step in enumerate(steps):
        found = play(device, step)
        wrong = [key for key in step if step[key] != found.get(key)]
        if wrong:
            return [f"step {number}: {key} is {found.get(key)}, the trace says {step[key]}" for key in wrong]
    return []


class Recorder:
    """A host that plays a scenario and writes it down.

    Parameters
    ----------
    device
        Just booted.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self.steps: list[Step] = []
        self.ticks = -1
        self.counts = 0

    def tick(self, moved: int = 0, times: int = 1) -> None:
        """Pass periods; the encoder moves by so many counts in each."""
        for _ in range(times):
            self.counts += moved
            self.ticks += 1
            self._play({"tick": self.ticks, "counts": self.counts % 2**24})

    def hello(self, session: int = OUR_SESSION) -> None:
        """Ask to own the device."""
        self._send(Hello(session, PROTOCOL_HASH), f"HELLO of {session:04X}")

    def drive(
        self,
        voltage_mV: int = 0,
        *,
        arm: bool = True,
        clear: bool = False,
        release: bool = False,
        back: int = 0,
        session: int = OUR_SESSION,
        ttl_ms: int = 50,
        spoilt: bool = False,
    ) -> None:
        """Answer the SAMPLE `back` ticks before the newest."""
        seq = (self.ticks - back) % 8192
        flags = "".join(
            f", {name}" for name, on in (("arm", arm), ("clear", clear), ("release", release)) if on
        )
        means = f"DRIVE {voltage_mV} mV, seq {seq}{flags}, ttl {ttl_ms} ms"
        message = Drive(voltage_mV, seq, arm, clear, release, session, ttl_ms)
        self._send(message, f"{means}, its crc8 wrong" if spoilt else means, spoilt=spoilt)

    def stop(self, reason: int) -> None:
        """Send STOP."""
        self._send(Stop(reason), f"STOP, reason {reason}")

    def put(self, parameter: Parameter, value: int, session: int = OUR_SESSION) -> None:
        """Set a parameter."""
        self._send(ParameterSet(session, parameter, value), f"PARAMETER_SET {parameter.name} {value}")

    def wait(self, us: int) -> None:
        """Advance time between two ticks."""
        self._play({"wait_us": us})

    def line(self, *, up: bool) -> None:
        """Set the link up or down."""
        self._play({"line": "up" if up else "down"})

    def arm(self) -> None:
        """From boot to RUN."""
        self.tick()
        self.hello()
        self.rearm()

    def rearm(self) -> None:
        """From IDLE to RUN, by the owner."""
        for _ in range(10):
            self.drive()
            self.tick()

    def run(self, ticks: int, voltage_mV: int = 0, moved: int = 0) -> None:
        """Answer each SAMPLE."""
        for _ in range(ticks):
            self.drive(voltage_mV)
            self.tick(moved)

    def _send(
        self, message: Drive | Hello | ParameterSet | Stop, means: str, *, spoilt: bool = False
    ) -> None:
        number, data = pack(message)
        if spoilt:
            data = data[:-1] + bytes([data[-1] ^ 0x55])
        self._play({"frame": shown((number, data)), "means": means})

    def _play(self, step: Step) -> None:
        self.steps.append(play(self._device, step))
