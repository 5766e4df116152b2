"""Code from another DBC, with layouts that ours does not have; cantools is the judge."""

from __future__ import annotations

import functools
import random
import re
import struct
import subprocess
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest
from cffi import FFI

from tests.firmware.core_library import CORE, WARNINGS, compiler
from tools.protocol import c_code, python_code
from tools.protocol import dbc as protocol_dbc
from tools.protocol.__main__ import PAGE
from tools.protocol.dbc import load
from tools.protocol.layout import layouts
from tools.protocol.page import page

if TYPE_CHECKING:
    from pathlib import Path

    from cantools.database.can import Message, Signal

DBC = """VERSION "1"
NS_ :
BS_:
BU_: HOST DEVICE
BO_ 16 WIDE: 8 HOST
 SG_ low : 0|12@1+ (1,0) [0|4095] "" DEVICE
 SG_ lone : 14|1@1+ (1,0) [0|1] "" DEVICE
 SG_ high : 16|16@1- (1,0) [-32768|32767] "mV" DEVICE
 SG_ id : 32|3@1+ (1,0) [0|7] "" DEVICE
 SG_ hash : 35|5@1+ (1,0) [0|31] "" DEVICE
 SG_ small : 40|8@1- (1,0) [-128|127] "" DEVICE
 SG_ crc8 : 56|8@1+ (1,0) [0|255] "" DEVICE
BO_ 48 ACROSS: 7 DEVICE
 SG_ first : 0|20@1+ (1,0) [0|1048575] "" HOST
 SG_ flag : 20|1@1+ (1,0) [0|1] "" HOST
 SG_ second : 22|10@1+ (1,0) [0|1023] "" HOST
 SG_ large : 32|16@1+ (1,0) [0|65535] "" HOST
 SG_ crc8 : 48|8@1+ (1,0) [0|255] "" HOST
BO_ 64 SPARSE: 8 DEVICE
 SG_ one : 3|1@1+ (1,0) [0|1] "" HOST
 SG_ counts : 16|24@1+ (1,0) [0|16777215] "counts" HOST
 SG_ crc8 : 56|8@1+ (1,0) [0|255] "" HOST
BO_ 80 LAST: 6 DEVICE
 SG_ value : 0|32@1- (1,0) [-2147483648|2147483647] "" HOST
 SG_ two : 32|1@1+ (1,0) [0|1] "" HOST
 SG_ three : 33|1@1+ (1,0) [0|1] "" HOST
 SG_ crc8 : 40|8@1+ (1,0) [0|255] "" HOST
CM_ BO_ 16 "Wide fields.";
CM_ BO_ 48 "Fields across bytes.";
CM_ BO_ 64 "Few fields.";
CM_ BO_ 80 "The last.";
CM_ SG_ 16 id "A kind.";
BA_DEF_ BO_ "PythonClass" STRING ;
BA_DEF_ BO_ "CStruct" STRING ;
BA_DEF_ SG_ "PythonEnum" STRING ;
BA_DEF_ SG_ "CEnum" STRING ;
BA_DEF_ SG_ "PlacedBefore" STRING ;
BA_ "PlacedBefore" SG_ 16 hash "low";
BA_ "PlacedBefore" SG_ 80 three "value";
BA_ "PythonClass" BO_ 80 "LastOfAll";
BA_ "CEnum" SG_ 16 id "dcmp_kind";
VAL_ 16 id 1 "ROUND" 2 "SQUARE";
"""
NAMES = re.findall(r"BO_ \d+ (\w+):", DBC)


def _signals(name: str) -> list[Signal]:
    return [signal for signal in _message(name).signals if signal.name != "crc8"]


@functools.cache
def _message(name: str) -> Message:
    return load(DBC).get_message_by_name(name)


def _bounds(signal: Signal) -> tuple[int, int]:
    least = -(1 << signal.length - 1) if signal.is_signed else 0
    return least, least + (1 << signal.length) - 1


def _examples(name: str) -> list[dict[str, int]]:
    """Return fields at both bounds, and drawn ones."""
    rng, signals = random.Random(name), {signal.name: _bounds(signal) for signal in _signals(name)}
    ends = [{field: bounds[end] for field, bounds in signals.items()} for end in (0, 1)]
    return ends + [{field: rng.randint(*bounds) for field, bounds in signals.items()} for _ in range(200)]


# ----------------------------------------------------------------------------------------- Python


@pytest.fixture(scope="module")
def wire() -> Any:
    """Return the generated layouts, by the name of their message."""
    found = layouts(load(DBC))
    messages, module = ModuleType("other_messages"), ModuleType("other_layouts")
    exec(python_code.messages(found), vars(messages))  # noqa: S102
    sys.modules["other_messages"] = messages
    try:
        text = python_code.layouts(found).replace("dcmp_hil.wire.messages", "other_messages")
        exec(text, vars(module))  # noqa: S102
    finally:
        del sys.modules["other_messages"]
    return {one.name: module.LAYOUTS[one.identifier >> 4] for one in found}


@pytest.mark.parametrize("name", NAMES)
def test_python_packs_and_unpacks_as_cantools_does(wire: Any, name: str) -> None:
    layout, flags = wire[name], {signal.name for signal in _signals(name) if signal.length == 1}
    for fields in _examples(name):
        typed = {field: bool(value) if field in flags else value for field, value in fields.items()}
        message, data = layout.kind(**typed), _message(name).encode({**fields, "crc8": 0x5A})
        assert layout.pack(message) == data[:-1]
        assert layout.unpack(data) == message
        assert [type(value) for value in layout.unpack(data)] == [type(value) for value in message]
    noise = bytes(range(0x5B, 0x5B + layout.length))  # bits without a name are ignored
    decoded = _message(name).decode(noise, decode_choices=False)
    assert layout.unpack(noise)._asdict() == {key: decoded[key] for key in layout.kind._fields}


