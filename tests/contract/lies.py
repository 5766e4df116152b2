"""Devices that lie: each message of a device may be changed or left out before the host reads it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import (
    Parameter,
    ParameterValue,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message

    Lie = Callable[[Message], Message | None]

SHORT_BOOT_WAIT = "backend.boot_wait_s=0.5"


def lying(lie: Lie) -> Callable[[list[Frame]], list[Frame]]:
    """Pass every message of the device through `lie`; what becomes None is not sent."""

    def change(frames: list[Frame]) -> list[Frame]:
        told = (lie(unpack(frame)) for frame in frames)  # type: ignore[arg-type]
        return [pack(message) for message in told if message is not None]

    return change


def says(parameter: Parameter, value: int, result: int = 0) -> Lie:
    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter:
            return ParameterValue(parameter, value, result)
        return message

    return lie


def at_first(parameter: Parameter, value: int) -> Lie:
    """Say a value until another is set: the first answer is the comparison's."""
    left = [1]

    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter and left:
            left.pop()
            return ParameterValue(parameter, value, 0)
        return message

    return lie


def forgets(parameter: Parameter, value: int, answers: int) -> Lie:
    """Say another value after so many answers about the parameter: what was set is not kept."""
    heard = [0]

    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter:
            heard[0] += 1
            if heard[0] > answers:
                return ParameterValue(parameter, value, 0)
        return message

    return lie


def every(kind: type, **fields: int | bool) -> Lie:
    return lambda message: message._replace(**fields) if isinstance(message, kind) else message  # type: ignore[arg-type]
