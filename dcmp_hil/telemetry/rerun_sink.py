"""The dashboard: a run as a Rerun recording, live in a viewer, in a file, or both."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Literal

import numpy as np
import rerun as rr

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry import viewer as window
from dcmp_hil.telemetry.blueprint import dashboard
from dcmp_hil.telemetry.display import display_available
from dcmp_hil.telemetry.histogram import PeriodHistogram
from dcmp_hil.telemetry.lanes import Lane
from dcmp_hil.telemetry.scenery import ARM, GHOST, LIMITS, PERIODS, lane_path, log_scenery, log_style, turned
from dcmp_hil.telemetry.signals import TIMING, by_plot

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rig_view import RigView
    from dcmp_hil.telemetry.signals import Signal
    from dcmp_hil.values import Event

    Viewer = Literal["spawn", "connect", "none"]
    Target = rr.FileSink | rr.GrpcSink | rr.GrpcServerSink

_POSES_PER_SECOND = 50
_PROBE = 0.4  # s
_SERVER_START = 3.0  # s
_FLUSH = 1.0  # s
_CLOSING = 12.0  # s; a run in real time waits for 2 s only
_LATE = 0.5  # of a period


class RerunSink:
    """Sends a run to a viewer, to a file, or to both.

    Parameters
    ----------
    rig
        What the viewer is told about the rig.
    record
        The .rrd file; None for none.
    viewer
        ``spawn`` opens a window, ``connect`` sends to the viewer that listens on 127.0.0.1:9876.
    application
        Recordings of the same application share the viewer's layout.
    port
        First port tried for the recording's own server, on 127.0.0.1 only (``spawn``).

    Attributes
    ----------
    warnings
        One sentence for each thing asked for that the run goes on without.
    port
        Of the recording's own server; None where there is none.

    Raises
    ------
    ConfigError
        If the file cannot be created.
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
        self._rig = rig
        self._window: subprocess.Popen[bytes] | None = None
        self._plots: dict[str, list[Signal]] = {}
        self._histogram = PeriodHistogram(rig.period)
        self._lanes = {name: Lane() for name in ("voltage", "samples")}
        self._last_pose = -1
        self._closed = False
        self._stream = rr.RecordingStream(application)
        self._stream.send_recording_name(rig.name)
        self._connect([*_file(record), *self._viewer_sinks(viewer, port)])

    def block(self, block: Block) -> None:
        """Take consecutive periods."""
        if not len(block):
            return
        if not self._plots:
            self._choose_lines(block)
        t = block["t"]
        times = self._times(t)
        for plot, signals in self._plots.items():
            values = np.stack([signal.read(block) for signal in signals], axis=1)
            self._stream.send_columns(plot, times, rr.Scalars.columns(scalars=values))
        self._send_limits(t[-1:])
        self._send_poses(block)
        self._send_states(block)
        if self._histogram.add(t, block["period"]):
            self._send_histogram(t[-1:])

    def event(self, event: Event) -> None:
        """Take an event."""
        t = np.array([event.t])
        if event.level == "PHASE":
            self._send_state("phase", t, [event.text])
            return
        columns = rr.TextLog.columns(text=[event.text], level=[event.level])
        self._stream.send_columns("events/log", self._times(t), columns)

    def close(self) -> None:
        """Write what is left; gives up on a viewer that no longer takes anything, after 12 s at most."""
        if self._closed:
            return
        self._closed = True
        # Rerun's own calls can block for ever on a frozen viewer.
        closing = threading.Thread(target=self._finish, name="rerun-close", daemon=True)
        closing.start()
        closing.join(_CLOSING)

    def _finish(self) -> None:
        with suppress(Exception):  # a full disk or a lost viewer; the run is over anyway
            self._stream.flush(timeout_sec=_FLUSH)
        if self._window is not None and self.port is not None:
            window.let_viewer_catch_up(self._window, self.port)
        self._stream.disconnect()

    def _connect(self, sinks: Sequence[Target]) -> None:
        """Send what is known before the first period, and only then open the window on it."""
        if sinks:
            layout = dashboard(self._rig)
            try:
                self._stream.set_sinks(*sinks, default_blueprint=layout)
            except RuntimeError as error:  # a file that can be opened, on a disk that is full
                raise ConfigError(f"The recording cannot begin: {error}. Free some space.") from None
            self._stream.send_blueprint(layout)
        log_scenery(self._stream, self._rig)
        if self.port is not None:
            self._open_window(self.port)

    def _viewer_sinks(self, viewer: Viewer, port: int) -> list[Target]:
        if viewer == "connect":
            if window.answers(window.PORT, _PROBE):
                return [rr.GrpcSink(window.proxy_url(window.PORT))]
            self.warnings.append(
                f"No viewer listens on 127.0.0.1:{window.PORT}; the run goes on without one. "
                "Start it first with: rerun --bind 127.0.0.1"
            )
        elif viewer == "spawn":
            if display_available():
                return self._server(port)
            self.warnings.append(
                "There is no display (neither DISPLAY nor WAYLAND_DISPLAY is set), so no viewer was opened; "
                "look at the recording afterwards, or use --viewer none."
            )
        return []

    def _server(self, port: int) -> list[Target]:
        self.port = window.free_port(port)
        if self.port is None:
            self.warnings.append(
                f"No port from {port} on is free on 127.0.0.1, so no viewer was opened; "
                "close viewers that are no longer needed."
            )
            return []
        return [rr.GrpcServerSink(window.LOOPBACK, self.port, server_memory_limit="256MiB")]

    def _open_window(self, port: int) -> None:
        try:
            if window.answers(port, _SERVER_START):
                self._window = window.start_viewer(port)
                return
            reason = f"nothing answers on 127.0.0.1:{port}"
        except OSError as error:
            reason = str(error)
        self.warnings.append(
            f"The viewer did not start ({reason}); try: rerun --connect {window.proxy_url(port)}"
        )

    def _choose_lines(self, block: Block) -> None:
        """Leave out the truth where nobody knows it, before the first line is drawn."""
        for plot, signals in by_plot().items():
            known = [s for s in signals if "_true_" not in s.column or not np.isnan(s.read(block)).all()]
            if known:
                self._plots[plot] = known
                log_style(self._stream, plot, known)

    def _times(self, t: NDArray[np.float64]) -> list[rr.TimeColumn]:
        # Rounded: what Rerun makes of float seconds itself is cut off, and one nanosecond short.
        durations = np.rint(t * 1e9).astype("timedelta64[ns]")
        ticks = np.rint(t / self._rig.period).astype(np.int64)
        return [rr.TimeColumn("loop_time", duration=durations), rr.TimeColumn("tick", sequence=ticks)]

    def _send_limits(self, t: NDArray[np.float64]) -> None:
        limit = self._rig.voltage_limit
        if limit is not None:
            values = np.array([[limit, -limit]])
            self._stream.send_columns(LIMITS, self._times(t), rr.Scalars.columns(scalars=values))

    def _send_poses(self, block: Block) -> None:
        slots = np.floor(block["t"] * _POSES_PER_SECOND + 1e-6).astype(np.int64)
        wanted = np.flatnonzero(np.diff(slots, prepend=self._last_pose))
        self._last_pose = int(slots[-1])
        if not len(wanted):
            return
        true = block["position_true"]
        position = np.where(np.isnan(true), block["position"], true)
        times = self._times(block["t"][wanted])
        for path, angles in ((ARM, position), (GHOST, block.reference[:, 0])):
            pose = rr.Transform3D.columns(quaternion=turned(angles[wanted]))
            self._stream.send_columns(path, times, pose)

    def _send_states(self, block: Block) -> None:
        limit = self._rig.voltage_limit
        questions = {"samples": (block["lateness"] > _LATE * self._rig.period, ("on time", "late"))}
        if limit is not None:
            at_limit = np.abs(block["voltage_sent"]) >= limit * (1.0 - 1e-9)
            questions["voltage"] = (at_limit, ("within limits", "at the limit"))
        for lane, (truth, names) in questions.items():
            rows = self._lanes[lane].changes(truth)
            if len(rows):
                self._send_state(lane, block["t"][rows], [names[int(truth[row])] for row in rows])

    def _send_state(self, lane: str, t: NDArray[np.float64], states: list[str]) -> None:
        columns = rr.StateChange.columns(state=states)
        self._stream.send_columns(lane_path(lane), self._times(t), columns)

    def _send_histogram(self, t: NDArray[np.float64]) -> None:
        shown = self._histogram
        bars = rr.BarChart.columns(
            values=[shown.counts], abscissa=[shown.centres_us], widths=[shown.widths_us], color=[TIMING]
        )
        self._stream.send_columns(PERIODS, self._times(t), bars)


def _file(record: Path | None) -> list[Target]:
    if record is None:
        return []
    try:
        record.open("wb").close()
    except OSError as error:
        raise ConfigError(
            f"{record}: {error.strerror or error}. Choose a file for the recording that you may write, "
            "in a folder that exists."
        ) from None
    return [rr.FileSink(record)]
