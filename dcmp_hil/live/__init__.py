"""Changes while a run goes on: what may change, how it reaches the loop, and who may ask for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.ipc.mailbox import Mailbox
    from dcmp_hil.telemetry.summary_sink import SummarySink


class CommandInterface(Protocol):
    """Protocol of a process through which clients change a run."""

    @property
    def mailbox(self) -> Mailbox:
        """Mailbox that contains the requested changes."""
        ...

    @property
    def unattended(self) -> Callable[[SummarySink, int, str, str], None] | None:
        """Called in the telemetry process where the run's process has ended by force; it can be pickled.

        It is given the figures, the periods that are in none of them, and how the run ended: in a word that
        stays the same, and in a sentence.
        """
        ...

    @property
    def file(self) -> int | None:
        """Descriptor of the mailbox's memory, for other processes; None if it has none."""
        ...

    @property
    def signals(self) -> int:
        """Descriptor that takes the numbers of signals that ask for the end; -1 before `open`, or without."""
        ...

    def open(
        self, rig: Rig, ring: int | None, warn: Callable[[str], None], further: tuple[str, ...] = ()
    ) -> None:
        """Start the command process, without waiting until it is ready.

        Parameters
        ----------
        rig
            As it runs.
        ring
            Descriptor of the memory of the ring of periods; None if no other process may see it.
        warn
            Called, from any thread, if the command process no longer listens.
        further
            Names of the further fields of a row of the ring.
        """
        ...

    def wait_until_up(self, stopped: Callable[[], bool]) -> None:
        """Wait until it sees to the end of the run, before anything is armed; `stopped` ends the waiting."""
        ...

    def close(self, last_words: str, end: int) -> None:
        """Listen no longer: the run has ended, in words and as a code of `dcmp_hil.ipc.run_end`."""
        ...


__all__ = ["CommandInterface"]
