"""Processes of libFuzzer side by side, and what became of them."""

from __future__ import annotations

import re
import resource
import subprocess
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from tools.fuzz.build import TARGET

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

INPUT_BYTES_MAX = 96  # bytes: about 17 ticks
_STATISTICS = re.compile(
    r"^executions (\d+), ticks (\d+), ticks with frames (\d+), executions in RUN (\d+)$", re.MULTILINE
)


class Counts(NamedTuple):
    """Counters of the fuzz target."""

    executions: int
    ticks: int
    ticks_with_frames: int
    in_run: int


@dataclass(frozen=True)
class Outcome:
    """Findings of one process.

    `wrong` is what the model, the invariants or a sanitizer said, "" for nothing; `executions` is how many it
    took, the one that found it included.
    """

    counts: Counts
    wrong: str
    input: Path | None
    executions: int


@dataclass(frozen=True)
class Campaign:
    """Findings of all processes together."""

    outcomes: tuple[Outcome, ...]
    wall_s: float
    cpu_s: float

    @property
    def total(self) -> Counts:
        """The counts of all processes."""
        return Counts(*(sum(column) for column in zip(*(each.counts for each in self.outcomes), strict=True)))


def seed_inputs() -> list[bytes]:
    """Return the inputs to begin with."""
    lines = (TARGET / "seeds.txt").read_text("utf-8").splitlines()
    return [bytes.fromhex(line) for line in lines if line and not line.startswith("#")]


def command(program: Path, folder: Path, runs: int, seed: int, seconds: int) -> list[str]:
    """Return what starts a process; what it keeps of its inputs goes into `folder`/corpus."""
    options = {
        "runs": runs,
        "seed": seed,
        "max_total_time": seconds,
        "max_len": INPUT_BYTES_MAX,
        "len_control": 0,  # long inputs from the start: a state is reached by many operations
        "verbosity": 0,
        "print_final_stats": 1,
        "artifact_prefix": f"{folder}/",
        "timeout": 20,
    }
    return [str(program), *(f"-{name}={value}" for name, value in options.items()), str(folder / "corpus")]


def _outcome(folder: Path, said: str, code: int) -> Outcome:
    counted = _STATISTICS.search(said)
    counts = Counts(*map(int, counted.groups())) if counted else Counts(0, 0, 0, 0)
    units = re.search(r"^stat::number_of_executed_units: (\d+)$", said, re.MULTILINE)
    executions = int(units[1]) if units else counts.executions
    if code == 0:
        return Outcome(counts, "", None, executions)
    told = re.search(r"^wrong: (.*)$", said, re.MULTILINE) or re.search(
        r"(runtime error: .*|ERROR: .*)$", said, re.MULTILINE
    )
    inputs = [
        path for path in folder.iterdir() if path.name.startswith(("crash-", "timeout-", "leak-", "oom-"))
    ]
    return Outcome(counts, told[1] if told else said[-2000:], inputs[0] if inputs else None, executions)


def run(
    program: Path, folder: Path, *, runs: int, jobs: int = 1, seed: int = 1, seconds: int = 600
) -> Campaign:
    """Run processes until each has done its part, something is wrong, or time is over.

    Parameters
    ----------
    runs
        Executions of all processes together.
    seconds
        The longest that it may take, wall clock.
    """
    folders = [folder / f"{program.name}-{job}" for job in range(jobs)]
    for each in folders:
        (each / "corpus").mkdir(parents=True)
        for number, seed_input in enumerate(seed_inputs()):
            (each / "corpus" / f"seed-{number}").write_bytes(seed_input)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.monotonic()
    part = -(-runs // jobs)
    processes = [
        subprocess.Popen(  # noqa: S603
            command(program, each, part, seed + job, seconds),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        for job, each in enumerate(folders)
    ]
    said = [process.communicate()[1] for process in processes]
    wall_s = time.monotonic() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    outcomes = [
        _outcome(each, text, process.returncode)
        for each, text, process in zip(folders, said, processes, strict=True)
    ]
    return Campaign(
        tuple(outcomes), wall_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    )


def corpora(folder: Path) -> Sequence[Path]:
    """Return every input that the processes of a folder kept."""
    return sorted(path for path in folder.glob("*/corpus/*") if path.is_file())
