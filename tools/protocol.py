"""`python -m tools.protocol`: write what follows from dcmp.dbc: tables of the page, and the hash."""

from __future__ import annotations

import hashlib
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import cantools
from cantools.database.can import Database

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import (
    Drive,
    FaultReport,
    Hello,
    Identity,
    ParameterGet,
    ParameterSet,
    ParameterValue,
    SampleReport,
    Stop,
)

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

_ROOT = Path(__file__).parent.parent
DBC = _ROOT / "firmware/proto/dcmp.dbc"
PAGE = _ROOT / "docs/protocol.md"
PYTHON = _ROOT / "dcmp_hil/wire/protocol_hash.py"
HEADER = _ROOT / "firmware/core/dcmp_protocol_hash.h"
_MEANT_PREFIXES = ("BO_ ", "SG_ ", "VAL_ ")


def protocol_hash(text: str) -> int:
    """Return the hash of a DBC's meaning: its comments and blank lines do not count."""
    lines = (line.strip() for line in text.splitlines())
    meant = "".join(f"{line}\n" for line in lines if line.startswith(_MEANT_PREFIXES))
    return int.from_bytes(hashlib.sha256(meant.encode()).digest()[:4], "big")


def files() -> dict[Path, str]:
    """Return everything that follows from the DBC, by file."""
    text = DBC.read_text("utf-8")
    value, database = protocol_hash(text), _load(text)
    page = PAGE.read_text("utf-8")
    for name, part in (
        ("messages", _messages(database)),
        ("values", _values(database)),
        ("hash", f"The protocol hash of this version is `0x{value:08x}`.\n"),
        ("examples", _examples(value)),
    ):
        pattern = re.compile(rf"(<!-- {name}: [^\n]*-->\n).*?(<!-- /{name} -->)", re.DOTALL)
        page, places = pattern.subn(
            lambda found, part=part: f"{found[1]}\n{part}\n{found[2]}",  # type: ignore[misc]
            page,
        )
        if places != 1:  # or what is there would pass for checked
            raise ValueError(f"{PAGE.name} has {places} places for {name}, marked by <!-- {name}: ... -->")
    return {
        PAGE: page,
        PYTHON: '"""Written by tools/protocol.py: what host and device compare before anything else."""\n\n'
        f"PROTOCOL_HASH = 0x{value:08X}\n",
        HEADER: "/* Written by tools/protocol.py from dcmp.dbc. */\n#ifndef DCMP_PROTOCOL_HASH_H\n"
        f"#define DCMP_PROTOCOL_HASH_H\n\n#define DCMP_PROTOCOL_HASH 0x{value:08x}u\n\n#endif\n",
    }


def _load(text: str) -> Database:
    database = cantools.database.load_string(text, "dbc")
    if not isinstance(database, Database):
        raise TypeError(f"{DBC} is no CAN database")
    return database


def _messages(database: Database) -> str:
    lines = [
        "| message | number | identifier | from | bytes | fields: first bit, bits, u or s for signed | |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {one.name} | {one.frame_id >> 4} | 0x{one.frame_id:03X} | {one.senders[0].lower()} "
            f"| {one.length} | {_fields(one)} | {one.comment} |"
            for one in database.messages
        ),
    ]
    notes = [
        f"- {one.name}.`{signal.name}`: {signal.comment}"
        for one in database.messages
        for signal in one.signals
        if signal.comment
    ]
    return (
        "\n".join([*lines, "", "Bit 0 is the lowest of byte 0, bit 8 the lowest of byte 1.", "", *notes])
        + "\n"
    )


def _fields(message: Message) -> str:
    return "<br>".join(_field(signal) for signal in message.signals)


def _field(signal: Signal) -> str:
    low, high, kind = signal.minimum, signal.maximum, "s" if signal.is_signed else "u"
    least, most = (
        (-(1 << signal.length - 1), (1 << signal.length - 1) - 1)
        if signal.is_signed
        else (0, (1 << signal.length) - 1)
    )
    bounds = "" if (low, high) == (least, most) or low is None or high is None else f" {low:g}..{high:g}"
    unit = f" {signal.unit}" if signal.unit else ""
    return f"`{signal.name}` {signal.start}, {kind}{signal.length}{unit}{bounds}"


def _values(database: Database) -> str:
    """Lay out the named values; what several messages share appears once."""
    tables: dict[str, tuple[list[str], str]] = {}
    for message in database.messages:
        for signal in message.signals:
            if signal.choices:
                named = ", ".join(f"{value} {name}" for value, name in sorted(signal.choices.items()))
                tables.setdefault(named, ([], named))[0].append(f"{message.name}.`{signal.name}`")
    lines = [f"| {', '.join(where)} | {named} |" for where, named in tables.values()]
    return "\n".join(["| field | values |", "|---|---|", *lines]) + "\n"


def _examples(value: int) -> str:
    lines = ["| message | identifier, payload | COBS | slcan (without CR) |", "|---|---|---|---|"]
    for message in (
        Hello(0x1234, value),
        Identity(value, 0x0001, False, True, False),
        ParameterGet(4),
        ParameterValue(4, 1000, 0),
        ParameterSet(0x1234, 9, 15),
        SampleReport(0xFFFFFE, -250, 232, 3, False, True, 0),
        Drive(2500, 1000, True, False, False, 0x1234, 20),
        FaultReport(1, 252, 20_750),
        Stop(3),
    ):
        frame = number, data = pack(message)
        fields = ", ".join(f"{name} {int(one)}" for name, one in message._asdict().items())
        lines.append(
            f"| {type(message).__name__} ({fields}) | {number:03X} {data.hex(' ').upper()} "
            f"| {cobs.encode(frame).hex(' ').upper()} | `{slcan.encode(frame).decode().strip()}` |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the files, or with --check say which are not as they should be."""
    stale = {path: text for path, text in files().items() if path.read_text("utf-8") != text}
    if "--check" in sys.argv[1:]:
        for path in stale:
            sys.stdout.write(
                f"{path.relative_to(_ROOT)} is not what dcmp.dbc says: python -m tools.protocol\n"
            )
        sys.exit(bool(stale))
    for path, text in stale.items():
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"wrote {path.relative_to(_ROOT)}\n")


if __name__ == "__main__":
    main()
