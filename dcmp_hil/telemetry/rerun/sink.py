"""The dashboard: a run as a Rerun recording, live in a viewer, in a file, or both."""

from __future__ import annotations

import atexit
import os
from functools import partial
from typing import TYPE_CHECKING, Literal
from uuid import uuid4

import rerun as rr

from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.disk_space import kept_for_data, room_for, short_of
from dcmp_hil.platform.display import display_problem
from dcmp_hil.platform.other_users import StrangerWatch
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.dashboard_warnings import (
    NO_ROOM,
    NO_WINDOW,
    OTHER_USERS_WARNING,
    incomplete,
    spared,
    stuck,
)
from dcmp_hil.telemetry.rerun.feed import Feed
from dcmp_hil.telemetry.rerun.optimised_file import optimise
from dcmp_hil.telemetry.rerun.recording_start import begin, warm_up
from dcmp_hil.telemetry.rerun.stream_worker import StreamWorker
from dcmp_hil.telemetry.rerun.text_stream import TextStream

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.values import Event

    Viewer = Literal["spawn", "web", "serve", "connect", "none"]

_SERVER_START_TIMEOUT_S = 60.0  # s, a far limit: that it listens is an event, and nothing is armed yet
_CLOSE_TIMEOUT_S = 12.0  # s, for all of it; long enough for a window that is still opening
_VIEWER_FLUSH_TIMEOUT_S = 1.5
"""Seconds, for a viewer that was there before: if it is frozen, the last call never returns."""
_FILE_TIMEOUT_S = 30.0  # s, for a disk that is slow
_SERVER_MEMORY_LIMIT = "64MiB"
"""Of what late viewers get: two minutes at 1 kHz; what is sent once comes again."""
_RESEND_PERIOD_S = 10.0  # s
_FILE_BLOCK_DURATION_S = 1.0  # s of a run that go into a file at once
_VIEWER_TIMEOUT_S = 5.0  # s, for a viewer that is
_OPTIMISE_TIMEOUT_S = 5.0  # s, for a file that is whole already
_BLOCK_BYTES = 300e3  # bytes: a second of a file at 1 kHz, which is written behind the look at the disk
_START_DATA_BYTES = 400e3  # bytes: scenery and layout are 250 kB


