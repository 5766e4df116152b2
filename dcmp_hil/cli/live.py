"""`dcmp-hil set`, `stop` and `status`: a run that goes on, from another terminal."""

from __future__ import annotations

from typing import Annotated

import typer

from dcmp_hil.cli import console

Run = Annotated[int | None, typer.Option("--run", metavar="PID", help="Which run, where there are several.")]


def set_keys(
    changes: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE...", help="Such as controller.kp_1_s2=5200.")
    ],
    run: Run = None,
) -> None:
    """Change gains or the reference of a run that goes on; the voltage has no step.

    It is checked as rig.toml is, applied between two periods, and confirmed. Limits cannot be changed.
    """
    from dcmp_hil.live.client import change, find_run

    console.out.print(change(find_run(run), changes), highlight=False, markup=False)


def stop(run: Run = None) -> None:
    """End a run as Ctrl-C does: 0 V, and everything kept."""
    from dcmp_hil.live.client import find_run
    from dcmp_hil.live.client import stop as end

    pid = find_run(run)
    end(pid)
    console.out.print(f"the run of process {pid} ends at 0 V", highlight=False)


def status(run: Run = None) -> None:
    """Say in one line where a run stands."""
    from dcmp_hil.live.client import find_run
    from dcmp_hil.live.client import status as ask

    pid = find_run(run)
    state = ask(pid)
    parts = [
        f"process {pid}",
        str(state.get("rig")),
        _number(state.get("t_s"), "{:.2f} s"),
        str(state.get("phase")),
        _number(state.get("position_rad"), "position {:+.3f} rad"),
        _number(state.get("error_mrad"), "error {:+.2f} mrad"),
        _number(state.get("voltage_V"), "voltage {:+.2f} V"),
        str(state.get("fault") or "no fault"),
    ]
    console.out.print("  ".join(part for part in parts if part), highlight=False, markup=False)


def _number(value: object, form: str) -> str:
    return form.format(value) if isinstance(value, float) else ""
