"""Users whom the system does not know, and folders that they may not enter: through the script."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from tests.installed import environment

if TYPE_CHECKING:
    from pathlib import Path

OTHER_USER_ID = 20_000 + os.getpid() % 40_000  # a folder in /tmp may be left of another one
AS_STRANGER = ["unshare", "--user", f"--map-user={OTHER_USER_ID}", f"--map-group={OTHER_USER_ID}"]


def as_stranger(
    installed: Path, folder: Path, *arguments: str, **env: str
) -> subprocess.CompletedProcess[str]:
    """Run the script as a user without a name, a home folder, and root's privileges."""
    if shutil.which("unshare") is None or subprocess.run([*AS_STRANGER, "true"], check=False).returncode:
        pytest.skip("this system lets us make no namespace for users")
    names = ("HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "TMPDIR")
    return subprocess.run(
        [*AS_STRANGER, str(installed), *arguments],
        cwd=folder,
        env=environment(**dict.fromkeys(names, None) | env),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="there is no C compiler")
def test_virtual_device_is_compiled_where_there_is_no_home(installed: Path, tmp_path: Path) -> None:
    place = tmp_path / "tmp"
    place.mkdir()
    board = ("--set", "backend.kind=sim-board", "--viewer", "none")
    done = as_stranger(installed, tmp_path, "run", "--fast", "--duration", "1", *board, TMPDIR=str(place))
    assert done.returncode == 0, done.stderr
    assert [
        line for line in done.stderr.splitlines() if not line.startswith(("kept", "no viewer", "or look"))
    ] == []
    (run,) = (tmp_path / "runs").iterdir()
    assert {path.name for path in run.iterdir()} == {"summary.json", "run.mcap", "run.rrd", "run.png"}
    cache = place / f"dcmp-hil-{OTHER_USER_ID}"
    assert cache.stat().st_mode & 0o777 == 0o700
    assert sorted(path.name.partition("-")[0] for path in cache.rglob("*.so")) == ["libdcmp", "libsim"]


def test_cache_that_others_may_write_is_refused(installed: Path, tmp_path: Path) -> None:
    """A library that another user put there would be loaded into the run."""
    (tmp_path / f"dcmp-hil-{OTHER_USER_ID}").mkdir()
    (tmp_path / f"dcmp-hil-{OTHER_USER_ID}").chmod(0o777)
    command = ("run", "--fast", "--duration", "1", "--no-record", "--set", "backend.kind=sim-board")
    done = as_stranger(installed, tmp_path, *command, TMPDIR=str(tmp_path))
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.startswith(
        f"error: {tmp_path}/dcmp-hil-{OTHER_USER_ID}: it is no folder of yours alone."
    )
    assert done.stderr.count("\n") == 1
    assert "XDG_CACHE_HOME" in done.stderr


@pytest.mark.parametrize("command", [("status",), ("stop",), ("set", "controller.kp_1_s2=1")])
def test_runtime_folder_that_may_not_be_entered_is_left_for_another(
    installed: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0)
    done = as_stranger(
        installed, tmp_path, *command, XDG_RUNTIME_DIR=str(closed / "1000"), TMPDIR=str(tmp_path)
    )
    closed.chmod(0o700)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: No run listens here.")
    assert done.stderr.count("\n") == 1
