"""The dashboard: a run as a Rerun recording, live in a viewer, in a file, or both."""

from __future__ import annotations

import atexit
import math
import os
from functools import partial
from typing import TYPE_CHECKING, Literal
from uuid import uuid4

import numpy as np
import rerun as rr

from dcmp_hil.clock import MonotonicClock
from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry import viewer as window
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.blueprint import dashboard
from dcmp_hil.telemetry.display import display_problem
from dcmp_hil.telemetry.frames import Frames
from dcmp_hil.telemetry.outlet import Outlet, room_for
from dcmp_hil.telemetry.ring import FIELDS
from dcmp_hil.telemetry.scenery import log_scenery, log_style
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Sequence
    from pathlib import Path

    from dcmp_hil.telemetry.frames import Call
    from dcmp_hil.telemetry.outlet import Job
    from dcmp_hil.telemetry.rig_view import RigView
    from dcmp_hil.telemetry.signals import Signal

    Viewer = Literal["spawn", "web", "serve", "connect", "none"]

_SERVER_START = 60.0  # s, a far limit: that it listens is an event, and nothing is armed yet
_CLOSING = 12.0  # s, for all of it; long enough for a window that is still opening
_FAREWELL = 1.5  # s, for a viewer that was there before: if it is frozen, the last call never returns
_FILE_PATIENCE = 30.0  # s, for a disk that is slow
_VIEWER_PATIENCE = 5.0  # s, for a viewer that is
_STUCK = (
    "The viewer has taken nothing for seconds and is left behind; the run goes on. "
    "Close that viewer and open another."
)
_SCARCE = 100e6  # bytes free below which a disk is the likely cause
_BEGINNING = 400e3  # bytes: scenery and layout are 250 kB
_NO_WINDOW = (
    "The viewer ended by itself (exit code {code}; process.log in the run's folder has its words). "
    "The run is served on port {port}: dcmp-hil view --port {port} --web"
)


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
        pages somebody else serves; ``connect`` sends to the viewer that listens on 127.0.0.1:9876.
    application
        Recordings of the same application share the viewer's layout.
    port
        First port tried for the recording's own server, on 127.0.0.1 only (``spawn``, ``serve``, ``web``).

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
        port: int = window.PORT,
    ) -> None:
        self.warnings: list[str] = []
        self.port: int | None = None
        self._window: subprocess.Popen[bytes] | None = None
        self._rig = rig
        self._frames = Frames(rig)
        self._outlets: list[Outlet] = []
        self._application, self._recording = application, str(uuid4())
        rr.unregister_shutdown()
        _warm_up(rig)
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
        """Take consecutive periods."""
        if not len(block):
            return
        if not self._frames.plots:
            self._frames.choose_lines(block)
            self._tell(partial(_log_styles, self._frames.plots))
        self._tell(partial(_send, self._frames.of_block(block)))
        if self._window and (code := self._window.poll()) is not None:
            self._window = None
            if code:  # closed by the user it is 0
                self.warnings.append(_NO_WINDOW.format(code=code, port=self.port))

    def event(self, event: Event) -> None:
        """Take an event."""
        self._tell(partial(_send, self._frames.of_event(event)))

    def close(self) -> None:
        """Write what is left, and give up after 12 s at most; a second call waits for the first."""
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(_CLOSING * 1e9)
        atexit.unregister(self.close)
        faults: list[str] = []
        for outlet in self._outlets:
            try:
                outlet.close(max(0, end_ns - clock.now_ns()) * 1e-9)
            except Exception as error:  # noqa: BLE001 - the others are to be closed all the same
                faults.append(_incomplete(outlet, str(error)))
        if faults:
            raise RuntimeError(faults[0])

    def _tell(self, job: Job) -> None:
        for outlet in tuple(self._outlets):
            try:
                sentence = "" if outlet.do(job) else _stuck(outlet)
            except Exception as error:  # noqa: BLE001 - one outlet that fails is no reason to lose the other
                outlet.leave()
                sentence = f"{_incomplete(outlet, str(error))} The run goes on."
            if sentence:
                self._outlets.remove(outlet)
                self.warnings.append(sentence)

    def _stream(self) -> rr.RecordingStream:
        return rr.RecordingStream(self._application, recording_id=self._recording)

    def _open_file(self, record: Path) -> None:
        try:
            record.open("wb").close()
        except OSError as error:
            raise ConfigError(
                f"{record}: {error.strerror or error}. Choose a file for the recording that you may write, "
                "in a folder that exists."
            ) from None
        room = room_for(record)
        if room < _BEGINNING:  # Rerun waits for ever where the disk fills up while it begins
            raise ConfigError(
                f"{record}: there is room for {1e-3 * room:.0f} kB, and a recording begins with up to "
                f"{1e-3 * _BEGINNING:.0f} kB. Free some space, or record elsewhere (--record FILE.rrd) or "
                "not at all (--no-record)."
            )
        stream = self._stream()
        try:
            _begin(rr.FileSink(record), self._rig, stream)
        except RuntimeError as error:  # a file that can be opened, on a disk that is full
            raise ConfigError(f"The recording cannot begin: {error}. Free some space.") from None
        self._outlets.append(Outlet(stream, _FILE_PATIENCE, _CLOSING, file=record))

    def _open_viewer(self, target: rr.GrpcSink | rr.GrpcServerSink, ending: float) -> Outlet:
        outlet = Outlet(self._stream(), _VIEWER_PATIENCE, ending)
        outlet.do(partial(_begin, target, self._rig))
        self._outlets.append(outlet)
        return outlet

    def _connect(self) -> None:
        if window.speaks_http2(window.PORT):
            self._open_viewer(rr.GrpcSink(window.proxy_url(window.PORT)), _FAREWELL)
            return
        self.warnings.append(
            f"No viewer answers on 127.0.0.1:{window.PORT}; the run goes on without one. "
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

    def _serve(self, first_port: int) -> Outlet | None:
        """Let viewers come and go; who comes late gets what there was."""
        for port in window.free_ports(first_port):
            target = rr.GrpcServerSink(window.LOOPBACK, port, server_memory_limit="256MiB")
            outlet = self._open_viewer(target, _CLOSING)
            if window.serves(port, os.getpid(), _SERVER_START):
                self.port = port
                return outlet
            outlet.leave()  # another process took the port first
            self._outlets.remove(outlet)
        self.warnings.append(
            f"No port from {first_port} on is free on 127.0.0.1, so no viewer was opened; "
            "close viewers that are no longer needed."
        )
        return None

    def _open_window(self, outlet: Outlet, port: int) -> None:
        """Open it on what is known before the first period."""
        try:
            process = window.start_viewer(port)
        except OSError as error:
            self.warnings.append(
                f"The viewer did not start ({error}); try: rerun --connect {window.proxy_url(port)}"
            )
            return
        outlet.farewell = partial(window.let_viewer_catch_up, process, port)
        self._window = process


def _stuck(outlet: Outlet) -> str:
    if outlet.file is None:
        return _STUCK
    return f"{_incomplete(outlet, f'it did not grow for {outlet.stalled:.0f} s')} The run goes on."


def _incomplete(outlet: Outlet, reason: str) -> str:
    """Say that a recording, or what a viewer got, is incomplete, with what was measured."""
    if outlet.file is None:
        return f"What the viewer shows is incomplete: {reason}."
    measured = f"{1e-6 * outlet.size():.1f} MB are in it"
    remedy = ""
    room = room_for(outlet.file)
    if math.isfinite(room):
        measured += f", there is room for {1e-9 * room:.1f} GB more"
        remedy = " Free some space." if room < _SCARCE else ""
    return f"The recording is incomplete: {reason.rstrip('.')} ({measured}).{remedy}"


def _begin(
    target: rr.FileSink | rr.GrpcSink | rr.GrpcServerSink, rig: RigView, stream: rr.RecordingStream
) -> None:
    """Send what is known before the first period."""
    layout = dashboard(rig)
    stream.set_sinks(target, default_blueprint=layout)
    stream.send_recording_name(rig.name)
    stream.send_blueprint(layout)
    log_scenery(stream, rig)
    _send(Frames(rig).of_start(), stream)


def _log_styles(plots: dict[str, list[Signal]], stream: rr.RecordingStream) -> None:
    for plot, signals in plots.items():
        log_style(stream, plot, signals)


def _warm_up(rig: RigView) -> None:
    """Make the calls of a block for nobody: the first ones take 80 ms, and the loop would wait for them."""
    frames, block = Frames(rig), Block(np.zeros((2, len(FIELDS))))
    frames.choose_lines(block)
    stream = rr.RecordingStream("warm-up")
    _send(
        [
            *frames.of_start(),
            *frames.of_block(block),
            *frames.of_event(Event(0.0, "INFO", EventKind.OTHER, "")),
        ],
        stream,
    )
    stream.disconnect()


def _send(calls: Sequence[Call], stream: rr.RecordingStream) -> None:
    for entity, times, columns in calls:
        stream.send_columns(entity, times, columns)
