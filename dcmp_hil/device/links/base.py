"""Protocol of a link: it sends and receives frames, and does not interpret them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame


class Link(Protocol):
    """A way for frames: CAN, serial or simulated.

    Its own failures are OpenError and LinkError; no exception of a library gets past it.
    """

    name: str
    """What to call it in a sentence, such as `/dev/ttyACM0`."""

    @property
    def corrupt(self) -> int:
        """Number of corrupt frames received so far."""
        ...

    @property
    def other_carrier(self) -> str:
        """Settings that fit what was heard better than this link's own; empty where nothing says so."""
        ...

    @property
    def pending(self) -> bool:
        """Whether more may be there than what `receive` returned last; never False where there is."""
        ...

    def open(self) -> None:
        """Open the link for exclusive use."""
        ...

    def close(self) -> None:
        """Close the link; closing a closed link does nothing."""
        ...

    def send(self, frame: Frame) -> None:
        """Send a frame, or drop it if there is no room; never block."""
        ...

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; None if none came within about `timeout` (s). 0 only looks what is there."""
        ...
