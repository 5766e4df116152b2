"""A run's figures as a document: what `--json` and summary.json hold."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from dcmp_hil import __version__
from dcmp_hil.cli import console
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.cli.recording_check import RecordingCheck
    from dcmp_hil.comparison import ObserverComparison
    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result


def run_document(
    rig: Rig,
    note: str,
    faults: Sequence[str],
    result: Result,
    ended_by: str,
    kept: RecordingCheck | None = None,
    comparison: ObserverComparison | None = None,
) -> dict[str, Any]:
    """Return what `--json` writes; `kept` is None where nothing is recorded, or it was not looked at."""
    return {
        **asdict(result.summary),
        "friction": _friction(result),
        "rig": rig.name,
        "note": note,
        "faults": faults,
        "version": __version__,
        "ended_by": ended_by,
        "recording": kept and kept.document(),
        "dropped_periods": result.dropped,
        "link": _link(result),
        "device_end": result.device_end and result.device_end._asdict(),
        "overruns": result.overruns,
        "outliers": result.outliers,
        "comparison": comparison and comparison.to_dict(),
        "motor_gain": result.motor_gain and result.motor_gain.document(),
        "troubles": result.troubles,
        "changes": result.changes,
        "engine": result.engine,
        "engine_reason": result.engine_reason,
        "realtime": {grant.what: grant.refusal or "granted" for grant in result.grants},
        "host": result.host,
    }


def write_json(target: str | None, document: dict[str, Any]) -> list[str]:
    """Write the file of `--json`; return what went wrong."""
    if target is None or target == "-":
        return []
    try:
        console.write_json(target, document)
    except ConfigError as error:
        return [str(error)]
    return []


def _friction(result: Result) -> dict[str, Any] | None:
    """Return the friction found, and what of it is offered for the model; None where none is found."""
    found = result.summary.friction
    return None if found is None else asdict(found) | {"offered_rad_s2": found.offered}


def _link(result: Result) -> dict[str, Any] | None:
    """Return the counters of a link, and what they mean."""
    if result.link is None:
        return None
    return asdict(result.link) | {"warnings": [concern._asdict() for concern in result.link_concerns]}
