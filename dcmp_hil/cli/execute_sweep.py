"""The command `dcmp-hil sweep`, step by step: prepare, run with a progress bar, print what came of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.cli import console
from dcmp_hil.cli.outputs import json_place, try_folder, try_places
from dcmp_hil.cli.sweep_progress import SweepProgress
from dcmp_hil.cli.sweep_view import dry_run_table, engine_sentences, quantile_table, worst_runs
from dcmp_hil.errors import ConfigError, DcmpError, ExitCode
from dcmp_hil.sweeping.api import executor_for
from dcmp_hil.sweeping.parts import load_pyarrow
from dcmp_hil.sweeping.picture import draw_sweep
from dcmp_hil.sweeping.preparation import prepare
from dcmp_hil.sweeping.result import SweepResult
from dcmp_hil.sweeping.spec_file import load_spec
from dcmp_hil.sweeping.sweep import SweepRun

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.sweeping.executor import Executor
    from dcmp_hil.sweeping.preparation import PreparedSweep

_PICTURE_NAME = "sweep.png"


class SweepOptions(NamedTuple):
    """Options of the command."""

    out: Path
    dry_run: bool
    plain: bool
    workers: int | None
    scheduler: str
    picture: bool
    json_file: str | None


def execute(source: Path, options: SweepOptions) -> int:
    """Run a sweep; return the exit code.

    Raises
    ------
    ConfigError, BackendError
        If it cannot start, or cannot go on.
    """
    try_places({"--json": json_place(options.json_file)}, {"SPEC.toml": source}, force=True)
    load_pyarrow()
    progress = SweepProgress()
    try:
        spec = load_spec(source)
        with console.err.status("looking at the rig, and timing a few runs ..."):
            prepared = prepare(spec, str(source), plain=options.plain)
            executor = executor_for(prepared.cpu_s, options.workers, options.scheduler)
        if not options.dry_run:
            try_folder("--out", options.out)
        run = SweepRun(prepared, executor, options.out, together=bool(options.scheduler))
        if options.dry_run:
            return _tell_dry_run(prepared, run, executor, options)
        for sentence in engine_sentences(prepared, executor.words):
            console.note(sentence)
        with progress:
            for one in run:
                progress.show(one, prepared.design.total)
    except KeyboardInterrupt:
        console.note(f"interrupted: {progress.words} in {options.out}; the same command continues")
        return ExitCode.INTERRUPTED
    except DcmpError as error:
        if progress.began:
            error.add_note(f"{progress.words} in {options.out}; the same command continues")
        raise
    return _tell(SweepResult(spec, run.table(), options.out), prepared, options)


def _tell_dry_run(
    prepared: PreparedSweep, run: SweepRun, executor: Executor, options: SweepOptions
) -> ExitCode:
    """Print what a sweep would take."""
    runs = prepared.design.total
    figures = {
        "runs": runs,
        "refused_share": prepared.refused,
        "engines": [one._asdict() for one in prepared.shares],
        "executor": executor.words,
        "cpu_s": prepared.cpu_s,
        "bytes": run.bytes_to_write,
        "parts": len(run.blocks),
        "folder": str(options.out),
    }
    if options.json_file != "-":
        console.out.print(dry_run_table(figures, engine_sentences(prepared, executor.words)))
    if options.json_file is not None:
        console.write_json(options.json_file, figures)
    run.require_room()
    return ExitCode.OK


def _tell(result: SweepResult, prepared: PreparedSweep, options: SweepOptions) -> ExitCode:
    """Print, draw and write what a sweep found."""
    worst = result.worst()
    if options.json_file != "-":
        console.out.print(quantile_table(result))
        for line in worst_runs(worst):
            console.out.print(line, soft_wrap=True)
    fault: ConfigError | None = None
    drawn = ""
    if options.picture:
        path = options.out / _PICTURE_NAME
        try:
            drawn = draw_sweep(result, path)
            console.note(f"wrote {path}: {drawn}")
        except ConfigError as error:
            fault = error
    if options.json_file is not None:
        console.write_json(options.json_file, _document(result, prepared, drawn))
    console.note(f"results in {options.out}: {result.table.num_rows:,} runs, Parquet")
    if fault is not None:
        raise fault
    return ExitCode.OK


def _document(result: SweepResult, prepared: PreparedSweep, drawn: str) -> dict[str, Any]:
    engines = result.table.column("engine").to_pylist()
    return {
        "rig": result.spec.rig,
        "runs": result.table.num_rows,
        "engines": {name: engines.count(name) for name in sorted(set(engines) - {""})},
        "why": {one.engine: list(one.reasons) for one in prepared.shares},
        "tripped": int(result.tripped.sum()),
        "refused": int(result.refused.sum()),
        "quantiles": [one._asdict() for one in result.quantiles()],
        "worst": [one._asdict() for one in result.worst()],
        "folder": str(result.folder),
        "picture": drawn,
    }
