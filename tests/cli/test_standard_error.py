"""What real runs print on standard error: their own lines, and none of a library's or a program's."""

from __future__ import annotations

import json
import re
import signal
import socket
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.live import run_sockets
from tests.installed import started
from tests.live.processes import TIMEOUT_S, own_folder, runs, until, until_running

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

_NOISE = """
import logging, os, warnings
from dcmp_hil.control.observers.super_twisting import SuperTwisting

class Noisy(SuperTwisting):
    def __init__(self, setting):
        super().__init__(setting, mu0=100.0)
        os.write(2, b"a library in C\\n")
        logging.getLogger("library").warning("a library's log")
        warnings.warn("a library's warning")
"""


def _said(err: str) -> list[str]:
    """Return the lines that are not about files, nor about a voltage at its limit."""
    usual = re.compile(r"kept in |no viewer was open|or look at | +[0-9.]+ s  voltage limited")
    return [line for line in err.splitlines() if not usual.match(line)]


def _kept_in(folder: Path) -> Path:
    (kept,) = (folder / "runs").iterdir()
    return kept


@pytest.mark.parametrize("end", ["Ctrl-C", "stop"])
def test_nothing_is_said_of_watchers_that_are_connected_at_the_end(
    end: str, installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("run", "--viewer", "none", "--no-record", "--duration", "0")
    with own_folder(monkeypatch), started(installed, tmp_path, *options) as run:
        until_running(run)
        watchers = [socket.socket(socket.AF_UNIX) for _ in range(3)]
        for watcher in watchers:
            watcher.settimeout(TIMEOUT_S)
            watcher.connect(str(run_sockets.socket_of(run.pid)))
        watchers[0].sendall(b'{"do": "watch"}\n')  # as a panel does; the second one asks for nothing
        watchers[2].sendall(b'{"do": "wat')  # in the middle of a request
        lines = watchers[0].makefile("rb")
        assert lines.readline()  # it watches
        if end == "stop":
            watchers[1].sendall(b'{"do": "stop"}\n')
        else:
            run.send_signal(signal.SIGINT)
        with lines:
            last = list(lines)[-1]
        _, err = run.communicate(timeout=TIMEOUT_S)
        for watcher in watchers:
            watcher.close()
    told = json.loads(last)
    assert (told["ended"], told["at_zero"]) == ("Amplifier at 0 V.", True)
    assert run.returncode == 0
    assert err == ""


@pytest.mark.parametrize("mode", [(), ("--fast",), ("--no-record",)])
def test_what_libraries_say_goes_into_a_file(
    mode: tuple[str, ...], script: Callable[..., Finished], tmp_path: Path
) -> None:
    (tmp_path / "noise.py").write_text(_NOISE)
    options = ("--set", "observer.kind=noise:Noisy", "--duration", "0.3", "--viewer", "none")
    done = script("run", *options, *mode, env={"PYTHONPATH": str(tmp_path)})
    assert done.code == 0, done.err
    assert "a library" not in done.err
    if "--no-record" in mode:
        assert done.err == ""
        return
    said = (_kept_in(tmp_path) / "process.log").read_text()
    for line in ("a library in C", "a library's log", "a library's warning"):
        assert line in said


def test_what_the_viewer_s_program_says_goes_into_a_file(
    script: Callable[..., Finished], tmp_path: Path
) -> None:
    done = script("run", "--duration", "0.5", "--viewer", "web")
    kept = _kept_in(tmp_path)
    assert done.code == 0
    first, second = done.err.splitlines()
    assert first.startswith("web viewer: http://127.0.0.1:")
    assert second == f"kept in {kept.relative_to(tmp_path)}/"
    assert "INFO" in (kept / "process.log").read_text()


def test_a_quiet_run_leaves_no_log(script: Callable[..., Finished], tmp_path: Path) -> None:
    assert script("run", "--duration", "0.3", "--viewer", "none").code == 0
    assert not (_kept_in(tmp_path) / "process.log").exists()


def _unplugged(installed: Path, folder: Path) -> tuple[int | None, str]:
    """Run with a device until its process is killed; return how the run left, and what it said."""
    port = folder / "port"
    where = (
        "--set",
        "backend.kind=serial",
        "--set",
        f"backend.port={port}",
        "--set",
        "backend.watchdog_ms=50",
    )
    with started(installed, folder, "device", "--symlink", str(port)) as device:
        assert device.stdout is not None
        assert device.stdout.readline().strip() == str(port)
        # A reference at rest: a host that is late does least harm there.
        options = (*where, "--set", "reference.kind=hold", "--duration", "0", "--viewer", "none")
        with started(installed, folder, "run", *options) as run:
            until(lambda: run.poll() is not None or runs(run.pid), "the run got under way")
            device.kill()
            _, err = run.communicate(timeout=TIMEOUT_S)
    port.unlink(missing_ok=True)
    return run.returncode, err


def test_a_device_that_is_unplugged_is_one_error_once(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with own_folder(monkeypatch):
        attempt, code, err = 0, None, ""
        while attempt < 8 and code in {None, 4}:  # too busy a computer ends the run before, as it should
            attempt += 1
            folder = tmp_path / str(attempt)
            folder.mkdir()
            code, err = _unplugged(installed, folder)
    folder = tmp_path / str(attempt)
    kept = _kept_in(folder)
    assert code == 3, err
    (line,) = _said(err)
    assert line.startswith(f"error: {folder / 'port'}: ")
    assert "0 V" in line
    troubles = json.loads((kept / "summary.json").read_text())["troubles"]
    assert sum("0 V was not confirmed" in trouble for trouble in troubles) == 1
    assert (kept / "run.mcap").stat().st_size


def test_a_trip_is_one_error_once(script: Callable[..., Finished], tmp_path: Path) -> None:
    done = script("run", "--duration", "3", "--viewer", "none", "--fault", "plant.shove:at=1s,for=50ms")
    assert done.code == 4
    assert [line[:7] for line in _said(done.err)] == ["error: "]
    assert (_kept_in(tmp_path) / "black_box.csv").stat().st_size


@pytest.mark.parametrize("viewer", [(), ("--viewer", "spawn")])
@pytest.mark.parametrize(
    "display", ["DISPLAY=localhost:10.0", "DISPLAY=:987", "DISPLAY=rubbish", "WAYLAND_DISPLAY=wayland-987"]
)
def test_a_display_that_leads_nowhere_is_a_warning_and_a_picture(
    display: str, viewer: tuple[str, ...], script: Callable[..., Finished], tmp_path: Path
) -> None:
    if viewer and not display.startswith("DISPLAY=l"):
        pytest.skip("asked for in words, one display stands for all")
    done = script("run", "--fast", "--duration", "2", *viewer, env=dict([display.split("=")]))
    kept = _kept_in(tmp_path)
    first, *rest = done.err.splitlines()
    assert done.code == 0
    assert first == (
        f"warning: No viewer window: the display {display} cannot be opened. "
        "To watch in a browser: --viewer web."
    )
    assert [line.split(":")[0] for line in rest] == [
        f"kept in {kept.relative_to(tmp_path)}/",
        "no viewer was open; to see the run",
        f"or look at {kept.relative_to(tmp_path)}/run.png",
    ]
    names = {path.name for path in kept.iterdir()}
    assert names == {"run.mcap", "run.png", "run.rrd", "summary.json"}
