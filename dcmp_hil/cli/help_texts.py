"""The help of the commands: their groups, a line of the list for each, and examples to be typed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rich.markup import escape

if TYPE_CHECKING:
    from collections.abc import Callable

RUN = "Run a rig"
LIVE = "A run that goes on, from another terminal"
RECORDINGS = "Recordings and the paper"
DEVICES = "Devices and links"
SHELL = "This command line"


class CommandHelp(NamedTuple):
    """Help of one command, beside its docstring.

    Parameters
    ----------
    group
        The heading under which it is listed.
    summary
        One line of the list, at most 64 columns.
    examples
        Whole command lines, at most 76 columns each.
    """

    group: str
    summary: str
    examples: tuple[str, ...]


HELP = {
    "run": CommandHelp(
        RUN,
        "Run a rig: estimate, control, show, record.",
        (
            "dcmp-hil run",
            "dcmp-hil run bench-1khz --duration 10s --set loop.rate_hz=500",
            "dcmp-hil run --fast --duration 30s --viewer none --json figures.json",
            "dcmp-hil run --set backend.kind=serial --set backend.port=/dev/ttyACM0",
            "dcmp-hil run --fast --compare friction_kalman,kalman,derivative",
            "dcmp-hil run --fast --fault wire.drop:p=0.2,at=3s,for=1s",
        ),
    ),
    "check": CommandHelp(
        RUN,
        "Check a rig without running it; print every key.",
        (
            "dcmp-hil check bench-1khz",
            "dcmp-hil check my.toml --set loop.rate_hz=500",
            "dcmp-hil check my.toml --set model.f1_rad_s2=1.55 --write",
        ),
    ),
    "sweep": CommandHelp(
        RUN,
        "Run a rig many times, over a grid or draws of its keys.",
        (
            "dcmp-hil sweep friction_sweep.toml --dry-run",
            "dcmp-hil sweep friction_sweep.toml --out sweeps/friction",
            "dcmp-hil sweep gains.toml --scheduler tcp://10.0.0.5:8786",
        ),
    ),
    "rigs": CommandHelp(
        RUN,
        "List the shipped rigs, or copy one to start from.",
        ("dcmp-hil rigs", "dcmp-hil rigs --copy bench-1khz my.toml"),
    ),
    "view": CommandHelp(
        LIVE,
        "Open the dashboard of a run, as often as you like.",
        ("dcmp-hil view", "dcmp-hil view --web"),
    ),
    "panel": CommandHelp(
        LIVE,
        "Serve a page with sliders and STOP for your browser.",
        ("dcmp-hil panel", "dcmp-hil panel --web --port 8720"),
    ),
    "status": CommandHelp(
        LIVE, "Print the state of a run in one line.", ("dcmp-hil status", "dcmp-hil status --run 4711")
    ),
    "set": CommandHelp(
        LIVE,
        "Change gains or the reference of a run.",
        (
            "dcmp-hil set controller.kp_1_s2=5200",
            "dcmp-hil set reference.amplitude_rad=0.5 controller.kd_1_s=130",
        ),
    ),
    "stop": CommandHelp(
        LIVE, "End a run at 0 V, with all files kept.", ("dcmp-hil stop", "dcmp-hil stop --run 4711")
    ),
    "replay": CommandHelp(
        RECORDINGS,
        "Run an observer over a recording, and judge its velocity.",
        (
            "dcmp-hil replay recording.csv --ku 5.4",
            "dcmp-hil replay log.csv --position deg --position-unit deg --inertia 0.16",
            "dcmp-hil replay runs/20260130T101500Z-bench-1khz --compare mu0=90",
            "dcmp-hil replay recording.csv --ku 5.4 --compare kalman,derivative",
        ),
    ),
    "export": CommandHelp(
        RECORDINGS,
        "Write a run's recording as CSV, Parquet or .rrd.",
        ("dcmp-hil export runs/20260130T101500Z-bench-1khz --csv run.csv",),
    ),
    "paper": CommandHelp(
        RECORDINGS,
        "Reproduce the paper: figures 1 to 4 and the table.",
        ("dcmp-hil paper --out figures", "dcmp-hil paper --no-figures"),
    ),
    "device": CommandHelp(
        DEVICES,
        "Run a virtual device behind a pseudo terminal.",
        ("dcmp-hil device --symlink /tmp/device", "dcmp-hil device --link slcan"),
    ),
    "ports": CommandHelp(
        DEVICES,
        "List serial ports and CAN channels, and the device on each.",
        ("dcmp-hil ports --verbose", "dcmp-hil ports /dev/pts/3 --wait 2s"),
    ),
    "monitor": CommandHelp(
        DEVICES,
        "Print the decoded traffic of a link; nothing is sent.",
        ("dcmp-hil monitor --set backend.port=/dev/ttyACM0 --duration 10s",),
    ),
    "conform": CommandHelp(
        DEVICES,
        "Check a device against docs/protocol.md.",
        (
            "dcmp-hil conform --list",
            "dcmp-hil conform /dev/ttyACM0",
            "dcmp-hil conform can0 --link can --node 2",
        ),
    ),
    "completion": CommandHelp(
        SHELL,
        "Print a completion script for bash, zsh or fish.",
        (
            "dcmp-hil completion bash",
            "dcmp-hil completion zsh",
            "dcmp-hil completion fish",
        ),
    ),
}
"""By name, in the order in which they are listed."""


def paragraphs(command: Callable[..., None]) -> str:
    """Return a docstring with one line a paragraph: the terminal's width breaks them."""
    text = (command.__doc__ or "").split("\n\n")
    return escape("\n\n".join(" ".join(paragraph.split()) for paragraph in text))


def epilog(examples: tuple[str, ...]) -> str:
    """Return the examples as they stand below the options."""
    return escape("\n".join(("Examples:", *(f"  {example}" for example in examples))))
