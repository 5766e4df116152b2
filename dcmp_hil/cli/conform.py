"""`dcmp-hil conform`: whether a device does what docs/protocol.md says."""

from __future__ import annotations

import sys
from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Force, JsonFile
from dcmp_hil.cli.outputs import json_place, try_places
from dcmp_hil.conformance.check import Verdict
from dcmp_hil.errors import BackendError, ConfigError, ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from dcmp_hil.conformance.check import DeviceCheck, Outcome
    from dcmp_hil.conformance.client import Client
    from dcmp_hil.platform.stop_request import StopRequest

WHAT_MOVES = (
    "With --arm the motor is switched on about 30 times, for 0.3 s each at most, mostly at up to 300 mV; "
    "twice, for `travel-limit` and `speed-limit`, up to 1 V until the arm has moved a few encoder counts. "
    "Keep clear of the arm, "
    "let it hang freely, limit the supply, have the e-stop within reach."
)
_VERDICT_COLOURS = {
    Verdict.PASSED: "green",
    Verdict.FAILED: "bold red",
    Verdict.NOT_JUDGED: "yellow",
    Verdict.NEEDS_ARM: "dim",
    Verdict.OTHER_CARRIER: "dim",
}


class Carrier(StrEnum):
    """Carriers of frames."""

    COBS = "cobs"
    SLCAN = "slcan"
    CAN = "can"


def conform(  # noqa: PLR0913, PLR0917 - typer takes them by name
    port: Annotated[
        str | None,
        typer.Argument(
            metavar="PORT",
            help="Serial port of the device, such as /dev/ttyACM0; with --link can a channel, such as can0.",
        ),
    ] = None,
    link: Annotated[
        Carrier | None,
        typer.Option(help="Carrier of the frames; by default found by listening to the serial port."),
    ] = None,
    interface: Annotated[
        str, typer.Option(metavar="NAME", help="Interface of python-can, with --link can.")
    ] = "socketcan",
    baud: Annotated[
        int, typer.Option(metavar="BIT_S", min=9600, max=12_000_000, help="Of a serial port.")
    ] = 1_000_000,
    bitrate: Annotated[
        int, typer.Option(metavar="BIT_S", min=10_000, max=1_000_000, help="Of a CAN bus.")
    ] = 1_000_000,
    node: Annotated[int, typer.Option(metavar="N", min=0, max=15, help="Of the device on a shared bus.")] = 0,
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="CHECK", help="Run only this check. Repeatable.")
    ] = None,
    arm: Annotated[
        bool, typer.Option("--arm", help="Also run the checks that arm the device: the motor moves.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --arm: do not ask again.")] = False,
    clear: Annotated[
        bool, typer.Option("--clear", help="Clear a fault that the device has at the start.")
    ] = False,
    list_them: Annotated[bool, typer.Option("--list", help="List the checks and end.")] = False,
    json_to: JsonFile = None,
    force: Force = False,
) -> None:
    """Check a device against docs/protocol.md, with messages of that page only.

    The device stays disarmed unless --arm is given, and is disarmed at 0 V after every end. Exit code:
    0 if the device agrees with the page, 1 if it does not, 2 for a wrong option, 3 if there is no device or
    the line broke, 130 after Ctrl-C.
    """
    from dcmp_hil.conformance.registry import CHECKS

    chosen = _chosen(CHECKS, only or ())
    if list_them:
        for check in chosen:
            needs = "  (--arm)" if check.needs_arm else ""
            line = f"{check.name:22} section {check.section:3} "
            console.print_sentence(console.out, Text(f"{line}{check.says}{needs}"), indent=len(line))
        return
    if port is None:
        raise ConfigError(
            "PORT: missing. Name the port of the device, such as /dev/ttyACM0; `dcmp-hil ports` lists them."
        )
    try_places({"--json": json_place(json_to)}, force=force)
    if arm and any(check.needs_arm for check in chosen):
        _confirm(yes=yes)
    said = console.err if json_to == "-" else console.out
    place = _Place(port, link, interface, baud, bitrate, node)
    raise typer.Exit(_run(place, chosen, armed=arm, clear=clear, json_to=json_to, said=said))


