"""From the loop to every sink: rows into a ring, events beside it, and nothing that waits."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from dcmp_hil.control.model import UNKNOWN_MODEL
from dcmp_hil.ipc.ring import Ring
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.dispatcher import DispatchThread, Sink, SinkDispatcher
from dcmp_hil.telemetry.further_columns import NO_FURTHER_COLUMNS
from dcmp_hil.telemetry.link_events import LinkWatch
from dcmp_hil.telemetry.row_batches import RowBatches
from dcmp_hil.telemetry.signals import columns

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.control.model import Model
    from dcmp_hil.errors import TripError
    from dcmp_hil.telemetry.block import ReferenceAligner
    from dcmp_hil.telemetry.further_columns import FurtherColumns
    from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
    from dcmp_hil.values import Cycle, Event, Truth

__all__ = ["Recorder", "Sink"]

_SYNCHRONOUS_BLOCK_ROWS_MAX = 4096  # rows a block in virtual time, where no viewer waits, at most
_LARGE_BLOCK_ROWS = 1 << 14  # 2.9 MB: what numpy costs a call is a small share
_CAPACITY_ROWS = 1 << 15  # rows: 3 s at 10 kHz before a thread loses any
_END_TIMEOUT_S = 2.0  # s that the end of a run waits for the thread


class Recorder:
    """The loop's side of telemetry: `record` costs a microsecond and never waits.

    Parameters
    ----------
    truth
        Asked once a cycle for what a simulation knows.
    aligner
        Finds the reference at each sample's own instant.
    sinks
        Sinks in this process. One that raises is dropped, and an event says so; the run goes on.
    recent
        Cycles kept for the black box.
    in_line
        True in virtual time: `record` itself dispatches the blocks, so that none is ever lost and runs
        repeat to the bit. False: a thread does it, and rows are dropped and counted if it falls behind; no
        sinks, no thread.
    apart
        The telemetry process, with sinks of its own.
    model
        What the host believes of the plant.
    backend
        Whose counters are told of once a second, if it has a wire.
    further
        Further columns of each cycle.

    Attributes
    ----------
    recent
        The last cycles that came one by one.
    recent_further
        Their further columns.
    further
        Names of those.
    """

    def __init__(
        self,
        truth: Callable[[], Truth],
        aligner: ReferenceAligner,
        sinks: Sequence[Sink],
        *,
        recent: int,
        in_line: bool,
        apart: TelemetryProcess | None = None,
        model: Model = UNKNOWN_MODEL,
        backend: object = None,
        further: FurtherColumns = NO_FURTHER_COLUMNS,
    ) -> None:
        self._recent_max = recent
        self.recent: deque[Cycle] = deque(maxlen=recent)
        self.recent_further: deque[tuple[float, ...]] = deque(maxlen=recent)
        self.further = further.names
        self._apart, self._model = apart, model
        capacity = _SYNCHRONOUS_BLOCK_ROWS_MAX if in_line else _CAPACITY_ROWS
        self._ring = apart.ring if apart else Ring(capacity, further=further.names)
        self._source = further
        self._further = further.values if further.names else None
        self._push = self._ring.push
        self._truth = truth
        self._now = aligner.now
        self._audience = SinkDispatcher(self._ring.reader(), sinks, self.event, model)
        self.link = LinkWatch(backend, 1, self.event)
        self._look_at_link = self.link.look
        self._every = self._left = min(
            recent, _SYNCHRONOUS_BLOCK_ROWS_MAX
        )  # periods until what is done now and then
        self._in_line = in_line
        self._service = DispatchThread(self._audience) if sinks and not in_line else None
        self._closed = False
        self._batches: RowBatches | None = None

    def record(self, cycle: Cycle) -> None:
        """Write the values of one cycle into the ring; never block."""
        sample, _, reference, _, _, _ = cycle
        t = sample.t
        now, began = self._now(t, reference)
        if self._further is None:
            self._push(cycle, self._truth(), now, began)
        else:
            further = self._further(cycle)
            self._push(cycle, self._truth(), now, began, further)
            self.recent_further.append(further)
        self.recent.append(cycle)
        self._left -= 1
        if not self._left:
            self._do_now_and_then(t)

    def take_batches(self, *, large: bool = False) -> None:
        """Prepare for `extend` in place of `record`, in virtual time.

        Parameters
        ----------
        large
            Whether blocks may be larger than those of `record`: nothing looks at how the run is cut.
        """
        self._batches = self._audience.ring = RowBatches(self._recent_max, self.further)
        if large:
            self._every = self._left = _LARGE_BLOCK_ROWS

    @property
    def room(self) -> int:
        """Number of rows that `extend` takes at most: up to the end of the present block."""
        return self._left

    def extend(self, rows: NDArray[np.float64]) -> None:
        """Take the rows of cycles, shape (n, fields), 0 < n <= room; they must stay as they are."""
        assert self._batches is not None  # noqa: S101 - see take_batches
        self._batches.add(rows)
        self._left -= len(rows)
        if not self._left:
            self._do_now_and_then(self._batches.newest)

    def _do_now_and_then(self, t: float) -> None:
        self._left = self._every
        self._look_at_link(t)
        self._tell_further()
        if self._in_line:
            self._audience.dispatch()

    def event(self, event: Event) -> None:
        """Process an event."""
        self._audience.event(event)
        if self._apart:
            self._apart.event(event)

    def fill(self, trip: TripError) -> None:
        """Give a trip the last second of cycles."""
        cycles, further = (
            self._batches.recent() if self._batches is not None else (self.recent, self.recent_further)
        )
        trip.cycles = tuple(cycles)
        trip.further, trip.further_values = self.further, tuple(further) if self.further else ()

    def tell_rest(self) -> None:
        """Report what link and further columns have not told yet: the run has ended."""
        self.link.finish(self.t)
        self._tell_further()

    def _tell_further(self) -> None:
        for event in self._source.events():
            self.event(event)

    def last_columns(self) -> dict[str, NDArray[np.float64]]:
        """Return the columns of the last cycles, as many as the ring holds."""
        return columns(Block(self._ring.reader().drain(), self._model, self.further))

    @property
    def t(self) -> float:
        """Device time of the last cycle, s; 0 before the first."""
        if self._batches is not None:
            return self._batches.newest
        return self.recent[-1].sample.t if self.recent else 0.0

    @property
    def began(self) -> bool:
        """Whether there was a first cycle."""
        return self.written > 0

    @property
    def written(self) -> int:
        """Number of periods recorded so far."""
        return self._batches.written if self._batches is not None else self._ring.written

    @property
    def dropped(self) -> int:
        """Rows lost because the sinks were too slow; after `close`, those never dispatched as well."""
        ring = self._audience.ring
        return ring.dropped + (len(ring) if self._closed else 0)

    def close(self) -> None:
        """Dispatch what is left and close the sinks; wait for a stuck sink for 2 s at most."""
        self._closed = True
        if self._in_line:
            self._audience.finish()
            return
        if self._service:
            self._service.finish(_END_TIMEOUT_S)
        if self._apart:
            self._apart.close()
