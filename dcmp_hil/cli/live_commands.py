"""`dcmp-hil set`, `stop` and `status`: a run that goes on, from another terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.errors import DcmpError, ExitCode

if TYPE_CHECKING:
    from dcmp_hil.live.stop_command import Stopped

Run = Annotated[
    int | None, typer.Option("--run", metavar="PID", help="Process id of the run, if there are several.")
]


def set_keys(
    changes: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE", help="Such as controller.kp_1_s2=5200.")
    ],
    run: Run = None,
) -> None:
    """Change gains or the reference of a running rig, without a step of the voltage.

    A change is checked like rig.toml, applied between two cycles, and confirmed. Limits cannot be changed.
    """
    from dcmp_hil.live.client import change, find_run

    console.print_sentence(console.out, Text(change(find_run(run), changes)))


def stop(run: Run = None) -> None:
    """End a run as Ctrl-C does, at 0 V with all files kept; by force if it does not answer.

    Exit code: 0 if 0 V is confirmed, 3 if the run ended and its device did not confirm it, 7 if the run did
    not answer and was ended by force, 1 if it goes on.
    """
    from dcmp_hil.live.client import stop_found

    tell_stopped(stop_found(run))


def tell_stopped(stopped: tuple[int, Stopped] | DcmpError) -> None:
    """Print the result of STOP, and exit with its code."""
    if isinstance(stopped, DcmpError):
        raise stopped
    from dcmp_hil.live.stop_command import End

    pid, (end, said) = stopped
    sentence = f"the run of process {pid}: {said}"
    if end is End.CONFIRMED:
        console.print_sentence(console.out, Text(sentence))
    else:
        console.complain(DcmpError(sentence))
    codes = {
        End.CONFIRMED: ExitCode.OK,
        End.UNCONFIRMED: ExitCode.BACKEND,
        End.FORCED: ExitCode.FORCED,
        End.FAILED: ExitCode.FAILED,
    }
    sys.exit(codes[end])


def status(run: Run = None) -> None:
    """Print the state of a run in one line."""
    from dcmp_hil.live.client import find_run
    from dcmp_hil.live.client import status as ask

    pid = find_run(run)
    state = ask(pid)
    parts = [
        f"process {pid}",
        str(state.get("rig")),
        _number(state.get("t_s"), "{:.2f} s"),
        _phase(state),
        _number(state.get("position_rad"), "position {:+.3f} rad"),
        _number(state.get("error_mrad"), "error {:+.2f} mrad"),
        _number(state.get("voltage_V"), "voltage {:+.2f} V"),
        str(state.get("fault") or "no fault"),
    ]
    console.print_sentence(console.out, Text("  ".join(part for part in parts if part)))


def _phase(state: dict[str, Any]) -> str:
    """Return the phase in words; mark the state of a silent run as old."""
    phase, age = str(state.get("phase")), state.get("age_s")
    return f"silent for {age:.1f} s, before that:" if phase == "silent" and age else phase


def _number(value: object, form: str) -> str:
    return form.format(value) if isinstance(value, float) else ""
