"""`python -m tools.vcan_machine [COMMAND ...]`: run a command in a machine whose kernel has CAN."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from tools.vcan_machine.machine import CONSOLE, missing, run


def main() -> int:
    """Run it, show what it printed, return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.vcan_machine", description=__doc__)
    parser.add_argument("command", nargs=argparse.REMAINDER, help="by default: ip link")
    command = parser.parse_args().command or ["ip", "link"]
    if lacking := missing():
        sys.stderr.write(f"{lacking}\n")
        return 2
    with tempfile.TemporaryDirectory() as share:
        try:
            code = run(command, Path(share), folder=Path.cwd(), settings={})
        except RuntimeError as error:
            sys.stderr.write(f"{error}\n")
            return 1
        sys.stdout.write((Path(share) / CONSOLE).read_text(errors="replace"))
    return code


if __name__ == "__main__":
    sys.exit(main())
