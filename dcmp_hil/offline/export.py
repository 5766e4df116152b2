"""Writing a replay as CSV, and as a Rerun recording."""

from __future__ import annotations

import csv
import math
from types import MappingProxyType
from typing import TYPE_CHECKING

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.offline.run import ReplayResult

_INPUT_COLUMN = {"torque": "torque_N_m", "voltage": "voltage_V", "none": "voltage_V"}
_ESTIMATE_COLUMNS = ("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2")
_REFERENCE_COLUMN = "disturbance_reference_rad_s2"
_NONE_COMPARED: Mapping[str, ReplayResult] = MappingProxyType({})
_APPLICATION_ID = "dcmp-hil replay"


def columns(
    result: ReplayResult, compared: Mapping[str, ReplayResult] = _NONE_COMPARED
) -> dict[str, NDArray[np.float64]]:
    """Return the results of a replay as named columns.

    Parameters
    ----------
    result
        The replay.
    compared
        Other replays of the same recording: their estimates follow, with `_compare1`, `_compare2` ... behind
        the name of each column; and the reference of the disturbance where another model has another one.

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
        **dict(zip(_ESTIMATE_COLUMNS, estimates, strict=True)),
        "velocity_reference_rad_s": result.reference.velocity,
        _REFERENCE_COLUMN: result.reference.disturbance,
    }
    if recording.velocity is not None:
        table["velocity_given_rad_s"] = recording.velocity
    for number, other in enumerate(compared.values(), start=1):
        further = dict(zip(_ESTIMATE_COLUMNS, other.estimates, strict=True))
        if other.has_other_reference(result):
            further[_REFERENCE_COLUMN] = other.reference.disturbance
        table |= {f"{name}_compare{number}": values for name, values in further.items()}
    return table


def write_csv(
    result: ReplayResult, path: Path, compared: Mapping[str, ReplayResult] = _NONE_COMPARED
) -> None:
    """Write `columns` as CSV; a field is empty where a stretch was too short for a reference.

    Parameters
    ----------
    result, compared
        As for `columns`.
    path
        Replaced if it is there.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    table = columns(result, compared)
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


def write_rrd(
    result: ReplayResult, path: Path, compared: Mapping[str, ReplayResult] = _NONE_COMPARED
) -> None:
    """Write a replay as a Rerun recording, its time counted from the first row.

    Parameters
    ----------
    result
        The replay.
    path
        Replaced if it is there.
    compared
        Other replays of the same recording, by the name that their lines have.

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
    for label, other in compared.items():
        for entity, values in zip(plots, other.estimates, strict=False):  # all but the input
            plots[entity][label] = values
        if other.has_other_reference(result):
            plots["joint/disturbance_rad_s2"][f"reference of {label}"] = other.reference.disturbance
    try:
        with whole_file(path) as place:
            try:
                write_series(place, _APPLICATION_ID, recording.time - recording.time[0], plots)
            except ConfigError as error:  # it names the file that takes the place of this one
                raise ConfigError(str(error).replace(str(place), str(path))) from None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
