"""Instruction sets that the C of the lanes is compiled for, and which of them this computer has."""

from __future__ import annotations

import functools
import platform
from pathlib import Path
from typing import NamedTuple

_CPU_INFO = Path("/proc/cpuinfo")


class InstructionSet(NamedTuple):
    """An instruction set.

    Parameters
    ----------
    name
        For people.
    flags
        Of the compiler.
    needs
        What /proc/cpuinfo names on a computer that has it.
    """

    name: str
    flags: tuple[str, ...]
    needs: frozenset[str]


_AVX2 = frozenset({"sse4_2", "avx", "avx2", "bmi1", "bmi2", "fma", "movbe", "f16c"})
SETS = (
    InstructionSet(
        "AVX-512",
        ("-march=x86-64-v4", "-mprefer-vector-width=512"),
        _AVX2 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    ),
    InstructionSet("AVX2", ("-march=x86-64-v3",), _AVX2),
    InstructionSet("SSE4.2", ("-march=x86-64-v2",), frozenset({"sse4_2", "popcnt", "ssse3"})),
)
"""From the widest vectors to the narrowest."""
PLAIN = InstructionSet("baseline", (), frozenset())
"""Instructions that every computer of an architecture has."""


def available(cpu_info: str, machine: str) -> tuple[InstructionSet, ...]:
    """Return the instruction sets of a computer, the widest vectors first.

    Parameters
    ----------
    cpu_info
        Text of its /proc/cpuinfo.
    machine
        Its architecture, such as `x86_64`.
    """
    flags: set[str] = set()
    for line in cpu_info.splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "flags":
            flags = set(value.split())
            break
    found = [one for one in SETS if machine == "x86_64" and one.needs <= flags]
    return (*found, PLAIN)


@functools.cache
def here() -> tuple[InstructionSet, ...]:
    """Return the instruction sets of this computer, the widest vectors first."""
    try:
        text = _CPU_INFO.read_text(encoding="utf-8", errors="replace")
    except OSError:
        text = ""
    return available(text, platform.machine())
