"""Reads every file of a folder as a user would, in one process; a line of JSON each says how it went."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import time
import traceback
from pathlib import Path

from dcmp_hil import cli
from dcmp_hil.cli import console
from dcmp_hil.cli.console import SafeConsole
from dcmp_hil.errors import DcmpError
from tests.memory import peak_mb

_NOTHING = ("--viewer", "none", "--no-record")


def commands(name: str) -> list[tuple[str, ...]]:
    """Return what a user does with a file of this name."""
    if name.endswith(".mcap"):
        return [("replay", name), ("export", name, "--csv", "/dev/null")]
    if name.endswith(".csv"):
        return [("replay", name, "--inertia", "0.16", "--no-write")]
    return [("check", name), ("run", name, "--fast", "--duration", "0.05", *_NOTHING)]


def called(*arguments: str) -> tuple[int, str]:
    """Call the command line; return its code and everything that it printed."""
    printed = io.StringIO()
    console.out = SafeConsole(file=printed, soft_wrap=True, force_terminal=True, color_system=None)
    console.err = SafeConsole(file=printed, soft_wrap=True, force_terminal=True, color_system=None)
    sys.argv = ["dcmp-hil", *arguments]
    code = 0
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        try:
            cli.app()
        except DcmpError as error:
            console.complain(error)
            code = error.exit_code
        except SystemExit as leaving:
            code = leaving.code if isinstance(leaving.code, int) else 0
        except BaseException:  # noqa: BLE001 - the finding
            code = 1
            traceback.print_exc()
    return code, printed.getvalue()


def main() -> None:
    """Read the files named; print what came of it."""
    os.chdir(sys.argv[1])
    for name in sorted(os.listdir()):  # noqa: PTH208
        for command in commands(name):
            began = time.process_time()
            code, printed = called(*command)
            line = {
                "file": Path(name).stem,
                "command": command[0],
                "code": code,
                "printed": printed[:20_000],
                "long": len(printed),
                "cpu": time.process_time() - began,
                "MB": peak_mb(),
            }
            print(json.dumps(line), file=sys.__stdout__, flush=True)


if __name__ == "__main__":
    main()
