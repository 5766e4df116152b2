"""Replay: an observer over any recording of position and torque or voltage, judged by a zero-phase reference.

recording = read_recording(Path("swingup.csv"))
result = replay(recording, ReplaySettings(inertia=0.16))
result.figures.velocity_error_rms_rad_s
"""

from dcmp_hil.offline.error_metrics import Estimates, Figures
from dcmp_hil.offline.export import columns, write_csv, write_rrd
from dcmp_hil.offline.reading import read_recording
from dcmp_hil.offline.recording import ColumnOptions, LoggedSignals
from dcmp_hil.offline.resolution import estimate_counts_per_rev
from dcmp_hil.offline.run import ReplayResult, replay
from dcmp_hil.offline.settings import ReplaySettings
from dcmp_hil.offline.zero_phase import ZeroPhase, zero_phase

__all__ = [
    "ColumnOptions",
    "Estimates",
    "Figures",
    "LoggedSignals",
    "ReplayResult",
    "ReplaySettings",
    "ZeroPhase",
    "columns",
    "estimate_counts_per_rev",
    "read_recording",
    "replay",
    "write_csv",
    "write_rrd",
    "zero_phase",
]
