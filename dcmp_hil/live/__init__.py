"""Changes while a run goes on: what may change, how it reaches the loop, and who may ask for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.live.mailbox import Mailbox


class Control(Protocol):
    """Who may change a run: what a session asks of it."""

    @property
    def mailbox(self) -> Mailbox:
        """Where changes come from."""
        ...

    def open(self, rig: Rig, ring: int | None, warn: Callable[[str], None]) -> None:
        """Begin to listen; must not wait.

        Parameters
        ----------
        rig
            As it runs.
        ring
            Descriptor of the memory of the ring of periods; None if nobody else may see it.
        warn
            Told if nobody listens any more; called from any thread.
        """
        ...

    def close(self, last_words: str) -> None:
        """Listen no longer, the run having ended like this."""
        ...


__all__ = ["Control"]
