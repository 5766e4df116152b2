"""The black box: the last second of cycles before a trip, as black_box.csv of the run's folder."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.errors import TripError


def black_box(trip: TripError) -> str:
    """Return the file's text: a row for each cycle of the last second."""
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(
        [
            *("t_s", "position_rad", "voltage_applied_V", "fault"),
            *("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2"),
            *("position_reference_rad", "velocity_reference_rad_s", "acceleration_reference_rad_s2"),
            *("voltage_demand_V", "voltage_sent_V", "period_s", "lateness_s", "compute_s"),
            *trip.further,
        ]
    )
    further = trip.further_values or [()] * len(trip.cycles)
    for c, more in zip(trip.cycles, further, strict=True):
        writer.writerow([*c.sample, *c.estimate, *c.reference, c.demand, c.voltage, *c.timing, *more])
    return file.getvalue()