class RerunSink:
    """Sends a run to a viewer, to a file, or to both; what the viewer does never reaches the file.

    The pendulum hangs down at 0, and a positive angle turns it counter-clockwise. Rerun's own wait at the
    end of the process, which a frozen viewer makes endless, is replaced by `close`.

    Parameters
    ----------
    rig
        What the viewer is told about the rig.
    record
        The .rrd file; None for none.
    viewer
        ``spawn`` opens a window; ``serve`` waits for viewers that come and go, and so does ``web``, whose
        pages another process serves; ``connect`` sends to the viewer that listens on 127.0.0.1:9876.
    application
        Recordings of the same application share the viewer's layout.
    port
        First port tried for the recording's own server, on 127.0.0.1 only (``spawn``, ``serve``, ``web``).
    spare
        Whether the file ends, with a warning, while its disk still has room for the data of the run.
    history
        What late viewers get at most, such as ``64MiB``.
    optimised
        Whether `close` rewrites the file with a footer and longer chunks, if that takes 5 s at most, beside
        what the disk takes to have it.

    Attributes
    ----------
    warnings
        One sentence for each thing asked for that the run goes on without; a viewer that stops taking what
        it is sent adds one later.
    port
        Of the recording's own server; None where there is none.

    Raises
    ------
    ConfigError
        If the file cannot be created, or there is no room for what stands at its beginning.
    """

    def __init__(
        self,
        rig: RigView,
        record: Path | None,
        viewer: Viewer,
        application: str = "dcmp-hil",
        port: int = window.VIEWER_PORT,
        *,
        spare: bool = False,
        history: str = _SERVER_MEMORY_LIMIT,
        optimised: bool = False,
    ) -> None:
        self.warnings: list[str] = []
        self.port: int | None = None
        self._watch: StrangerWatch | None = None
        self._window: subprocess.Popen[bytes] | None = None
        self._rig = rig
        self._feeds: list[Feed] = []
        self._needed = kept_for_data(record) if record is not None and spare else 0.0
        self._application, self._recording = application, str(uuid4())
        self._history = history
        self._optimised = optimised
        rr.unregister_shutdown()
        if record is not None:
            self._open_file(record)
        if viewer == "connect":
            self._connect()
        elif viewer == "spawn":
            self._spawn(port)
        elif viewer != "none":
            self._serve(port)
        atexit.register(self.close)

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        if not len(block):
            return
        self._spare()
        self._keep_to_ourselves()
        self._tell(lambda feed: feed.block(block))
        if self._window and (code := self._window.poll()) is not None:
            self._window = None
            if code:  # closed by the user it is 0
                self.warnings.append(NO_WINDOW.format(code=code, port=self.port))

    def event(self, event: Event) -> None:
        """Process an event."""
        self._tell(lambda feed: feed.event(event))

    def close(self) -> None:
        """Write what is left, and give up after 12 s at most; a second call waits for the first."""
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(_CLOSE_TIMEOUT_S * 1e9)
        atexit.unregister(self.close)
        faults: list[str] = []
        whole: list[Feed] = []
        self._tell(Feed.finish)
        for feed in self._feeds:
            try:
                feed.outlet.close(max(0, end_ns - clock.now_ns()) * 1e-9)
            except Exception as error:  # noqa: BLE001 - the others are to be closed all the same
                faults.append(incomplete(feed.outlet, str(error)))
            else:
                whole.append(feed)
        for feed in whole:  # no viewer waits for it
            # Rerun writes the layouts of a file in an order of chance, and the last one is shown.
            if self._optimised and not feed.tripped and (file := feed.outlet.written()):
                left = max(0, end_ns - clock.now_ns()) * 1e-9
                optimise(file, min(left, _OPTIMISE_TIMEOUT_S), self._needed)
        if faults:
            raise RuntimeError(faults[0])

    def _tell(self, give: Callable[[Feed], bool]) -> None:
        for feed in tuple(self._feeds):
            try:
                sentence = "" if give(feed) else stuck(feed.outlet)
            except Exception as error:  # noqa: BLE001 - one outlet that fails is no reason to lose the other
                feed.outlet.leave()
                sentence = f"{incomplete(feed.outlet, str(error))} The run goes on."
            if sentence:
                self._feeds.remove(feed)
                self.warnings.append(sentence)

    def _spare(self) -> None:
        """End the file while there is room for the run's data, which comes before its picture."""
        for feed in tuple(self._feeds):
            file = feed.outlet.file
            if file is not None and self._needed and short_of(file, self._needed + _BLOCK_BYTES):
                feed.outlet.drop()
                self._feeds.remove(feed)
                self.warnings.append(spared(file, "ends here", self._needed))

    def _keep_to_ourselves(self) -> None:
        """End the server where another user is connected to it: Rerun does not authenticate its clients."""
        if self._watch is None or not (users := self._watch.look()):
            return
        self.warnings.append(OTHER_USERS_WARNING.format(user=users[0], port=self.port))
        self.port = self._watch = None
        for feed in [one for one in self._feeds if one.outlet.file is None]:
            feed.outlet.farewell = lambda: None
            feed.outlet.leave()
            self._feeds.remove(feed)

    def _stream(self) -> TextStream:
        return TextStream(self._application, self._recording)

    def _open_file(self, record: Path) -> None:
        try:
            record.open("wb").close()
        except OSError as error:
            raise ConfigError(
                f"{record}: {error.strerror or error}. Choose a file for the recording that you may write, "
                "in a folder that exists."
            ) from None
        if self._needed and short_of(record, self._needed + _START_DATA_BYTES):
            record.unlink(missing_ok=True)
            self.warnings.append(spared(record, "is not written", self._needed))
            return
        room = room_for(record)
        if room < _START_DATA_BYTES:  # Rerun waits for ever where the disk fills up while it begins
            raise ConfigError(
                NO_ROOM.format(file=record, room=1e-3 * room, beginning=1e-3 * _START_DATA_BYTES)
            )
        outlet = StreamWorker(self._stream(), _FILE_TIMEOUT_S, _CLOSE_TIMEOUT_S, file=record)
        outlet.do(partial(warm_up, self._rig))
        # A footer would take memory for every chunk for as long as the run goes on: 25 MB a minute.
        outlet.do(partial(begin, rr.FileSink(record, write_footer=False), self._rig))
        try:
            begun = outlet.settle(_FILE_TIMEOUT_S)
        except RuntimeError as error:  # a file that can be opened, on a disk that is full
            outlet.leave()
            raise ConfigError(f"The recording cannot begin: {error}. Free some space.") from None
        if not begun:
            outlet.leave()
            raise ConfigError(f"The recording cannot begin: {record} does not grow. Free some space.")
        self._feeds.append(Feed(outlet, self._rig, _FILE_BLOCK_DURATION_S))

    def _open_viewer(self, target: rr.GrpcSink | rr.GrpcServerSink, ending: float) -> StreamWorker:
        outlet = StreamWorker(self._stream(), _VIEWER_TIMEOUT_S, ending)
        outlet.do(partial(warm_up, self._rig))
        outlet.do(partial(begin, target, self._rig))
        self._feeds.append(Feed(outlet, self._rig, again=_RESEND_PERIOD_S))
        return outlet

    def _connect(self) -> None:
        if window.speaks_http2(window.VIEWER_PORT):
            self._open_viewer(rr.GrpcSink(window.proxy_url(window.VIEWER_PORT)), _VIEWER_FLUSH_TIMEOUT_S)
            return
        self.warnings.append(
            f"No viewer answers on 127.0.0.1:{window.VIEWER_PORT}; the run goes on without one. "
            "Start it first with: rerun --bind 127.0.0.1"
        )

    def _spawn(self, first_port: int) -> None:
        problem = display_problem()
        if problem:
            self.warnings.append(
                f"No window was opened: {problem}. See the recording afterwards, or use --viewer serve."
            )
            return
        outlet = self._serve(first_port)
        if outlet is not None and self.port is not None:
            self._open_window(outlet, self.port)

    def _serve(self, first_port: int) -> StreamWorker | None:
        """Serve viewers, which may connect at any time; a late one gets the earlier data."""
        for port in window.free_ports(first_port):
            target = rr.GrpcServerSink(
                window.LOOPBACK, port, server_memory_limit=self._history, newest_first=True
            )
            outlet = self._open_viewer(target, _CLOSE_TIMEOUT_S)
            if window.serves(port, os.getpid(), _SERVER_START_TIMEOUT_S):
                self.port, self._watch = port, StrangerWatch(port)
                outlet.farewell = partial(window.let_viewers_catch_up, port)
                return outlet
            outlet.leave()  # another process took the port first
            self._feeds.pop()
        self.warnings.append(
            f"No port from {first_port} on is free on 127.0.0.1, so no viewer was opened; "
            "close viewers that are no longer needed."
        )
        return None

    def _open_window(self, outlet: StreamWorker, port: int) -> None:
        """Open it on what is known before the first period."""
        try:
            process = window.start_viewer(port)
        except OSError as error:
            self.warnings.append(
                f"The viewer did not start ({error}); try: rerun --connect {window.proxy_url(port)}"
            )
            return
        outlet.farewell = partial(window.let_viewers_catch_up, port, process)
        self._window = process
