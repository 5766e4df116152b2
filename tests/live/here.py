"""A run in virtual time whose mailbox the test holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.control.change import Change
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.mailbox import Answer, Mailbox
from dcmp_hil.ipc.run_end import LIVES
from dcmp_hil.live.tunables import changed
from tests.helpers import HeldRun

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result
    from dcmp_hil.values import Sample


class Here:
    """A command process that is none: what it would do is done by the test, in this process."""

    def __init__(self) -> None:
        self.mailbox = Mailbox()
        self.last_words = ""
        self.signals, self.file, self.unattended = -1, None, None
        self.end = LIVES

    def open(
        self, rig: Rig, ring: int | None, warn: Callable[[str], None], further: tuple[str, ...] = ()
    ) -> None:
        """Nothing to start."""

    def wait_until_up(self, stopped: Callable[[], bool]) -> None:
        """Nothing to wait for."""

    def close(self, last_words: str, end: int) -> None:
        self.last_words, self.end = last_words, end


class ChangedRun:
    """The bench rig with changes at certain samples.

    Parameters
    ----------
    script
        By the number of the sample before which it is put: overrides, or a change as it is.
    overrides
        Of the bench rig.
    refusals
        Whether a change may be refused.
    """

    def __init__(
        self,
        script: Mapping[int, Sequence[str] | Change],
        *overrides: str,
        duration: float = 5.0,
        refusals: bool = False,
        **session: Any,
    ) -> None:
        self.control = Here()
        self.answers: list[Answer | None] = []
        self._numbers: list[int] = []
        self._script, self._refusals = script, refusals
        self.held = HeldRun(
            *overrides, duration=duration, on_read=self._read, control=self.control, **session
        )
        self.rig = self.held.session.rig

    def _read(self, k: int, sample: Sample) -> Sample:
        wanted = self._script.get(k)
        if wanted is None:
            return sample
        try:
            change = wanted if isinstance(wanted, Change) else self._checked(wanted)
        except ConfigError:
            if not self._refusals:
                raise
        else:
            self._numbers.append(self.control.mailbox.put(change))
        return sample

    def _checked(self, overrides: Sequence[str]) -> Change:
        self.rig, change = changed(self.rig, overrides)
        return change

    def run(self) -> Result:
        """Run to the end; the answer to the last change is kept."""
        result = self.held.run()
        self.answers = [self.control.mailbox.answer(number) for number in self._numbers[-1:]]
        return result
