"""What the vendor says of the registers: offsets, reset values, bits that exist. Read from pyocd's wheel."""

from __future__ import annotations

import functools
import importlib.resources
import io
import xml.etree.ElementTree as ET
import zipfile
from typing import NamedTuple

_UINT32_MAX = 0xFFFF_FFFF
_F405 = {("GPIOA", "MODER"): 0xA800_0000, ("CAN1", "ESR"): 0, ("FLASH", "CR"): 0x8000_0000}
"""Reset values in RM0090 that the description of the F429 has otherwise."""
_BY_HARDWARE = {"IDR", "SR", "CNT", "CCR1", "CCR2", "CCR3", "CCR4", "CSR", "CIR"}
"""Registers whose content the hardware changes: what is written is the model's business."""


class Register(NamedTuple):
    """Address and fields of one register."""

    name: str
    reset: int
    bits: int  # those that exist
    read_only: bool


def _number(text: str | None, default: int = 0) -> int:
    return default if text is None else int(text, 0)


def _mask(register: ET.Element) -> int:
    mask = 0
    for field in register.iter("field"):
        width = _number(field.findtext("bitWidth"), 1)
        mask |= ((1 << width) - 1) << _number(field.findtext("bitOffset"))
    return mask


@functools.cache
def peripherals(chip: str = "STM32F429x") -> dict[str, ET.Element]:
    """Return every peripheral of a chip as the vendor wrote it down."""
    packed = (importlib.resources.files("pyocd") / "debug/svd/svd_data.zip").read_bytes()
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        root = ET.fromstring(archive.read(f"{chip}.svd"))  # noqa: S314 - from a wheel with a hash
    return {element.findtext("name", ""): element for element in root.iter("peripheral")}


@functools.cache
def description() -> dict[str, tuple[int, dict[int, Register]]]:
    """Return every peripheral's base address and its registers by offset."""
    elements = peripherals()
    found = {}
    for name, element in elements.items():
        described = elements.get(element.get("derivedFrom", ""), element)
        registers: dict[int, Register] = {}
        for register in described.iter("register"):
            label = register.findtext("name", "")
            reset = _F405.get((name, label), int(register.findtext("resetValue", "0"), 16))
            offset = _number(register.findtext("addressOffset"))
            read_only = register.findtext("access") == "read-only"
            registers.setdefault(offset, Register(label, reset & _UINT32_MAX, _mask(register), read_only))
        found[name] = (_number(element.findtext("baseAddress")), registers)
    return found
