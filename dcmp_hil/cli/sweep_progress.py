"""Progress of a sweep: a bar on a terminal, a few lines elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, Progress, TextColumn

from dcmp_hil.cli import console
from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.sweeping.sweep import Progress as SweepState

_TOLD_FROM = 0.05  # of what is to be run: before that, a time left would be a guess
_LINES = 4  # where there is no terminal


class SweepProgress:
    """Shows how far a sweep is.

    Attributes
    ----------
    began
        Whether anything was shown.
    """

    def __init__(self) -> None:
        self._bar = Progress(
            TextColumn("{task.completed:,.0f} of {task.total:,.0f} runs"),
            BarColumn(bar_width=None),
            TextColumn("{task.percentage:3.0f} %  {task.description}"),
            console=console.err,
            transient=True,
            expand=True,
            disable=not console.err.is_terminal,
        )
        self._task = self._bar.add_task("", total=1.0)
        self._clock = MonotonicClock()
        self._began_ns = 0
        self._runs = self._total = self._lines = 0
        self.began = False

    @property
    def words(self) -> str:
        """Number of runs that are kept, in words."""
        return (
            f"{self._runs:,} of {self._total:,} runs are kept" if self.began else "nothing was run: no runs"
        )

    def __enter__(self) -> Self:
        """Make room for the bar, which appears with the first state."""
        console.take_width(console.err)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        self._bar.stop()

    def show(self, state: SweepState, total: int) -> None:
        """Show a state of the sweep, whose runs are `total`."""
        if not self.began:
            self.began, self._began_ns = True, self._clock.now_ns()
            if state.found:
                console.note(f"{state.found:,} of {total:,} runs are there already")
        self._runs, self._total = state.runs, total
        seconds = 1e-9 * (self._clock.now_ns() - self._began_ns)
        told = speed_and_rest(state.runs - state.found, total - state.found, seconds)
        self._bar.update(self._task, completed=state.runs, total=total, description=told)
        self._bar.start()
        line = _LINES * (state.runs - state.found) // max(1, total - state.found)
        if not console.err.is_terminal and line > self._lines:
            self._lines = line
            console.note(f"{state.runs:,} of {total:,} runs, {told}")


def speed_and_rest(done: int, wanted: int, seconds: float) -> str:
    """Return the speed so far and the time left by it, in words; nothing before 5 % are done."""
    if done < _TOLD_FROM * wanted or not done or seconds <= 0.0:
        return ""
    speed = done / seconds
    rest = (wanted - done) / speed
    return f"{speed:,.3g} runs/s, {_time(rest)} left" if done < wanted else f"{speed:,.3g} runs/s"


def _time(seconds: float) -> str:
    """Return a time in the largest unit of which it has two at least."""
    for unit, name in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * unit:
            return f"{seconds / unit:.1f} {name}"
    return f"{seconds:.0f} s"
