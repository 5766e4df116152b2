"""`python -m tools.sample_recording`: write the recording that the project ships, from its own simulation.

The simulated pendulum has Coulomb friction, cogging and a push that comes and goes; its logger is late and
loses rows. No measurement of a real pendulum is in it.
"""

from __future__ import annotations

import math
import random
import sys
from pathlib import Path
from typing import NamedTuple

from dcmp_hil.control.model import Model
from sim_backend.plant import MoreauPlant

RECORDING = Path(__file__).parent.parent / "examples/simulated_pendulum.csv"
MODEL = Model()
COUNTS_PER_REV = 4096
_SEED, _DURATION_S = 20_260, 14.0
_TICK_S, _PERIOD_TICKS, _JITTER_TICKS = 1e-4, 33, 4  # the logger: every 3.3 ms, up to 0.4 ms early or late
_COGGING_RAD_S2, _COGGING_PER_REV = 0.6, 24  # amplitude, and periods a revolution
_LOSS_PROBABILITY, _BURST_ROWS_MAX = 0.004, 6  # of a row to be the first of some that are lost
_DIFFERENCE_ROWS = 8  # over which the drive takes its own velocity: late and coarse, as drives do


class LoggedRow(NamedTuple):
    """One row of the recording, and what the file does not have: its number and the true velocity."""

    number: int  # among all rows, those that were lost as well
    time: float  # s
    position: float  # rad, of the encoder
    voltage: float  # V, from this row to the next
    velocity: float  # rad/s, the drive's own
    true_velocity: float  # rad/s


def simulated_rows() -> list[LoggedRow]:
    """Return every row that the logger kept; the same ones at every call."""
    rng = random.Random(_SEED)  # noqa: S311 - it must repeat itself
    plant = MoreauPlant(MODEL, MODEL, position=0.0, step=_TICK_S, steps=1)
    rows: list[LoggedRow] = []
    angles: list[tuple[float, float]] = []
    number, now, position, velocity, lost = 0, 0, 0.0, 0.0, 0
    while now * _TICK_S < _DURATION_S:
        t = now * _TICK_S
        count = math.tau / COUNTS_PER_REV
        angle = count * math.floor(position / count + 0.5)
        angles = [*angles, (t, angle)][-_DIFFERENCE_ROWS - 1 :]
        span = t - angles[0][0]
        voltage = round(1.8 * math.sin(2.1 * t) + 1.6 * math.sin(7.3 * t), 3)
        if lost == 0 and rows and rng.random() < _LOSS_PROBABILITY:
            lost = rng.randint(1, _BURST_ROWS_MAX)
        if lost == 0:
            own = (angle - angles[0][1]) / span if span else 0.0
            rows.append(LoggedRow(number, t, angle, voltage, own, velocity))
        lost = max(0, lost - 1)
        step = _PERIOD_TICKS + rng.randint(-_JITTER_TICKS, _JITTER_TICKS)
        for _ in range(step):
            cogging = _COGGING_RAD_S2 * math.sin(_COGGING_PER_REV * position)
            position, velocity, _w = plant.advance(voltage + cogging / MODEL.ku)
        number, now = number + 1, now + step
    return rows


def recording_text() -> str:
    """Return the file."""
    lines = ["time_s,position_rad,voltage_V,velocity_rad_s"]
    lines += [
        f"{row.time:.4f},{row.position:.6f},{row.voltage:.3f},{row.velocity:.4f}" for row in simulated_rows()
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the recording."""
    RECORDING.write_text(recording_text(), encoding="utf-8")
    sys.stdout.write(f"wrote {RECORDING.relative_to(Path.cwd())}\n")


if __name__ == "__main__":
    main()
