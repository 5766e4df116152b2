"""The DBC file: where it is, its database, and the hash of its meaning."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cantools
from cantools.database.can import Database

from tools.protocol import statements

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

ROOT = Path(__file__).resolve().parents[2]
DBC = ROOT / "firmware/proto/dcmp.dbc"
_MEANT_PREFIXES = ("BO_ ", "SG_ ", "VAL_ ")


def load(text: str) -> Database:
    """Return the database of a DBC's text.

    Raises
    ------
    DbcError
        If the text has statements that are not understood.
    """
    statements.check(text)
    # Not strict: `rules` says of fields that overlap, or do not fit, what to do.
    database = cantools.database.load_string(text, "dbc", strict=False)
    if not isinstance(database, Database):
        raise TypeError(f"{DBC} is no CAN database")
    return database


def protocol_hash(text: str) -> int:
    """Return the hash of a DBC's meaning: its comments, attributes and blank lines do not count."""
    lines = (line.strip() for line in text.splitlines())
    meant = "".join(f"{line}\n" for line in lines if line.startswith(_MEANT_PREFIXES))
    return int.from_bytes(hashlib.sha256(meant.encode()).digest()[:4], "big")


def attribute(of: Message | Signal, name: str) -> str:
    """Return an attribute of a message or a field; empty if it is not set."""
    attributes: dict[str, Any] = of.dbc.attributes if of.dbc else {}
    return str(attributes[name].value) if name in attributes else ""
