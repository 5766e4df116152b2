"""C of the messages: what firmware/core has of them, with pack and unpack."""

from __future__ import annotations

from tools.protocol.layout import MARK


def protocol_hash(value: int) -> str:
    """Return the text of dcmp_protocol_hash.h."""
    return _header("DCMP_PROTOCOL_HASH_H", f"#define DCMP_PROTOCOL_HASH 0x{value:08x}u\n")


def _header(guard: str, text: str) -> str:
    return f"/* {MARK} */\n#ifndef {guard}\n#define {guard}\n\n{text}\n#endif\n"
