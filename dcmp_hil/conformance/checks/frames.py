"""Sections 1 and 2: what is a frame of this device, and what is damaged."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Hello, ParameterGet, State, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client

COUNTER_MAX = 255  # a counter that stops counts nothing any more
_REPETITIONS = 3


def layout(client: Client) -> Iterator[str]:
    """Listen, ask for each kind of answer, and see that every frame is a message of the page."""
    damaged = client.line.damaged
    client.strange.clear()
    client.hello()
    client.hello(0, wrong=1)
    client.get(1)
    client.listen(client.periods(250))
    yield from client.strange[:5]
    if client.line.damaged > damaged:
        yield f"{client.line.damaged - damaged} pieces of what came are no frame of this carrier"


def spoilt(client: Client) -> Iterator[str]:
    """Send frames whose crc8 is wrong."""
    session = client.own()
    before = client.health().crc_errors
    mark = client.mark()
    for _ in range(_REPETITIONS):
        client.drive(session, spoilt=True)
        client.send_spoilt(Stop(0))
    since = client.after_fence(mark)
    if any(not seen.sample.missed for seen in since):
        yield "a DRIVE whose crc8 is wrong was accepted"
    if client.state == State.FAULT:
        yield "a STOP whose crc8 is wrong was obeyed"
    at = len(client.heard)
    client.send_spoilt(Hello(0, PROTOCOL_HASH))
    client.send_spoilt(ParameterGet(1))
    client.listen(client.periods(50))
    answers = [message for message in client.heard[at:] if type(message).__name__ in _ANSWER_NAMES]
    if answers:
        yield f"a question whose crc8 is wrong was answered: {answers[0]}"
    grown = client.health().crc_errors - before
    expected = 2 * _REPETITIONS + 2
    if before + expected < COUNTER_MAX and grown != expected:
        yield f"{expected} frames with a wrong crc8 were sent, HEALTH.crc_errors grew by {grown}"


_ANSWER_NAMES = ("Identity", "ParameterValue")


def foreign(client: Client) -> Iterator[str]:
    """Send frames of other nodes, numbers and lengths: a STOP of another node changes nothing."""
    session = client.own()
    before = client.health().crc_errors
    _, stop = pack(Stop(0), client.node)
    other = (client.node + 1) % 16
    for frame in (
        pack(Stop(0), other),
        (pack(Stop(0), other)[0], b"\0\0"),  # its crc8 wrong: no business of this node
        (0x010 | client.node, stop + b"\0"),
        (0x020 | client.node, bytes(7)),
        (0x060 | client.node, bytes(8)),
        (0x7E0 | client.node, bytes(8)),
        (0x0C0 | client.node, bytes(7)),
        (0x000 | client.node, bytes(2)),
        (0x040 | client.node, bytes(8)),
    ):
        client.line.send(frame)
    client.get(1)
    client.listen(2)
    if client.state == State.FAULT:
        yield "a STOP for another node, or of a wrong length, was obeyed"
    grown = client.health().crc_errors - before
    if grown:
        yield f"frames for others, of other lengths and numbers are no errors, but crc_errors grew by {grown}"
    client.drive(session, release=True)


CHECKS = (
    DeviceCheck(
        "frames",
        "1",
        "Every frame of a device is a message of the table, with a right crc8 and 0 in bits without a name.",
        layout,
    ),
    DeviceCheck("wrong-crc8", "2", "A frame with a wrong crc8 is dropped and counted in HEALTH.", spoilt),
    DeviceCheck(
        "foreign-frames",
        "1",
        "A frame of another node, an unknown number or another length is ignored and is no error.",
        foreign,
    ),
)
