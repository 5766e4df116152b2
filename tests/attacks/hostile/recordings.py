"""Recordings made by hand to hurt who reads them; their checksums are right where that gets them further."""

from __future__ import annotations

import json
import struct
import zlib
from functools import cache
from typing import Any

import numpy as np
import zstandard
from lz4 import frame as lz4  # type: ignore[import-untyped]

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.metadata import rig_json
from dcmp_hil.recording.schema import CYCLE_SCHEMA
from tests.helpers import bench

MAGIC = b"\x89MCAP0\r\n"
BEGAN_NS = 1_767_225_600_000_000_000
RUN = {"format": "2", "version": "0.1", "rig": "bench-1khz", "note": "", "faults": "[]"}
ESCAPE = "\x1b]0;owned\x07\x1b[2J\x1b[31mred\x9b31m\r\n\u202eeslaf"


def record(opcode: int, content: bytes, length: int | None = None) -> bytes:
    return struct.pack("<BQ", opcode, len(content) if length is None else length) + content


def text(value: str | bytes) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def chunk(
    data: bytes,
    size: int | None = None,
    packed: bytes | None = None,
    crc: int | None = None,
    name: str = "zstd",
) -> bytes:
    packed = zstandard.compress(data) if packed is None else packed
    head = struct.pack(
        "<QQQI", 0, 0, len(data) if size is None else size, zlib.crc32(data) if crc is None else crc
    )
    return record(0x06, head + text(name) + struct.pack("<Q", len(packed)) + packed)


def attachment(name: str, data: bytes, size: int | None = None) -> bytes:
    content = struct.pack("<QQ", BEGAN_NS, BEGAN_NS) + text(name) + text("application/json")
    content += struct.pack("<Q", len(data) if size is None else size) + data
    return record(0x09, content + struct.pack("<I", zlib.crc32(content)))


def message(channel: int, sequence: int, at: int, data: bytes) -> bytes:
    return record(0x05, struct.pack("<HIQQ", channel, sequence, at, at) + data)


def row(number: int, t: float | None = None, **fields: float) -> bytes:
    values = dict.fromkeys(FIELDS, 0.0) | {"t": number * 1e-3 if t is None else t} | fields
    at = BEGAN_NS + (round(values["t"] * 1e9) if abs(values["t"]) < 1e9 else 0)
    return message(1, number, at, b"\0\1\0\0" + np.array(list(values.values()), "<f8").tobytes())


def rows(count: int = 50, **fields: float) -> bytes:
    return b"".join(row(number, **fields) for number in range(1, count + 1))


def event(number: int, document: Any, t: float = 0.0) -> bytes:
    data = document if isinstance(document, bytes) else json.dumps(document).encode()
    return message(2, number, BEGAN_NS + round(t * 1e9), data)


def told(number: int, said: str, **more: Any) -> bytes:
    return event(number, {"t": 0.0, "level": 2, "name": "other", "message": said, "data": None, **more})


def schema(number: int, content: bytes = CYCLE_SCHEMA) -> bytes:
    return record(
        0x03, struct.pack("<H", number) + text("dcmp_hil/msg/Cycle") + text("ros2msg") + text(content)
    )


def channel(number: int, topic: str, of: int = 1) -> bytes:
    return record(0x04, struct.pack("<HH", number, of) + text(topic) + text("cdr") + struct.pack("<I", 0))


@cache
def rig() -> dict[str, Any]:
    made: dict[str, Any] = json.loads(rig_json(bench()))
    return made


def file(*parts: bytes, run: Any = RUN, of: Any = None, end: Any = None, tail: bytes = b"") -> bytes:
    """Return a recording with a sound beginning and these records."""
    said = run if isinstance(run, bytes) else json.dumps(run).encode()
    described = of if isinstance(of, bytes) else json.dumps(rig() if of is None else of).encode()
    made = MAGIC + record(0x01, text("ros2") + text("dcmp-hil"))
    made += attachment("run.json", said) + attachment("rig.json", described) + b"".join(parts)
    if end is not None:
        made += attachment("end.json", json.dumps(end).encode())
    if tail:
        return made + tail
    made += record(0x0F, struct.pack("<I", zlib.crc32(made)))
    return made + record(0x02, struct.pack("<QQI", 0, 0, 0)) + MAGIC