class _Place:
    """Port, link and node of the device."""

    def __init__(
        self, port: str, link: Carrier | None, interface: str, baud: int, bitrate: int, node: int
    ) -> None:
        self.port, self.link, self.node = port, link, node
        self.interface, self.baud, self.bitrate = interface, baud, bitrate

    def open(self, stop: StopRequest) -> Client:
        """Open the port."""
        from dcmp_hil.conformance.client import Client
        from dcmp_hil.conformance.opening import open_line
        from dcmp_hil.platform.clock import MonotonicClock

        clock = MonotonicClock()
        line = open_line(
            self.port,
            self.link.value if self.link else None,
            interface=self.interface,
            baud=self.baud,
            bitrate=self.bitrate,
            node=self.node,
            clock=clock,
        )
        return Client(line, clock, self.node, lambda: stop.requested)


def _chosen(checks: Sequence[DeviceCheck], only: Sequence[str]) -> list[DeviceCheck]:
    names = {check.name for check in checks}
    unknown = [name for name in only if name not in names]
    if unknown:
        raise ConfigError(
            f"--only {unknown[0]}: there is no such check. `dcmp-hil conform --list` names them all."
        )
    return [check for check in checks if not only or check.name in only]


def _confirm(*, yes: bool) -> None:
    """Print what will move, and ask the user to confirm.

    Raises
    ------
    ConfigError
        If it is not.
    """
    console.warn(WHAT_MOVES)
    if yes:
        return
    if not sys.stdin.isatty():
        raise ConfigError("--arm: there is no terminal to confirm at. Add --yes if the motor may move.")
    console.err.print(Text("May the motor move? [y/N] "), end="")
    if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
        raise ConfigError("--arm: not confirmed, nothing was sent. Without --arm the motor stays off.")


def _run(
    place: _Place,
    checks: Sequence[DeviceCheck],
    *,
    armed: bool,
    clear: bool,
    json_to: str | None,
    said: Console,
) -> int:
    from dcmp_hil.conformance.listener import StoppedError
    from dcmp_hil.conformance.runner import run_checks
    from dcmp_hil.platform.stop_request import StopRequest

    outcomes: list[Outcome] = []
    ended_by, broken = "finished", None
    with StopRequest() as stop:
        client = place.open(stop)
        try:
            for outcome in run_checks(client, checks, armed=armed, clear=clear):
                outcomes.append(outcome)
                _show(said, outcome)
        except StoppedError:
            ended_by = "interrupted"
        except BackendError as error:
            ended_by, broken = "error", error
        finally:
            client.line.close()
    counts = Counter(outcome.verdict for outcome in outcomes)
    if json_to is not None:
        console.write_json(json_to, _as_json(client, outcomes, counts, ended_by, armed=armed))
    if broken is not None:
        raise broken
    _sum_up(said, counts, ended_by)
    if ended_by != "finished":
        return stop.exit_code or ExitCode.INTERRUPTED
    return ExitCode.FAILED if counts[Verdict.FAILED] else ExitCode.OK


def _show(said: Console, outcome: Outcome) -> None:
    check, verdict = outcome.check, outcome.verdict
    if verdict == Verdict.OTHER_CARRIER:
        return
    said.print(
        Text.assemble(
            (f"{verdict.value:11}", _VERDICT_COLOURS[verdict]), f" {check.name} (section {check.section})"
        )
    )
    if verdict == Verdict.FAILED:
        console.print_sentence(said, Text(f"            the page: {check.says}"), indent=12)
    for finding in outcome.findings:
        console.print_sentence(said, Text(f"            {finding}"), indent=12)


def _sum_up(said: Console, counts: Counter[Verdict], ended_by: str) -> None:
    words = ", ".join(
        f"{counts[verdict]} {verdict.value}"
        for verdict in Verdict
        if counts[verdict] and verdict != Verdict.OTHER_CARRIER
    )
    said.print(
        Text(f"{words or 'no check ran'}{'' if ended_by == 'finished' else '; ended before the last'}")
    )


def _as_json(
    client: Client, outcomes: Sequence[Outcome], counts: Counter[Verdict], ended_by: str, *, armed: bool
) -> dict[str, object]:
    return {
        "port": client.line.name,
        "link": client.line.carrier,
        "node": client.node,
        "armed": armed,
        "ended_by": ended_by,
        "counts": {verdict.value: counts[verdict] for verdict in Verdict},
        "checks": [
            {
                "name": one.check.name,
                "section": one.check.section,
                "says": one.check.says,
                "needs_arm": one.check.needs_arm,
                "verdict": one.verdict.value,
                "findings": list(one.findings),
            }
            for one in outcomes
        ],
    }
