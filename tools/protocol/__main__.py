"""`python -m tools.protocol`: write what follows from dcmp.dbc; with --check say which files are stale."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tools.protocol import c_code, python_code
from tools.protocol.dbc import DBC, ROOT, load, protocol_hash
from tools.protocol.layout import layouts
from tools.protocol.page import page
from tools.protocol.statements import DbcError

if TYPE_CHECKING:
    from pathlib import Path

PAGE = ROOT / "docs/protocol.md"
_WIRE, _CORE = ROOT / "dcmp_hil/wire", ROOT / "firmware/core"


def files() -> dict[Path, str]:
    """Return everything that follows from the DBC, by file."""
    text = DBC.read_text("utf-8")
    value, database = protocol_hash(text), load(text)
    found = layouts(database)
    return {
        PAGE: page(PAGE.read_text("utf-8"), database, found, value),
        _WIRE / "protocol_hash.py": python_code.protocol_hash(value),
        _WIRE / "messages.py": python_code.messages(found),
        _WIRE / "layouts.py": python_code.layouts(found),
        _CORE / "dcmp_protocol_hash.h": c_code.protocol_hash(value),
        _CORE / "dcmp_protocol.h": c_code.header(found),
        _CORE / "dcmp_pack.c": c_code.pack(found),
        _CORE / "dcmp_unpack.c": c_code.unpack(found),
    }


def main() -> None:
    """Write the files, or with --check say which are not as they should be."""
    try:
        made = files()
    except DbcError as error:
        sys.exit(f"{DBC.name}: {error}")
    stale = {path: text for path, text in made.items() if not _is(path, text)}
    if "--check" in sys.argv[1:]:
        for path in stale:
            sys.stdout.write(f"{path.relative_to(ROOT)} is not what dcmp.dbc says: make generate\n")
        sys.exit(bool(stale))
    for path, text in stale.items():
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"wrote {path.relative_to(ROOT)}\n")


def _is(path: Path, text: str) -> bool:
    return path.exists() and path.read_text("utf-8") == text


if __name__ == "__main__":
    main()
