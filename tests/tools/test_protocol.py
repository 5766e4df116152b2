"""Examples of the page, read by others; that they are on disk is tested in test_protocol_page.py."""

import re
from pathlib import Path

import cobs.cobs  # type: ignore[import-untyped]
import fastcrc
import pytest

from tests.firmware.bench import database
from tests.wire.judge import KINDS
from tools.protocol import __main__ as protocol
from tools.protocol.__main__ import PAGE, files

ROW = re.compile(r"(?m)^\| (\w+) \((.*)\) \| ([0-9A-F ]+) \| ([0-9A-F ]+) \| `(\w+)` \|$")
EXAMPLES = ROW.findall(PAGE.read_text("utf-8"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 8
    assert len({kind for kind, *_ in EXAMPLES}) == len(EXAMPLES)


@pytest.mark.parametrize("example", EXAMPLES, ids=[kind for kind, *_ in EXAMPLES])
def test_examples_are_right(example: tuple[str, ...]) -> None:
    """By cantools and the cobs package, from the page's text."""
    kind, fields, shown, stuffed, line = example
    identifier, payload = shown.split(" ", 1)
    number, data = int(identifier, 16), bytes.fromhex(payload)
    message = database().get_message_by_frame_id(number)
    assert KINDS[message.name].__name__ == kind
    assert len(data) == message.length
    decoded = message.decode(data, decode_choices=False)
    assert isinstance(decoded, dict)
    inside = number.to_bytes(2, "little") + data
    assert decoded.pop("crc8") == fastcrc.crc8.autosar(inside[:-1])
    assert decoded == {name: int(value) for name, value in (one.split(" ") for one in fields.split(", "))}
    whole = inside + fastcrc.crc16.ibm_3740(inside).to_bytes(2, "little")
    assert bytes.fromhex(stuffed) == cobs.cobs.encode(whole) + b"\0"
    assert line == f"t{number:03X}{len(data)}{data.hex().upper()}"


@pytest.mark.parametrize("name", ["messages", "values", "hash", "examples"])
@pytest.mark.parametrize("mark", ["<!-- {}: ", "<!-- /{} -->"])
def test_a_lost_mark_is_noticed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, mark: str
) -> None:
    page, right = tmp_path / "protocol.md", PAGE.read_text("utf-8")
    assert right.count(mark.format(name)) == 1
    page.write_text(right.replace(mark.format(name), ""), "utf-8")
    monkeypatch.setattr(protocol, "PAGE", page)
    with pytest.raises(ValueError, match=rf"^protocol\.md has 0 places for {name}, "):
        files()
