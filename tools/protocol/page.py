"""Tables of docs/protocol.md, between their marks."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.crc import crc8

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

    from tools.protocol.layout import Layout

_EXAMPLES = {  # but the hash, which follows from the DBC
    "HELLO": {"session": 0x1234},
    "IDENTITY": {"firmware_version": 0x0001, "busy": 0, "owned": 1, "mismatch": 0},
    "PARAMETER_GET": {"id": 4},
    "PARAMETER_VALUE": {"id": 4, "value": 1000, "result": 0},
    "PARAMETER_SET": {"session": 0x1234, "id": 9, "value": 15},
    "SAMPLE": {"position_counts": 0xFFFFFE, "voltage_mV": -250, "tick": 232, "state": 3, "limited": 1},
    "DRIVE": {"voltage_mV": 2500, "seq": 1000, "arm": 1, "session": 0x1234, "ttl_ms": 20},
    "FAULT": {"code": 1, "tick": 252, "detail": 20_750},
    "STOP": {"reason": 3},
}
"""Fields of the examples by message; a field that is not named is 0."""


def page(text: str, database: Database, found: list[Layout], value: int) -> str:
    """Return the page's text with its tables written again, for the hash `value`.

    Raises
    ------
    ValueError
        If the page does not have the marks of a table once.
    """
    for name, part in (
        ("messages", _messages(database)),
        ("values", _values(database)),
        ("hash", f"The protocol hash of this version is `0x{value:08x}`.\n"),
        ("examples", _examples(database, found, value)),
    ):
        pattern = re.compile(rf"(<!-- {name}: [^\n]*-->\n).*?(<!-- /{name} -->)", re.DOTALL)
        text, places = pattern.subn(
            lambda found, part=part: f"{found[1]}\n{part}\n{found[2]}",  # type: ignore[misc]
            text,
        )
        if places != 1:  # or what is there would pass for checked
            raise ValueError(f"protocol.md has {places} places for {name}, marked by <!-- {name}: ... -->")
    return text


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


def _examples(database: Database, found: list[Layout], value: int) -> str:
    """Lay out the examples; cantools packs them, so that no generated code is needed for them."""
    lines = ["| message | identifier, payload | COBS | slcan (without CR) |", "|---|---|---|---|"]
    by_name = {layout.name: layout for layout in found}
    for name, given in _EXAMPLES.items():
        layout = by_name[name]
        fields = {field.name: given.get(field.name, 0) for field in layout.fields}
        if "protocol_hash" in fields:
            fields["protocol_hash"] = value
        number, body = layout.identifier, database.encode_message(name, {**fields, "crc8": 0})[:-1]
        data = body + bytes([crc8(number.to_bytes(2, "little") + body)])
        frame = number, data
        named = ", ".join(f"{field} {one}" for field, one in fields.items())
        lines.append(
            f"| {layout.python} ({named}) | {number:03X} {data.hex(' ').upper()} "
            f"| {cobs.encode(frame).hex(' ').upper()} | `{slcan.encode(frame).decode().strip()}` |"
        )
    return "\n".join(lines) + "\n"
