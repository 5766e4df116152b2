"""Data for one outlet: frames of its own, in blocks of a suitable length."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.rerun.blueprint import dashboard
from dcmp_hil.telemetry.rerun.entity_columns import Frames
from dcmp_hil.telemetry.rerun.font_text import drawable
from dcmp_hil.values import EventKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rerun.entity_columns import Call
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.telemetry.rerun.stream_worker import StreamWorker
    from dcmp_hil.values import Event

_PIECE_TIME_S = 1.0  # s: axes and marks follow the run in steps of that length at most


class Feed:
    """Turns a run into jobs of an outlet.

    A chunk of a recording costs 1.6 kB beside its numbers, so a file is written in longer blocks than those
    that a viewer needs to look alive.

    Parameters
    ----------
    outlet
        Who does the jobs.
    rig
        What is shown of it.
    span
        s of a run that are sent at once; 0 sends each block as it comes.
    again
        s after which what is sent once is sent again: a server forgets what is old.
    """

    def __init__(
        self, outlet: StreamWorker, rig: RigView, span: float = 0.0, again: float = math.inf
    ) -> None:
        self.outlet = outlet
        self._frames = Frames(rig)
        self._rig = rig
        self._span, self._period = span, rig.period
        self._again = self._due = again
        self._waiting: list[Block] = []

    def block(self, block: Block) -> bool:
        """Send consecutive cycles, at least one, or keep them until there are enough.

        Returns
        -------
        bool
            False if the outlet is stuck.

        Raises
        ------
        Exception
            The exception that an earlier job raised.
        """
        self._waiting.append(block)
        if block["t"][-1] + 1.5 * self._period - self._waiting[0]["t"][0] < self._span:
            return True
        return self.send_rest()

    def event(self, event: Event) -> bool:
        """Send an event, behind the periods before it; see `block`."""
        on = event.kind is EventKind.LINK or self.send_rest()  # what an event changes is drawn from there on
        shown = event._replace(text=drawable(event.text))  # Arrow takes no surrogates, as paths have them
        tripped = self._frames.tripped
        on = on and self.outlet.do(partial(send, self._frames.of_event(shown)))
        if self._frames.tripped and not tripped:
            on = on and self.outlet.do(partial(_show_trip, self._rig))
        return on

    @property
    def tripped(self) -> bool:
        """Whether the layout of a run that has tripped was sent."""
        return self._frames.tripped

    def send_rest(self) -> bool:
        """Send the blocks that wait; see `block`."""
        if not self._waiting:
            return True
        block = _joined(self._waiting)
        self._waiting = []
        calls = [call for piece in self._cut(block) for call in self._frames.of_block(piece)]
        t = float(block["t"][-1])
        if t >= self._due:
            self._due = t + self._again
            calls += self._frames.of_once(t)
        return self.outlet.do(partial(send, calls))

    def finish(self) -> bool:
        """Send the blocks that wait, and what stands behind the last one; see `block`."""
        return self.send_rest() and self.outlet.do(partial(send, self._frames.of_end()))

    def _cut(self, block: Block) -> list[Block]:
        """Cut what is longer than a second, as in virtual time, into pieces of about a second."""
        pieces = max(1, round(len(block) * self._period / _PIECE_TIME_S))
        return [block.with_rows(rows) for rows in np.array_split(block.rows, pieces)]


def send(calls: Sequence[Call], stream: rr.RecordingStream) -> None:
    """Send the columns of a block to a stream of Rerun."""
    for entity, times, columns in calls:
        if isinstance(columns, rr.SeriesLines):
            stream.log(entity, columns, static=True)
        else:
            stream.send_columns(entity, times, columns)


def _show_trip(rig: RigView, stream: rr.RecordingStream) -> None:
    """Send the layout of a run that has tripped; it replaces once what the user had arranged."""
    stream.send_blueprint(dashboard(rig, tripped=True))


def _joined(blocks: list[Block]) -> Block:
    if len(blocks) == 1:
        return blocks[0]
    return blocks[0].with_rows(np.concatenate([block.rows for block in blocks]))
