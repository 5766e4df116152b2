"""Whether a run that has ended is in its recording, wholly."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.platform.clock import pause
from dcmp_hil.recording.completeness import ending_of

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.config import Rig

_ATTEMPTS_MAX, _ATTEMPT_PERIOD_S = 50, 0.02  # s: the telemetry process may still be closing it
_DATA_BYTES_PER_PERIOD, _PICTURE_BYTES_PER_PERIOD = 140.0, 170.0  # bytes a period, of run.mcap and of run.rrd
_UNLIMITED_RUN_DURATION_S = 600.0  # s that a run without a duration is taken for
_MB_PER_BYTE = 1e-6


class RecordingCheck(NamedTuple):
    """Completeness of a run's recording, as the end of its file states it.

    Parameters
    ----------
    file
        Its name.
    complete
        Whether all of it is.
    periods
        How many are; None where the file does not say it.
    missing
        Device time from and to, s, and number of periods that are known to be missing.
    why
        What is wrong, as a sentence; empty where nothing is.
    """

    file: str
    complete: bool
    periods: int | None
    missing: tuple[tuple[float, float, int], ...]
    why: str

    def document(self) -> dict[str, Any]:
        """Return what the recording holds as a document for `--json`."""
        return self._asdict()


def check_recording(path: Path, periods: int, *, wait: bool) -> RecordingCheck:
    """Check the end of a run's recording.

    Parameters
    ----------
    path
        The file.
    periods
        How many the run had.
    wait
        Whether a second may be waited for a file that is still being closed.
    """
    ending = ending_of(path)
    looks = _ATTEMPTS_MAX if wait else 0
    while ending is None and looks and path.exists():
        looks -= 1
        pause(_ATTEMPT_PERIOD_S)
        ending = ending_of(path)
    if ending is None:
        why = "its end is missing" if path.exists() else "it is gone"
        return RecordingCheck(path.name, False, None, (), f"{path}: {why}; what is there can be read.")
    lost = sum(many for _, _, many in ending.missing)
    if lost:
        spans = ", ".join(f"{start:.6g} s to {stop:.6g} s" for start, stop, _ in ending.missing)
        why = f"{path} misses {lost} of {periods} periods, device time {spans}: the disk was full."
        return RecordingCheck(path.name, False, ending.periods - lost, ending.missing, why)
    if ending.periods < periods:
        why = f"{path} misses {periods - ending.periods} of {periods} periods: its disk was too slow."
        return RecordingCheck(path.name, False, ending.periods, (), why)
    return RecordingCheck(path.name, True, ending.periods, (), "")


def space_warning(folder: Path, free: float, rig: Rig, length: float, *, picture: bool) -> str:
    """Return a warning that a run will not fit on its disk; empty if it will.

    Parameters
    ----------
    folder
        Where it is kept.
    free
        bytes.
    rig
        What is run.
    length
        s; 0 is until the user stops it.
    picture
        Whether run.rrd goes there as well.
    """
    seconds = length or _UNLIMITED_RUN_DURATION_S
    data = _DATA_BYTES_PER_PERIOD * rig.loop.rate_hz * seconds
    needed = data + (_PICTURE_BYTES_PER_PERIOD * min(rig.loop.rate_hz, 2000.0) * seconds if picture else 0.0)
    if free >= needed:
        return ""
    fits = free / (_DATA_BYTES_PER_PERIOD * rig.loop.rate_hz)
    what = f"{seconds:g} s" if length else "ten minutes of a run until Ctrl-C"
    return (
        f"{folder}: {_MB_PER_BYTE * free:.3g} MB are free, and {what} at {rig.loop.rate_hz:g} Hz need about "
        f"{_MB_PER_BYTE * needed:.3g} MB, {_MB_PER_BYTE * data:.3g} of them for run.mcap. Free some space, "
        f"or choose --duration {max(1.0, float(f'{fits:.2g}')):g} at most; run.rrd ends first."
    )
