"""The command line: what may print and exit, and nothing else may."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer
from typer.exceptions import TyperException

from dcmp_hil import __version__
from dcmp_hil.cli import console, streams
from dcmp_hil.cli.check import check
from dcmp_hil.cli.completion import completion
from dcmp_hil.cli.conform import conform
from dcmp_hil.cli.device import device
from dcmp_hil.cli.export import export
from dcmp_hil.cli.forced_exit import leave
from dcmp_hil.cli.help_texts import HELP, epilog, paragraphs
from dcmp_hil.cli.live_commands import set_keys, status, stop, tell_stopped
from dcmp_hil.cli.monitor import monitor
from dcmp_hil.cli.panel import panel
from dcmp_hil.cli.paper import paper
from dcmp_hil.cli.ports import ports
from dcmp_hil.cli.replay import replay
from dcmp_hil.cli.rigs import rigs
from dcmp_hil.cli.run import run
from dcmp_hil.cli.sweep import sweep
from dcmp_hil.cli.usage import Commands, sentence
from dcmp_hil.cli.view import view
from dcmp_hil.errors import ConfigError, DcmpError, ExitCode
from dcmp_hil.platform.host_info import require_linux

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")

_PROGRAM = "dcmp-hil"  # also for `python -m dcmp_hil`

app = typer.Typer(
    cls=Commands,
    help="Run a DC-motor pendulum: observer, controller, amplifier, live picture.",
    epilog="`dcmp-hil COMMAND --help` has examples. Begin with `dcmp-hil run`.",
    invoke_without_command=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _on_linux(name: str, command: Callable[P, None]) -> Callable[P, None]:
    """Refuse a command of devices or of running processes where Linux's interfaces are absent."""

    @functools.wraps(command)
    def checked(*args: P.args, **kwargs: P.kwargs) -> None:
        require_linux(f"`dcmp-hil {name}`")
        command(*args, **kwargs)

    return checked


EVERYWHERE: dict[str, Callable[..., None]] = {
    "run": run,
    "check": check,
    "sweep": sweep,
    "paper": paper,
    "replay": replay,
    "export": export,
    "rigs": rigs,
    "view": view,
    "completion": completion,
}
ON_LINUX: dict[str, Callable[..., None]] = {
    "device": device,
    "ports": ports,
    "monitor": monitor,
    "conform": conform,
    "set": set_keys,
    "stop": stop,
    "status": status,
    "panel": panel,
}
for name, texts in HELP.items():
    everywhere = EVERYWHERE.get(name)
    app.command(
        name,
        rich_help_panel=texts.group,
        short_help=texts.summary,
        help=paragraphs(everywhere or ON_LINUX[name]),
        epilog=epilog(texts.examples),
    )(everywhere or _on_linux(name, ON_LINUX[name]))


def _version(value: bool) -> None:
    if value:
        console.out.print(f"dcmp-hil {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def _options(
    context: typer.Context,
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Run a DC-motor pendulum: observer, controller, amplifier, live picture."""
    if context.invoked_subcommand is None:
        context.get_help()
        raise typer.Exit(ExitCode.CONFIG)


def main(stopped: Any = None) -> None:
    """Run the command line; every error of this package becomes its message and its exit code.

    Parameters
    ----------
    stopped
        What became of `dcmp-hil stop`, where that was done before this module was imported.
    """
    streams.guard()
    try:
        _call(stopped)
    except SystemExit as leaving:
        leave(leaving.code if isinstance(leaving.code, int) else int(bool(leaving.code)))
        raise


def _call(stopped: Any) -> None:
    try:
        if stopped is not None:
            tell_stopped(stopped)
        code = app(prog_name=_PROGRAM, standalone_mode=False)
    except DcmpError as error:
        console.complain(error)
        sys.exit(error.exit_code)
    except TyperException as error:
        console.complain(ConfigError(sentence(error)))
        sys.exit(error.exit_code)
    except typer.Abort:  # standard input ended at a question
        sys.exit(ExitCode.FAILED)
    sys.exit(code if isinstance(code, int) else ExitCode.OK)