def _changed(section: str, **keys: Any) -> dict[str, Any]:
    return {**rig(), section: {**rig().get(section, {}), **keys}}


def _lying_frame() -> bytes:
    """Return a zstd frame that says it is 4 GiB."""
    return b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 4 << 30) + zstandard.compress(b"x" * 100)[9:]


def recordings() -> dict[str, bytes]:
    """Return every file by its name."""
    zeros = zstandard.compress(bytes(16 << 20))
    bomb = chunk(bytes(16 << 20), packed=zeros)
    lz4_zeros = lz4.compress(bytes(16 << 20))
    same = message(9, 0, 0, b"")
    periods = chunk(rows())
    deep = b"[" * 200_000
    change = {"t": 0.01, "level": 2, "name": "change", "message": "x"}
    return {
        "bomb of zeros": file(*[bomb] * 60),
        "bomb of rows": file(*[chunk(row(1) * (16 << 20 >> 8))] * 40),
        "bomb of lz4": file(*[chunk(bytes(16 << 20), packed=lz4_zeros, name="lz4")] * 20),
        "bomb of tiny messages": file(*[chunk(same * 500_000)] * 5),
        "bomb in a search": file(*[chunk(bytes(16 << 20), packed=zeros, crc=7)] * 300),
        "a block that says 4 GiB": file(chunk(b"x", size=4 << 30), periods),
        "a block that says 2**64": file(chunk(b"x", size=2**64 - 1), periods),
        "a frame that says 4 GiB": file(chunk(b"x" * 100, packed=_lying_frame()), periods),
        "a block of another compression": file(chunk(b"x", name="\x1b[31m"), periods),
        "a block within a block": file(chunk(periods), periods),
        "a record of 2**64": file(record(0x06, b"x", 2**64 - 1), periods),
        "a record of 2**63": file(periods, tail=record(0x06, b"", 2**63)),
        "an attachment with a wrong size": file(attachment("rig.json", b"{}", 2**62), periods),
        "an attachment with a name of 4 GiB": file(
            record(0x09, bytes(16) + b"\xff" * 4 + bytes(40)), periods
        ),
        "metadata that lie": file(record(0x0C, text("run") + struct.pack("<I", 2**32 - 1)), periods),
        "metadata of many keys": file(
            record(0x0C, text("run") + text(b"".join(text(str(k)) + text("") for k in range(60_000)))),
            periods,
        ),
        "deep rig": file(periods, of=deep),
        "deep run": file(periods, run=deep),
        "deep event": file(chunk(rows() + event(1, deep))),
        "rig of one huge number": file(periods, of=b'{"loop": {"rate_hz": 1' + b"0" * 100_000 + b"}}"),
        "rig of a rate of 1e308": file(periods, of=_changed("loop", rate_hz=1e308)),
        "rig of a rate of 1e-308": file(periods, of=_changed("loop", rate_hz=1e-308)),
        "rig of infinities": file(periods, of=_changed("model", ku_rad_s2_V=float("inf"))),
        "rig of NaN": file(periods, of=_changed("model", gravity_rad_s2=float("nan"))),
        "rig that is a list": file(periods, of=[1, 2]),
        "rig that is empty": file(periods, of={}),
        "rig with a long name": file(periods, of={**rig(), "name": "x" * 900_000}),
        "rig with escapes": file(periods, of={**rig(), "name": ESCAPE, ESCAPE: 1}),
        "rig in a folder with a NUL": file(periods, run={**RUN, "rig_folder": "../\0/etc"}),
        "rig in a folder elsewhere": file(periods, run={**RUN, "rig_folder": "../" * 3000 + "etc"}),
        "gains beyond all": file(periods, of=_changed("observer", M_rad_s3=1e300, L1_1_s=1e300)),
        "run of escapes": file(periods, run={**RUN, "format": ESCAPE, "version": ESCAPE}),
        "run of other things": file(periods, run={**RUN, "note": {"a": [1]}, "faults": 3}),
        "run that is a number": file(periods, run=3),
        "run with faults of escapes": file(periods, run={**RUN, "faults": '"host.' + ESCAPE}),
        "millions of tiny records": file(record(0x08, b"") * 200_000, periods),
        "records of no kind": file(b"\xff" * 3_000_000, periods),
        "many landmarks": file(b"\x04\0\0\0zstd" * 300_000, periods),
        "many false blocks": file(chunk(b"abc" * 99, crc=3) * 20_000, periods),
        "many false attachments": file(attachment("rig.json", b"{}")[:-1] * 20_000, periods),
        "more events than any": file(*[chunk(told(k, "x") * 20_000) for k in range(15)]),
        "two channels of one number": file(
            chunk(schema(1) + channel(1, "/cycles") + channel(1, "/events") + rows())
        ),
        "two channels of one topic": file(
            chunk(schema(1) + channel(1, "/cycles") + channel(7, "/cycles") + rows())
        ),
        "a schema of other columns": file(
            chunk(schema(1, CYCLE_SCHEMA.replace(b"t_s", b"x")) + channel(1, "/cycles") + rows())
        ),
        "a topic of escapes": file(chunk(schema(1) + channel(5, ESCAPE) + rows())),
        "time that is none": file(chunk(rows(5) + row(6, t=float("nan")) + row(7))),
        "time without end": file(chunk(rows(5) + row(6, t=float("inf")) + row(7))),
        "time that runs backwards": file(chunk(rows(5) + row(6, t=0.001) + row(7))),
        "a fault beyond all": file(chunk(rows(fault=1e300))),
        "positions beyond all": file(chunk(rows(position=1e308, voltage_applied=-1e308))),
        "positions that are none": file(chunk(rows(position=float("nan")))),
        "positions without end": file(chunk(rows(position=float("inf"), position_ahead=float("-inf")))),
        "began in the past": file(chunk(rows(began=-1e300, position_ahead=1e300))),
        "events of escapes": file(chunk(rows() + told(1, ESCAPE * 100) + told(2, "\ud800"))),
        "events that are none": file(
            chunk(rows() + told(1, "x", t="soon") + event(2, b"{\xff") + event(3, 7))
        ),
        "events of other data": file(
            chunk(rows() + event(1, {**change, "data": {"values": {ESCAPE: ESCAPE, "a.b": "c" * 9000}}}))
        ),
        "a change to a class": file(
            chunk(rows() + event(1, {**change, "data": {"values": {"controller.kind": "evil:Mine"}}}, 0.01))
        ),
        "a change to a file": file(
            chunk(
                rows()
                + event(
                    1,
                    {
                        **change,
                        "data": {"values": {"reference.kind": "csv", "reference.file": "/etc/passwd"}},
                    },
                    0.01,
                )
            )
        ),
        "four thousand million periods": file(chunk(row(1) + row(2**32 - 1, t=5.0))),
        "periods of no number": file(chunk(row(0) * 50)),
        "an end that lies": file(periods, end={"periods": 10**30, "events": -5, "missing": None}),
        "an end of words": file(periods, end={"periods": "many", "events": True}),
        "sentences of format 1": file(
            chunk(
                rows()
                + event(0, {"t": 0.0, "name": "INFO", "message": "a.b: " * 1900 + ", applied at t = 1 s"})
                * 30
            ),
            run={**RUN, "format": "1"},
        ),
        "a beginning and nothing": MAGIC,
        "nothing": b"",
        "words": b"time_s,position_rad\n0,0\n",
    }
