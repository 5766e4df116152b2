"""The folder that a run leaves behind: figures, rig, recording, picture, and the black box after a trip."""

from __future__ import annotations

import shutil
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.cli import console
from dcmp_hil.cli.black_box import black_box
from dcmp_hil.common.atomic_file import write_text
from dcmp_hil.errors import ConfigError, TripError
from dcmp_hil.platform.clock import utc_now

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result

_RUNS_FOLDER = Path("runs")


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
        self._made_parent = not _RUNS_FOLDER.exists()
        if _RUNS_FOLDER.is_symlink() and self._made_parent:
            raise ConfigError(
                f"{_RUNS_FOLDER} is a link to {_RUNS_FOLDER.readlink()}, which is not there. Make that "
                "folder, remove the link, or use --no-record."
            )
        if not self._made_parent and not _RUNS_FOLDER.is_dir():
            raise ConfigError(
                f"{_RUNS_FOLDER} is no folder. Call it something else, start elsewhere, or use --no-record."
            )
        stem = f"{utc_now():%Y%m%dT%H%M%SZ}-{rig_name}"
        for suffix in ("", *(f"-{n}" for n in range(2, 100))):
            self.path = _RUNS_FOLDER / f"{stem}{suffix}"
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
        raise ConfigError(f"{_RUNS_FOLDER / stem}: 99 runs began in this second. Wait a moment.")

    @property
    def recording(self) -> Path:
        """Return the path of the viewer's recording."""
        return self.path / "run.rrd"

    @property
    def own(self) -> Path:
        """Return the path of the run's own recording."""
        return self.path / "run.mcap"

    def write(self, rig: Rig, document: dict[str, Any], error: BaseException | None) -> list[str]:
        """Write figures and black box, print nothing; return a sentence for each that is missing."""
        figures = {**document, "rig_toml": rig.model_dump(mode="json")}
        missing = [self._kept("summary.json", lambda path: write_text(path, console.as_json(figures)))]
        if isinstance(error, TripError):
            missing.append(self._kept("black_box.csv", lambda path: write_text(path, black_box(error))))
        return [sentence for sentence in missing if sentence]

    def _kept(self, name: str, write: Callable[[Path], None]) -> str:
        """Write one file of the run; return the error message, empty if there is none."""
        try:
            write(self.path / name)
        except Exception as error:  # noqa: BLE001 - a file that is missing must not cost another one
            return f"{self.path} is incomplete: {name}: {getattr(error, 'strerror', None) or error}"
        return ""

    def discard(self) -> None:
        """Remove the folder of a run that never began, and the one above it if it is the only one ever."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._made_parent:
            with suppress(OSError):
                self.path.parent.rmdir()

    def tell(self, record: Path | None, *, live: bool) -> None:
        """Print the paths of the files, and the commands that show them."""
        if not self.path.exists():  # a warning has said so
            return
        console.note(f"kept in {self.path}/")
        recording = record or self.recording
        if not live and recording.exists():
            console.note("no viewer was open; to see the run:", f"{_viewer_command()} {recording}")
        picture = self.path / "run.png"
        if picture.exists():
            console.note(f"or look at {picture}")

    def draw(self, result: Result) -> None:
        """Draw the run, if its columns were kept; without a picture it is as complete."""
        if not result.columns:
            return
        picture = self.path / "run.png"
        try:
            from dcmp_hil.telemetry.run_plot import draw_run

            draw_run(result.columns, result.rig.name, picture)
        except BaseException as error:
            with suppress(OSError):
                picture.unlink()  # half a picture
            if not isinstance(error, Exception):
                raise
            # Matplotlib is an extra, the disk may be full, and settings of Matplotlib may be wrong.
            console.note(f"no picture: {str(error) or type(error).__name__}")


def _viewer_command() -> str:
    """Return the command of the viewer: it is installed beside this Python, which need not be on the path."""
    beside = Path(sys.executable).with_name("rerun")
    if shutil.which("rerun") or not beside.exists():
        return "rerun"
    try:
        return str(beside.relative_to(Path.cwd()))
    except (OSError, ValueError):  # the current folder is gone, or another one
        return str(beside)
