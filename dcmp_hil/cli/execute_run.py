"""One `dcmp-hil run` from options to exit code."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.cli import console
from dcmp_hil.cli.comparison_table import comparison_table
from dcmp_hil.cli.friction_offer import offer
from dcmp_hil.cli.library_output import split_stderr
from dcmp_hil.cli.orphaned_run import Unattended
from dcmp_hil.cli.outputs import json_place, try_places
from dcmp_hil.cli.recording_check import check_recording, space_warning
from dcmp_hil.cli.run_document import run_document, write_json
from dcmp_hil.cli.run_folder import RunFolder
from dcmp_hil.cli.run_sinks import dashboard, dashboard_replacing, recording, status_line
from dcmp_hil.cli.summary import summary_table
from dcmp_hil.cli.viewer import chosen
from dcmp_hil.comparison import compare_result
from dcmp_hil.config import Rig, load_rig
from dcmp_hil.config.edited_file import is_file
from dcmp_hil.config.explain import warnings
from dcmp_hil.control.references.table import Table
from dcmp_hil.errors import DcmpError, ExitCode, IncompleteError, TripError
from dcmp_hil.fault_hooks import inject, needs_wire
from dcmp_hil.platform import process_log
from dcmp_hil.platform.disk_space import room_for
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.plugins.exits import exits_named
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.session import Session
from dcmp_hil.telemetry.rerun import viewer as window

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.comparison import ObserverComparison
    from dcmp_hil.fault_hooks import Faults
    from dcmp_hil.live.command_process import CommandProcess
    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.rerun.sink import Viewer
    from dcmp_hil.telemetry.sink_factories import SinkMaker

INCOMPLETE_ENDED_BY = "recording_incomplete"
"""How a run ended that went well, and is not wholly in its recording."""
_BOARD_OVERRIDE = "backend.kind=sim-board"
_KEPT_DURATION_MAX_S = 600.0  # s: a longer run is not kept in memory for a picture or a comparison


@dataclass(frozen=True, slots=True)
class Options:
    """Options of the command line; None if an option was not given."""

    duration: float | None
    window_from: float
    fast: bool
    viewer: Viewer | None
    record: Path | None
    keep: bool
    json_file: str | None
    note: str
    faults: tuple[str, ...] = ()
    control: bool = True
    clear: bool = False
    compare: tuple[str, ...] = ()
    force: bool = False
    source: str = ""  # the rig's file or name


def execute(rig_name: str, overrides: Sequence[str], options: Options) -> int:
    """Run, show, keep; return the exit code."""
    places = {"--json": json_place(options.json_file), "--record": options.record}
    read = {"the rig": Path(rig_name)} if rig_name.endswith(".toml") else {}
    try_places(places, read, force=options.force)
    rig = load_rig(rig_name, overrides)
    if isinstance(rig.reference, Table):
        try_places(places, {"the file of the reference": Path(rig.reference.file)}, force=options.force)
    for sentence in warnings(rig):
        console.warn(sentence)
    if rig.backend.kind == "sim" and needs_wire(options.faults):
        console.warn(
            f"backend.kind = sim has no wire, and a fault needs one: this run has {_BOARD_OVERRIDE}."
        )
        rig = load_rig(rig_name, [*overrides, _BOARD_OVERRIDE])
    faults = inject(rig, options.faults, "--fault")
    # From here on stops are heard: opening a viewer takes its time, too.
    with StopRequest() as stop:
        source = str(Path(rig_name).absolute()) if is_file(rig_name) else rig_name
        return _run(rig, faults, replace(options, viewer=chosen(options.viewer), source=source), stop)


def _run(rig: Rig, faults: Faults, options: Options, stop: StopRequest) -> int:
    """Run, and keep files before anything is printed; the run's own end decides the exit code."""
    folder = RunFolder(rig.name) if options.keep else None
    session, incomplete = None, ""
    try:
        with split_stderr(folder.path / process_log.LOG_FILE_NAME if folder else None):
            session = _session(rig, faults, options, folder, stop)
            end = _to_its_end(session)
            if session.began:
                incomplete = _conclude(session, options, folder, end)
    finally:
        if folder is not None and not (session is not None and session.began):  # its error says why
            folder.discard()
    if end.error is not None:
        raise end.error
    if not session.began:
        console.note(f"ended by {end.ended_by} before the first cycle: no device was armed, nothing is kept")
        return end.code or ExitCode.INTERRUPTED
    if incomplete and end.code == 0:
        raise IncompleteError(incomplete)
    return end.code


def _session(
    rig: Rig, faults: Faults, options: Options, folder: RunFolder | None, stop: StopRequest
) -> Session:
    length = rig.run.duration_s if options.duration is None else options.duration
    if folder is not None:
        picture = options.record is None
        sentence = space_warning(folder.path, room_for(folder.own), rig, length, picture=picture)
        if sentence:
            console.warn(sentence)
    return Session(
        rig,
        duration=options.duration,
        fast=options.fast,
        window_from=options.window_from,
        sinks=_makers(rig, options, folder),
        keep_columns=0 < length <= _KEPT_DURATION_MAX_S and _wants_columns(options, folder),
        stop=stop,
        warn=console.warn,
        control=_control(rig, options, folder),
        faults=faults,
        clear=options.clear,
        compare=options.compare,
    )


