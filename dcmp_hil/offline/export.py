"""Writing a replay as CSV, and as a Rerun recording."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.offline.run import ReplayResult

_INPUT_COLUMN = {"torque": "torque_N_m", "voltage": "voltage_V", "none": "voltage_V"}
_APPLICATION_ID = "dcmp-hil replay"


def columns(result: ReplayResult) -> dict[str, NDArray[np.float64]]:
    """Return the results of a replay as named columns.

    Returns
    -------
    dict
        Name with unit to shape (n,): time as in the file, position, the input over the step that ended at the
        row (so `--input-at end` replays what is written), estimates, references, and the velocity of the file
        if it has one.
    """
    recording, estimates = result.recording, result.estimates
    table = {
        "time_s": recording.time,
        "position_rad": recording.position,
        _INPUT_COLUMN[recording.input_kind]: result.applied,
        "position_estimate_rad": estimates.position,
        "velocity_estimate_rad_s": estimates.velocity,
        "disturbance_estimate_rad_s2": estimates.disturbance,
        "velocity_reference_rad_s": result.reference.velocity,
        "disturbance_reference_rad_s2": result.reference.disturbance,
    }
    if recording.velocity is not None:
        table["velocity_given_rad_s"] = recording.velocity
    return table


def write_csv(result: ReplayResult, path: Path) -> None:
    """Write `columns` as CSV; a field is empty where a stretch was too short for a reference.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    table = columns(result)
    digits = [".15g" if name == "time_s" else ".9g" for name in table]
    try:
        with whole_file(path) as place, place.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            for row in zip(*(values.tolist() for values in table.values()), strict=True):
                writer.writerow(
                    "" if math.isnan(value) else format(value, form)
                    for value, form in zip(row, digits, strict=True)
                )
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None


def write_rrd(result: ReplayResult, path: Path) -> None:
    """Write a replay as a Rerun recording, its time counted from the first row.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    from dcmp_hil.telemetry.rerun.series import write_series

    recording, estimates, reference = result.recording, result.estimates, result.reference
    name = _INPUT_COLUMN[recording.input_kind]
    velocity = {"estimate": estimates.velocity, "reference": reference.velocity}
    if recording.velocity is not None:
        velocity["given"] = recording.velocity
    plots = {
        "joint/position_rad": {"measured": recording.position, "estimate": estimates.position},
        "joint/velocity_rad_s": velocity,
        "joint/disturbance_rad_s2": {"estimate": estimates.disturbance, "reference": reference.disturbance},
        f"control/{name}": {"applied": result.applied},
    }
    try:
        with whole_file(path) as place:
            try:
                write_series(place, _APPLICATION_ID, recording.time - recording.time[0], plots)
            except ConfigError as error:  # it names the file that takes the place of this one
                raise ConfigError(str(error).replace(str(place), str(path))) from None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
