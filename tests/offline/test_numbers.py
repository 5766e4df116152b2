"""Encodings, delimiters and numbers as loggers write them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from tests.offline.logged import (
    COUNTS_PER_REV,
    DEG_PER_RAD,
    HEADER,
    Cases,
    Expect,
    check,
    columns,
    motion,
    usual,
)

if TYPE_CHECKING:
    from pathlib import Path

CASES = Cases()
case = CASES.add

# ------------------------------------------------------------------------------- encodings and line ends
case("UTF-8 with a mark", lambda: "\ufeff" + usual())
case("UTF-16 with a mark", lambda: usual(end="\r\n").encode("utf-16"))
case("UTF-16 without one", lambda: usual().encode("utf-16-le"))
case("UTF-16, the other way round", lambda: usual().encode("utf-16-be"))
case("CRLF", lambda: usual(end="\r\n").encode())
case("CR alone", lambda: usual(end="\r").encode())
case("LF and CRLF mixed", lambda: usual().replace("\n", "\r\n", 700).encode())
case(
    "Excel, German, Windows-1252",
    lambda: "\r\n".join(
        [
            "Zeit [s];Winkel [°];Spannung [V]",
            *columns(q=lambda q: f"{q * DEG_PER_RAD:.6f}").lines(";", comma=True),
        ]
    ).encode("cp1252"),
    expect=Expect(note="Windows-1252"),
)
case("no end of the last line", lambda: usual().rstrip("\n").encode())

# --------------------------------------------------------------------------------- delimiters and numbers
case("tabs", lambda: usual().replace(",", "\t"))
case("semicolons", lambda: usual().replace(",", ";"))
case("bars", lambda: usual().replace(",", " | "))
case(
    "white space, aligned",
    lambda: [
        "time_s position_rad voltage_V",
        *(f"{t:>12} {q:>14}   {u:>10}" for t, q, u in zip(*columns(), strict=True)),
    ],
)
case("comma and space", lambda: usual().replace(",", ", "))
case("a delimiter at the end of each row", lambda: [HEADER, *(f"{row}," for row in columns().lines())])
case(
    "numpy.savetxt",
    lambda: ["# time_s position_rad voltage_V", *columns("{:.18e}", "{:.18e}", "{:.18e}").lines(" ")],
)
case(
    "numpy.savetxt, two comments",
    lambda: ["# bench 3", "# time_s,position_rad,voltage_V", *columns("{:.18e}").lines(",")],
)
case(
    "names and units apart, white space",
    lambda: ["# time [s]  position [rad]  voltage [V]", *columns().lines("  ")],
)
case("decimal comma and tabs", lambda: [HEADER.replace(",", "\t"), *columns().lines("\t", comma=True)])
case("decimal comma and white space", lambda: [HEADER.replace(",", " "), *columns().lines("  ", comma=True)])
case(
    "decimal comma between commas",
    lambda: [HEADER, *columns().lines(",", comma=True)],
    expect=Expect(note="every two fields are one number"),
)
case(
    "decimal comma, quoted, between commas",
    lambda: [
        HEADER,
        *(",".join(f'"{cell}"' for cell in row.split(";")) for row in columns().lines(";", comma=True)),
    ],
)
case(
    "thousands with points",
    lambda: [
        "time_ms;position_mrad;voltage_mV",
        *(
            f"{1000 * t:,.3f};{1000 * q:,.5f};{1000 * u:,.3f}".translate(str.maketrans(",.", ".,"))
            for t, q, u in zip(motion().time, motion().position, motion().voltage, strict=True)
        ),
    ],
)
case(
    "thousands with commas, quoted",
    lambda: [
        "time_ms,position_mrad,voltage_mV",
        *(
            f'"{1000 * t:,.3f}","{1000 * q:,.5f}","{1000 * u:,.3f}"'
            for t, q, u in zip(motion().time, motion().position, motion().voltage, strict=True)
        ),
    ],
)
case(
    "everything quoted",
    lambda: [
        '"time_s","position_rad","voltage_V"',
        *(",".join(f'"{cell}"' for cell in row.split(",")) for row in columns().lines()),
    ],
)
case("exponents, signs", lambda: [HEADER, *columns("{:+.9E}", "{:+.9E}", "{:+.6e}").lines()])
case(
    "units behind the numbers",
    lambda: ["time,position,voltage", *(f"{t} s,{q} rad,{u} V" for t, q, u in zip(*columns(), strict=True))],
)
case("MATLAB durations", lambda: ["Time,position_rad,voltage_V", *columns(t="{:.3f} sec").lines()])
case(
    "names before the numbers",
    lambda: [f"t:{t},pos:{q},voltage:{u}" for t, q, u in zip(*columns(), strict=True)],
)
case("sep= line", lambda: ["sep=;", *usual().replace(",", ";").splitlines()])
case("sep= line, quoted", lambda: ['"sep=,"', *usual().splitlines()])
case(
    "counts in hex",
    lambda: [
        "time_s,counts,voltage_V",
        *(
            f"{t},0x{round(q * COUNTS_PER_REV / math.tau) % 65536:04X},{u}"
            for t, q, u in zip(columns().t, motion().position, columns().u, strict=True)
        ),
    ],
    counts_per_rev=COUNTS_PER_REV,
    modulus=65536.0,
)


@pytest.mark.parametrize("name", CASES)
def test_the_same_motion_gives_the_same_figure(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)