@pytest.mark.parametrize("name", NAMES)
def test_python_refuses_what_does_not_fit(wire: Any, name: str) -> None:
    layout = wire[name]
    zeros = layout.kind(**{signal.name: 0 for signal in _signals(name)})
    for signal in _signals(name):
        least, most = _bounds(signal)
        for value in (least - 1, most + 1) if signal.length > 1 else ():
            with pytest.raises(struct.error):
                layout.pack(zeros._replace(**{signal.name: value}))


def test_structures_have_their_own_order_and_names(wire: Any) -> None:
    assert wire["WIDE"].kind._fields == ("hash", "low", "lone", "high", "id", "small")
    assert wire["LAST"].kind._fields == ("three", "value", "two")
    assert wire["LAST"].kind.__name__ == "LastOfAll"
    assert wire["WIDE"].kind.__name__ == "Wide"


# ---------------------------------------------------------------------------------------------- C


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> tuple[FFI, Any]:
    """Return the generated C, compiled beside the core's own check and seal."""
    folder, found = tmp_path_factory.mktemp("other"), layouts(load(DBC))
    for name in ("dcmp_message.h", "dcmp_message.c", "dcmp_frame.h", "dcmp_crc.h", "dcmp_crc.c"):
        (folder / name).write_bytes((CORE / name).read_bytes())
    (folder / "dcmp_protocol.h").write_text(c_code.header(found))
    (folder / "dcmp_pack.c").write_text(c_code.pack(found))
    (folder / "dcmp_unpack.c").write_text(c_code.unpack(found))
    sources = sorted(map(str, folder.glob("*.c")))
    command = [compiler(), *WARNINGS, "-O1", "-fPIC", "-shared", "-o", "other.so", *sources]
    subprocess.run(command, check=True, cwd=folder)
    ffi = FFI()
    ffi.cdef(_declarations(folder))
    return ffi, ffi.dlopen(str(folder / "other.so"))


def _declarations(folder: Path) -> str:
    headers = ("dcmp_frame.h", "dcmp_protocol.h", "dcmp_message.h")
    text = "".join((folder / name).read_text() for name in headers)
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).replace("DCMP_PAYLOAD_MAX", "8")
    text = text.replace("\\\n", "")
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


@pytest.mark.parametrize("name", NAMES)
def test_c_packs_and_unpacks_as_cantools_does(core: tuple[FFI, Any], name: str) -> None:
    ffi, lib = core
    pack, unpack = getattr(lib, f"dcmp_pack_{name.lower()}"), getattr(lib, f"dcmp_unpack_{name.lower()}")
    for fields in _examples(name):
        frame: Any = ffi.new("struct dcmp_frame *", (0, 0, [0xA5] * 8))
        pack(frame, 3, ffi.new(f"struct dcmp_{name.lower()} *", fields))
        data = bytes(ffi.buffer(frame.data, frame.length))
        assert frame.id == _message(name).frame_id + 3
        assert data[:-1] == _message(name).encode({**fields, "crc8": 0})[:-1]
        back: Any = ffi.new(f"struct dcmp_{name.lower()} *")
        unpack(frame, back)
        assert {field: int(getattr(back, field)) for field in fields} == fields


@pytest.mark.parametrize("number", [0, 2, 6], ids=["before the first", "a gap", "behind the last"])
def test_c_takes_no_number_without_a_message(core: tuple[FFI, Any], number: int) -> None:
    """Also not a frame without payload, which has the length of such a number's row in the table."""
    ffi, lib = core
    assert number not in {_message(name).frame_id >> 4 for name in NAMES}
    for length in range(9):
        frame: Any = ffi.new("struct dcmp_frame *", (16 * number + 3, length, [0] * 8))
        assert lib.dcmp_check_any(frame, 3) == lib.DCMP_FOREIGN
        assert lib.dcmp_check(frame, 3) == lib.DCMP_FOREIGN


def test_c_has_the_values(core: tuple[FFI, Any]) -> None:
    assert (core[1].DCMP_ROUND, core[1].DCMP_SQUARE, core[1].DCMP_WIDE) == (1, 2, 0x010)


# ------------------------------------------------------------------------------------ one field more


def test_a_field_is_typed_in_the_dbc_alone() -> None:
    """HEALTH gets a temperature by its row in our DBC; everything that is generated has it then."""
    text = protocol_dbc.DBC.read_text("utf-8")
    old, crc = (
        "BO_ 176 HEALTH: 7 DEVICE",
        'idle_percent : 40|8@1+ (1,0) [0|100] "%" HOST\n SG_ crc8 : 48|8@1+',
    )
    row = ' SG_ temperature_C : 48|8@1- (1,0) [-128|127] "degC" HOST\n SG_ crc8 : 56|8@1+'
    assert (text.count(old), text.count(crc)) == (1, 1)
    text = text.replace(old, "BO_ 176 HEALTH: 8 DEVICE").replace(crc, crc.partition("\n")[0] + "\n" + row)
    found = layouts(load(text))
    assert "    temperature_C: int  # -128..127 degC\n" in python_code.messages(found)
    assert '_HEALTH = Struct("<BBBBBBb")\n' in python_code.layouts(found)
    assert "    int8_t temperature_C;\n" in c_code.header(found)
    assert "    put(&frame->data[6], (uint8_t)message->temperature_C, 1);\n" in c_code.pack(found)
    assert "    message->temperature_C = (int8_t)frame->data[6];\n" in c_code.unpack(found)
    assert "`temperature_C` 48, s8 degC" in page(PAGE.read_text("utf-8"), load(text), found, 0)
