"""Start of a recording, on the thread of its outlet, since Rerun may never return."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.rerun.blueprint import dashboard
from dcmp_hil.telemetry.rerun.entity_columns import Frames
from dcmp_hil.telemetry.rerun.feed import send
from dcmp_hil.telemetry.rerun.scene import log_scenery
from dcmp_hil.telemetry.rerun.text_stream import TextStream
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    import rerun as rr

    from dcmp_hil.telemetry.rerun.rig_view import RigView


def begin(
    target: rr.FileSink | rr.GrpcSink | rr.GrpcServerSink, rig: RigView, stream: rr.RecordingStream
) -> None:
    """Send rig, description and layout, which are known before the first period."""
    layout = dashboard(rig)
    stream.set_sinks(target, default_blueprint=layout)
    stream.send_recording_name(rig.name)
    stream.send_blueprint(layout)
    log_scenery(stream, rig)
    send(Frames(rig).of_start(), stream)


def warm_up(rig: RigView, _: rr.RecordingStream) -> None:
    """Make the calls of a block without output: the first take 80 ms, for which the loop would wait."""
    frames, block = Frames(rig), Block(np.zeros((2, len(FIELDS))))
    stream = TextStream("warm-up")
    nothing = Event(0.0, "INFO", EventKind.OTHER, "")
    send([*frames.of_start(), *frames.of_block(block), *frames.of_event(nothing), *frames.of_end()], stream)
    stream.disconnect()
