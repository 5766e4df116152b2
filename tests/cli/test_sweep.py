"""`dcmp-hil sweep`: lines, files, exit codes, and commands that repeat a run to the bit."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil import sweep
from dcmp_hil.sweeping.block_work import BlockWork
from sim_backend.lanes import library
from tests.sweeping.specs import by_command, row, written

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

IMMEDIATE = {"supervisor.start": "immediate"}
COUNTS = {"choice": [2048, 4096]}
# One of each kind: a grid, a draw, an encoder's phase, lost samples; each with a command of its own.
KINDS: dict[str, dict[str, Any]] = {
    "grid": {"grid": {"controller.kp_1_s2": [4000.0, 5000.0]}},
    "draw": {
        "draw": {
            "model.f0_1_s": {"loguniform": [0.05, 0.3]},
            "encoder.counts_per_rev": {"choice": [2048, 4096]},
        }
    },
    "phase": {"draw": {"sim.encoder_phase_counts": {"uniform": [0.0, 1.0]}}},
    "lost": {"grid": {"sim.lost_samples": [0.05]}, "set": {**IMMEDIATE, "sim.encoder_noise_counts": 0.5}},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("plain", [True, False])
def test_a_printed_command_gives_the_bits_of_its_run(
    kind: str, cli: Callable[..., Any], *, plain: bool
) -> None:
    tables = {"rig": "bench-1khz", "duration_s": 0.5, "runs": 2, "set": IMMEDIATE, **KINDS[kind]}
    result = sweep(tables, plain=plain)
    (worst, *_) = result.worst()
    assert not worst.tripped
    assert by_command(cli, worst.command) == row(result.table, worst.run)


TEXT = """rig = "bench-1khz"
duration_s = 0.2
runs = 4
[set]
supervisor.start = "immediate"
[draw]
sim.plant.f1_rad_s2 = { uniform = [1.0, 2.0] }
"""


def test_command_tells_engine_quantiles_worst_runs_and_keeps_parts(
    cli: Callable[..., Any], tmp_path: Path
) -> None:
    place = written(tmp_path, TEXT)
    dry = cli("sweep", str(place), "--dry-run", "--json", "dry.json")
    assert dry.code == 0
    assert {"runs", "engine", "CPU time", "results"} <= {line[:8].strip() for line in dry.out.splitlines()}
    assert json.loads((tmp_path / "dry.json").read_text("utf-8"))["runs"] == 4
    assert not (tmp_path / "sweeps").exists()
    done = cli("sweep", str(place), "--json", "figures.json")
    assert done.code == 0, done.err
    assert "engine: " in done.err
    assert "wrote sweeps/spec/sweep.png: distribution" in done.err
    assert "tracking_rms_rad" in done.out
    assert done.out.count("dcmp-hil run bench-1khz --fast --duration 0.2s --set ") == 3
    document = json.loads((tmp_path / "figures.json").read_text("utf-8"))
    assert (document["runs"], document["tripped"], len(document["worst"])) == (4, 0, 3)
    again = cli("sweep", str(place), "--json", "-", "--no-picture")
    assert "4 of 4 runs are there already" in again.err
    assert json.loads(again.out)["quantiles"] == document["quantiles"]


@pytest.mark.parametrize(
    ("text", "options", "code", "sentence"),
    [
        ("runz = 3\n" + TEXT, (), 2, "runz: unknown key. Did you mean runs?"),
        (TEXT.replace("[1.0, 2.0]", "[2.0, 1.0]"), (), 2, "an empty range"),
        (TEXT, ("--scheduler", "nonsense"), 2, "nonsense"),
        (TEXT, ("--out", "/proc/none"), 2, "/proc/none"),
    ],
)
def test_bad_input_is_one_sentence(
    cli: Callable[..., Any], tmp_path: Path, text: str, options: tuple[str, ...], code: int, sentence: str
) -> None:
    outcome = cli("sweep", str(written(tmp_path, text)), *options)
    assert outcome.code == code, outcome.err
    (line,) = (one for one in outcome.err.splitlines() if one.startswith("error: "))
    assert sentence in line
    assert "Traceback" not in outcome.err


def test_a_scheduler_that_is_not_there_is_named(cli: Callable[..., Any], tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    outcome = cli("sweep", str(written(tmp_path, TEXT)), "--scheduler", "tcp://127.0.0.1:9")
    assert (outcome.code, outcome.err.count("error: ")) == (3, 1), outcome.err
    assert "127.0.0.1:9" in outcome.err


def test_dask_that_is_not_installed_is_named_with_what_installs_it(
    cli: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    outcome = cli("sweep", str(written(tmp_path, TEXT)), "--scheduler", "tcp://127.0.0.1:9")
    assert outcome.code == 3
    assert "pip install 'dcmp-hil[cluster]'" in outcome.err


def test_ctrl_c_is_one_line_and_130(
    cli: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = written(tmp_path, TEXT)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(BlockWork, "__call__", interrupted)
    outcome = cli("sweep", str(place))
    assert outcome.code == 130
    assert outcome.err.splitlines()[-1].startswith(
        "interrupted: 0 of 4 runs are kept in sweeps/spec; the same"
    )


def test_without_a_compiler_the_plain_loop_takes_over_and_says_so(
    cli: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("CC", raising=False)
    library.load.cache_clear()
    outcome = cli("sweep", str(written(tmp_path, TEXT)), "--no-picture")
    assert outcome.code == 0, outcome.err
    assert re.search(r"engine: the plain loop, \S+ ms of CPU time a run, in this process: ", outcome.err)
    assert "compiler" in outcome.err


@pytest.mark.untraced
def test_a_real_sweep_is_interrupted_killed_and_continues_to_the_same_bits(tmp_path: Path) -> None:
    place = written(tmp_path, TEXT.replace("runs = 4", "runs = 40").replace("0.2", "0.4"))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "dcmp_hil", "sweep", str(place), "--out", str(out), "--plain"]

    def until_there_are_more_parts() -> subprocess.Popen[str]:
        before = len(list(out.glob("part-*")))
        process = subprocess.Popen(
            [*command, "--workers", "2"], stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        while process.poll() is None and len(list(out.glob("part-*"))) == before:
            time.sleep(0.01)
        return process

    interrupted = until_there_are_more_parts()
    os.killpg(interrupted.pid, signal.SIGINT)
    _, said = interrupted.communicate()
    assert (interrupted.returncode, said.count("interrupted: ")) == (130, 1), said
    assert "of 40 runs are kept" in said.splitlines()[-1]
    killed = until_there_are_more_parts()
    killed.kill()
    killed.communicate()  # ends when its workers have closed standard error
    assert 0 < len(list(out.glob("part-*"))) < 20
    found = sweep(place, out=out, plain=True)
    assert str(found.table.to_pylist()) == str(sweep(place, plain=True).table.to_pylist())
