"""The backend `sim-board`: host wire code, the firmware's own C and the plant, in one process."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Self

from dcmp_hil.config.backends import SimBoard
from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.errors import ConfigError
from dcmp_hil.wire.carriers import DECODERS, ENCODERS
from sim_backend.board.board import Board
from sim_backend.pacer import Pacer

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Truth
    from dcmp_hil.wire.frame import Frame


class SimBoardBackend(DeviceBackend):
    """A device that is the firmware's core in this process.

    Deterministic to the bit under a SimulatedClock, like the plain simulated rig; the bytes are real.

    Parameters
    ----------
    rig
        `[sim]` too.
    clock
        What paces the board.
    board
        One made already; by default a new one.
    link
        Makes the line to the board; by default one without faults.
    """

    simulated = True

    def __init__(
        self,
        rig: Rig,
        clock: Clock,
        board: Board | None = None,
        link: Callable[[Board, str, Pacer], BoardLink] | None = None,
    ) -> None:
        if not isinstance(rig.backend, SimBoard):
            raise ConfigError(f'backend.kind: got "{rig.backend.kind}"; expected "sim-board".')
        carrier, pacer = rig.backend.carrier, Pacer(clock, rig.period)
        self.board = board or Board(rig, carrier=carrier)
        super().__init__(rig, (link or BoardLink)(self.board, carrier, pacer), clock)

    def __enter__(self) -> Self:
        """Open the device, disarmed."""
        super().__enter__()
        self.remarks += self.board.pins.remarks
        return self

    def truth(self) -> Truth:
        """Return the true state at the last sample."""
        return self.board.truth()


class BoardLink:
    """Frames to and from a board, through the bytes of a carrier; waiting for one is what makes it tick.

    Parameters
    ----------
    board
        Made for the same carrier.
    carrier
        `cobs`, `slcan` or `can`.
    pace
        Of its ticks.
    """

    name = "sim-board"

    def __init__(self, board: Board, carrier: str, pace: Pacer) -> None:
        self._board, self._pace = board, pace
        self._ticks = 0
        self._frames: deque[Frame] = deque()
        self._receiver = DECODERS[carrier]() if carrier in DECODERS else None
        self._encode: Callable[[Frame], bytes] | None = ENCODERS.get(carrier)

    @property
    def corrupt(self) -> int:
        """Number of corrupt frames received so far."""
        return self._receiver.corrupt if self._receiver else 0

    other_carrier = ""  # the board has the carrier that the rig says

    @property
    def pending(self) -> bool:
        """Whether the board sent more in its last period than was looked at."""
        return bool(self._frames)

    def open(self) -> None:
        """Start the pace."""
        self._pace.start()
        self._ticks = 0

    def close(self) -> None:
        """Do nothing: a board ticks only while it is read."""

    def send(self, frame: Frame) -> None:
        """Pass a frame to the board."""
        if self._encode is None:
            self._board.receive_frame(*frame)
        else:
            self._board.receive(self._encode(frame))

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; where there is none and time to wait, the board ticks first."""
        frames = self._frames
        if not frames and timeout > 0.0:
            self._let_tick()
        if not frames:
            self._fetch()
        return frames.popleft() if frames else None

    def _let_tick(self) -> None:
        self._ticks += 1
        self._pace.wait_for(self._ticks)
        self._board.tick()

    def _fetch(self) -> None:
        if self._receiver is None:
            self._frames.extend(self._board.transmit_frames())
        elif data := self._board.transmit():
            self._frames.extend(self._receiver.feed(data))
