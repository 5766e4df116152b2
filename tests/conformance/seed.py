"""The healthy device of which every device with an error is made."""

from __future__ import annotations

from tests.contract.reference_device import ReferenceDevice

Frames = list[tuple[int, bytes]]


class Seed(ReferenceDevice):
    """A device that is built like the healthy one, and changed by `sow`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.sow()

    def sow(self) -> None:
        """Change the object after its constructor."""


Row = tuple[type[Seed], str, str]
"""A device, a carrier, and the check that must find what is wrong with it."""