class _End(NamedTuple):
    """End of a run: a fixed word, the error, and the exit code without an error."""

    ended_by: str
    error: BaseException | None
    code: int


def _to_its_end(session: Session) -> _End:
    stop = session.stop
    try:
        with exits_named():
            session.run()
    except TripError as trip:
        return _End(trip.reason, trip, trip.exit_code)
    except KeyboardInterrupt:  # a second Ctrl-C, because something hung; 0 V was driven on the way out
        return _End("KeyboardInterrupt", None, ExitCode.INTERRUPTED)
    except SystemExit as leaving:  # its code would be that of the run
        error = DcmpError(f"Something in the run called sys.exit: {leaving.code}.")
        return _End("SystemExit", error, ExitCode.FAILED)
    except BaseException as failure:  # noqa: BLE001 - raised again as soon as everything is kept
        return _End(type(failure).__name__, failure, ExitCode.FAILED)
    return _End(stop.asked_by or "duration", None, stop.exit_code)


def _control(rig: Rig, options: Options, folder: RunFolder | None) -> CommandProcess | None:
    """Return the process through which clients control the run; None in virtual time."""
    if options.fast:
        return None
    from dcmp_hil.live.command_process import CommandProcess

    place = folder.path.absolute() if folder else None
    unattended = Unattended(rig, place, options.json_file, options.note, options.faults)
    return CommandProcess(listen=options.control, unattended=unattended, source=options.source)


def _makers(rig: Rig, options: Options, folder: RunFolder | None) -> list[SinkMaker]:
    """Return the sinks of a run: status line, its own recording, and Rerun with a viewer or a file."""
    makers: list[SinkMaker] = [partial(status_line, rig.period)]
    if folder is not None:
        run, text = about(rig, options.note, options.faults, folder.path), rig_json(rig)
        makers.append(partial(recording, folder.own, rig.period, run, text))
    viewer = options.viewer or "none"
    own = folder.recording if folder else None
    if options.record is not None or own is not None or viewer != "none":
        from dcmp_hil.telemetry.rerun.rig_view import view_of

        view = view_of(rig)
        if options.record is not None:
            makers.append(partial(dashboard_replacing, view, options.record, viewer, window.VIEWER_PORT))
        else:
            makers.append(partial(dashboard, view, own, viewer, window.VIEWER_PORT))
    return makers


def _wants_columns(options: Options, folder: RunFolder | None) -> bool:
    """Return whether a run is compared, or leaves a picture: without a viewer it does."""
    return bool(options.compare) or (folder is not None and _wants_picture(options))


def _wants_picture(options: Options) -> bool:
    """Return whether a run without a viewer leaves a picture."""
    return options.viewer == "none"


def _compared(result: Result) -> ObserverComparison | None:
    """Compare the observers, if that was asked for; without a table, everything else is kept and shown."""
    try:
        comparison = compare_result(result)
    except Exception as error:  # noqa: BLE001 - numbers of any kind may come of a run that tripped
        console.warn(f"The observers could not be compared: {type(error).__name__}: {error}.")
        return None
    if comparison is not None:
        for note in comparison.notes:
            console.note(note)
        if not result.columns:
            longest = f"{_KEPT_DURATION_MAX_S:g} s"
            console.note(f"a run of more than {longest}, or without end, is compared over its last cycles")
    return comparison


def _conclude(session: Session, options: Options, folder: RunFolder | None, end: _End) -> str:
    """Write and print the figures after every kind of end; return a sentence on what the folder lacks."""
    cut_off = session.stop.requested
    with session.stop.held():
        result = session.result()
        kept = check_recording(folder.own, result.periods, wait=not cut_off) if folder else None
        ended_by = end.ended_by
        if kept is not None and not kept.complete and end.error is None and end.code == 0:
            ended_by = INCOMPLETE_ENDED_BY
        comparison = _compared(result)
        document = run_document(session.rig, options.note, options.faults, result, ended_by, kept, comparison)
        missing = folder.write(session.rig, document, end.error) if folder else []
        incomplete = kept.why if kept is not None and kept.why else "".join(missing[:1])
        missing += write_json(options.json_file, document)
    with suppress(KeyboardInterrupt):  # a user need not wait for a slow reader, or for a picture
        if options.json_file == "-":
            console.write_json("-", document)
        else:
            console.out.print(summary_table(session.rig, result, ended_by))
            if comparison is not None:
                console.out.print(comparison_table(comparison))
        for sentence in missing:
            console.warn(sentence)
        if folder is not None:
            if not cut_off and _wants_picture(options):  # drawing takes seconds, and the end was asked for
                folder.draw(result)
            folder.tell(options.record, live=options.viewer != "none")
        offer(result.summary.friction, options.source)
    return incomplete
