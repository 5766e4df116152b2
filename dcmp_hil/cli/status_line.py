"""The live status line of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.live import Live
from rich.text import Text

from dcmp_hil.telemetry.statistics import Durations
from dcmp_hil.values import PhaseData

if TYPE_CHECKING:
    from rich.console import Console

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

_WARNING_STYLE = "yellow"


class StatusLine:
    """A sink that shows the newest cycle on one line, and events above it.

    Parameters
    ----------
    console
        Where to; nothing live is drawn unless it is a terminal, events are printed anyway.
    period
        s, nominal, to tell which samples are late.
    """

    def __init__(self, console: Console, period: float) -> None:
        self._console = console
        self._period = period
        self._phase = ""
        self._late = 0
        self._lateness = Durations()
        self._live: Live | None = None

    def block(self, block: Block) -> None:
        """Show the last of these periods."""
        self._late += int((block["lateness"] > 0.5 * self._period).sum())
        if not self._console.is_terminal:
            return
        self._lateness.add(block["lateness"])
        if self._live is None:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        self._live.update(self._line(block), refresh=True)

    def event(self, event: Event) -> None:
        """Print warnings; remember the phase. An error is the run's end, which says it itself, once."""
        if isinstance(event.data, PhaseData):
            self._phase = event.data.phase
        elif event.level == "WARN":
            self._console.print(Text(f"{event.t:8.3f} s  {event.text}", style=_WARNING_STYLE))

    def close(self) -> None:
        """Remove the status line; the summary follows."""
        if self._live is not None:
            self._live.stop()

    def _line(self, block: Block) -> Text:
        lateness = self._lateness.percentiles()
        parts = (
            f"{block['t'][-1]:8.2f} s",
            f"{self._phase:8}",
            f"position {block['position'][-1]:+7.3f} rad",
            f"error {1e3 * block.tracking_error[-1]:+7.2f} mrad",
            f"voltage {block['voltage_sent'][-1]:+6.2f} V",
            f"w {block['disturbance_estimate'][-1]:+7.2f} rad/s²",
            f"late {self._late}",
            f"lateness {lateness.p99:.0f} µs p99, {lateness.max:.0f} max",
        )
        return Text("  ".join(parts), no_wrap=True, overflow="crop")
