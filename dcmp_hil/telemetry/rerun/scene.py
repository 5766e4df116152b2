"""Static contents of a recording: styles of lines, the drawn pendulum, versions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.friction_findings import DISTRUST
from dcmp_hil.telemetry.rerun.parameter_table import RELATIVE, Parameters, table_of
from dcmp_hil.telemetry.rerun.plots import VOLTAGE
from dcmp_hil.telemetry.signals import (
    ERROR_RGB,
    ESTIMATE_RGB,
    FAINT_RGB,
    REFERENCE_RGB,
    TRUE_RGB,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.rerun.rig_view import RigView

ARM, GHOST = "rig/arm", "rig/reference"
LIMITS, LOG = f"{VOLTAGE}/range", "events/log"
LANES = {
    "phase": {
        "probing": FAINT_RGB,
        "settling": FAINT_RGB,
        "engaging": ESTIMATE_RGB,
        "running": REFERENCE_RGB,
        "stopping": FAINT_RGB,
        "tripped": ERROR_RGB,
    },
    "voltage": {"within limits": (52, 78, 112), "at the limit": ERROR_RGB},
    "samples": {"on time": (74, 78, 84), "late": ERROR_RGB},
}
"""Lanes of the timeline of states, with the colour of each state: what is as it should be is quiet."""
MODEL_LANE, MODEL_STATES = "model", {"holds": (74, 78, 84), "let go": ESTIMATE_RGB}
"""Lane of an observer that lets go of its model where this does not hold."""

_SERIES_COLOURS = (
    *((78, 121, 167), (242, 142, 43), (225, 87, 89), (118, 183, 178), (89, 161, 79)),
    *((237, 201, 72), (176, 122, 161), (255, 157, 167), (156, 117, 95), (186, 176, 172)),
)
"""Colours of lines that only have to differ."""
_ARM_LENGTH = 1.0
_ARM_DEPTH = 0.12  # the arm moves before the dial


def lanes_of(rig: RigView) -> dict[str, dict[str, tuple[int, int, int]]]:
    """Return the lanes of a rig, and the states of each."""
    return {**LANES, MODEL_LANE: MODEL_STATES} if DISTRUST in rig.further else LANES


def lane_path(lane: str) -> str:
    """Return the entity of a lane; the view shows it as its name, so it is short."""
    return lane


def log_scenery(stream: rr.RecordingStream, rig: RigView) -> None:
    """Log all that is known before the first period."""
    _log_about(stream, rig)
    _style_parameters(stream, rig)
    _log_stand(stream)
    _log_arm(stream)
    if rig.voltage_limit is not None:
        style = rr.SeriesLines(names=["limit", "limit"], colors=[(130, 60, 60)] * 2, widths=[1.0] * 2)
        stream.log(LIMITS, style, static=True)
    for lane, states in lanes_of(rig).items():
        look = rr.StateConfiguration(values=list(states), colors=list(states.values()))
        stream.log(lane_path(lane), look, static=True)


def turned(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions, shape (n, 4), about the motor's axis: 0 hangs down, positive is counter-clockwise.

    Parameters
    ----------
    angles
        rad, shape (n,).
    """
    half, zero = 0.5 * angles, np.zeros_like(angles)
    return np.stack([zero, zero, np.sin(half), np.cos(half)], axis=1)


def _log_about(stream: rr.RecordingStream, rig: RigView) -> None:
    text = table_of("versions and host", rig.about)
    stream.log("about", rr.TextDocument(text, media_type="text/markdown"), static=True)


def _style_parameters(stream: rr.RecordingStream, rig: RigView) -> None:
    names = Parameters(rig.parameters, rig.kinds, rig.numbers).drawn
    style = rr.SeriesLines(
        names=list(names),
        colors=[_SERIES_COLOURS[k % len(_SERIES_COLOURS)] for k in range(len(names))],
        widths=[1.6] * len(names),
        interpolation_mode="StepAfter",
    )
    stream.log(RELATIVE, style, static=True)


def _circle(radius: float, z: float) -> NDArray[np.float64]:
    angles = np.linspace(0.0, 2.0 * np.pi, 97)
    return np.stack([radius * np.sin(angles), -radius * np.cos(angles), np.full_like(angles, z)], axis=1)


def _log_stand(stream: rr.RecordingStream) -> None:
    motor = rr.Cylinders3D(
        lengths=[0.3, 0.06],
        radii=[0.2, 0.24],
        centers=[(0, 0, -0.12), (0, 0, 0.0)],
        colors=[(70, 74, 80), (96, 102, 110)],
        fill_mode="Solid",
    )
    stream.log("rig/motor", motor, static=True)
    ticks = np.radians(np.arange(0, 360, 15))
    strips = []
    for k, angle in enumerate(ticks):
        direction = np.array([np.sin(angle), -np.cos(angle), 0.0])
        strips.append([direction * (1.18 if k % 6 else 1.14), direction * 1.22])
    dial = rr.LineStrips3D(
        [_circle(1.22, 0.0), *strips],
        colors=[(95, 100, 108)],
        radii=[0.007, *[0.004 if k % 6 else 0.009 for k in range(len(ticks))]],
    )
    stream.log("rig/dial", dial, static=True)
    names = rr.Points3D(
        [(0, -1.36, 0), (1.36, 0, 0), (0, 1.36, 0), (-1.36, 0, 0)],
        labels=["0", "+90°", "180°", "-90°"],
        show_labels=True,
        radii=[0.001],
        colors=[(150, 155, 160)],
    )
    stream.log("rig/dial/names", names, static=True)


def _log_arm(stream: rr.RecordingStream) -> None:
    rod = rr.Capsules3D(
        lengths=[_ARM_LENGTH],
        radii=[0.045],
        translations=[(0, 0, _ARM_DEPTH)],
        rotation_axis_angles=[rr.RotationAxisAngle(axis=(1, 0, 0), degrees=90)],
        colors=[TRUE_RGB],
        fill_mode="Solid",
    )
    stream.log(f"{ARM}/rod", rod, static=True)
    ends = rr.Ellipsoids3D(
        half_sizes=[(0.13, 0.13, 0.13), (0.09, 0.09, 0.09)],
        centers=[(0, -_ARM_LENGTH, _ARM_DEPTH), (0, 0, _ARM_DEPTH)],
        colors=[(170, 190, 210), (60, 64, 70)],
        fill_mode="Solid",
    )
    stream.log(f"{ARM}/ends", ends, static=True)
    outline = rr.LineStrips3D(
        [
            [(0, 0, _ARM_DEPTH), (0, -1.14, _ARM_DEPTH)],
            _circle(0.17, 0.0) + np.array([0.0, -_ARM_LENGTH, _ARM_DEPTH]),
        ],
        colors=[REFERENCE_RGB],
        radii=[0.010],
    )
    stream.log(f"{GHOST}/outline", outline, static=True)
