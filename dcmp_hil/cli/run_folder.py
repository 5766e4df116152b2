"""The folder that a run leaves behind: figures, rig, recording, picture, and the black box after a trip."""

from __future__ import annotations

import csv
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.cli import console
from dcmp_hil.clock import utc_now
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.errors import TripError
    from dcmp_hil.session import Result

_RUNS = Path("runs")


class RunFolder:
    """`runs/<UTC>-<rig>/`, made at once so that a wrong place shows before the run and not after it.

    Parameters
    ----------
    rig_name
        Part of the folder's name.

    Raises
    ------
    ConfigError
        If it cannot be made.
    """

    def __init__(self, rig_name: str) -> None:
        stem = f"{utc_now():%Y%m%dT%H%M%SZ}-{rig_name}"
        for suffix in ("", *(f"-{n}" for n in range(2, 100))):
            self.path = _RUNS / f"{stem}{suffix}"
            try:
                self.path.mkdir(parents=True)
            except FileExistsError:
                continue
            except OSError as error:
                raise ConfigError(
                    f"{self.path}: {error.strerror or error}. "
                    "Start from a folder you may write in, or use --no-record."
                ) from None
            return
        raise ConfigError(f"{_RUNS / stem}: 99 runs began in this second. Wait a moment.")

    @property
    def recording(self) -> Path:
        """Where the recording goes."""
        return self.path / "run.rrd"

    @property
    def own(self) -> Path:
        """Where the run's own recording goes, with every period."""
        return self.path / "run.mcap"

    def write(
        self,
        rig: Rig,
        document: dict[str, Any],
        result: Result,
        trip: TripError | None,
        *,
        draw: bool,
    ) -> None:
        """Write everything but the recording; a full disk costs a warning, not the figures on the screen.

        Drawing takes seconds, which whoever ended the run early has not got.
        """
        try:
            console.write_json(
                str(self.path / "summary.json"), {**document, "rig_toml": rig.model_dump(mode="json")}
            )
            if trip is not None:
                self._write_black_box(trip)
            if result.columns and draw:
                self._draw(result)
        except (OSError, ConfigError) as error:
            console.warn(f"{self.path} is incomplete: {error}")

    def discard(self) -> None:
        """Remove the folder of a run that never began."""
        shutil.rmtree(self.path, ignore_errors=True)

    def tell(self, record: Path | None, *, live: bool) -> None:
        """Say where things are and how to look at them."""
        console.note(f"kept in {self.path}/")
        recording = record or self.recording
        if not live and recording.exists():
            console.note(f"no viewer was open; to see the run: {_viewer_command()} {recording}")
        picture = self.path / "run.png"
        if picture.exists():
            console.note(f"or look at {picture}")

    def _draw(self, result: Result) -> None:
        try:
            from dcmp_hil.telemetry.picture import draw_run

            draw_run(result.columns, f"{result.rig.name}", self.path / "run.png")
        except ConfigError as error:  # matplotlib is an extra
            console.note(f"no picture: {error}")

    def _write_black_box(self, trip: TripError) -> None:
        """One row a cycle of the last second, flat."""
        with (self.path / "black_box.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(
                [
                    *("t_s", "position_rad", "voltage_applied_V", "fault"),
                    *("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2"),
                    *("position_reference_rad", "velocity_reference_rad_s", "acceleration_reference_rad_s2"),
                    *("voltage_demand_V", "voltage_sent_V", "period_s", "lateness_s", "compute_s"),
                ]
            )
            for c in trip.cycles:
                writer.writerow([*c.sample, *c.estimate, *c.reference, c.demand, c.voltage, *c.timing])


def _viewer_command() -> str:
    """Say how to call the viewer: it is installed beside this Python, which need not be on the path."""
    beside = Path(sys.executable).with_name("rerun")
    if shutil.which("rerun") or not beside.exists():
        return "rerun"
    here = Path.cwd()
    return str(beside.relative_to(here) if beside.is_relative_to(here) else beside)
