"""`dcmp-hil`, also as `python -m dcmp_hil`: STOP before anything is imported, and Ctrl-C meanwhile."""

from __future__ import annotations

import os
import signal
import sys

_INTERRUPTED_EXIT_CODE = 128 + signal.SIGINT  # ExitCode.INTERRUPTED: nothing is imported yet


def _leave(*_: object) -> None:
    """Leave: nothing has begun that would have to end, and an exception in an import says nothing."""
    os._exit(_INTERRUPTED_EXIT_CODE)


def main() -> None:
    """Run the command line."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    try:
        stopped = _stop(sys.argv[1:])
        from dcmp_hil.cli import main as command_line  # takes half a second
    finally:
        if before is signal.default_int_handler:
            signal.signal(signal.SIGINT, before)
    command_line(stopped)


def _stop(arguments: list[str]) -> object:
    """Execute `stop` and `stop --run PID`; return the result, None for any other command."""
    run: int | None = None
    match arguments:
        case ["stop"]:
            pass
        case ["stop", "--run", number] if number.isascii() and number.isdigit():
            run = int(number)
        case _:
            return None
    if sys.platform != "linux":
        return None
    from dcmp_hil.live.client import stop_found  # takes no half second

    return stop_found(run)


if __name__ == "__main__":
    main()
