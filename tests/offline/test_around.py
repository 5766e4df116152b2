"""What stands around the numbers of a recording, and what of it cannot be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.offline.logged import (
    DEG_PER_RAD,
    EPOCH_S,
    HEADER,
    Cases,
    Expect,
    T,
    between,
    check,
    columns,
    iso,
    usual,
    with_cell,
)

if TYPE_CHECKING:
    from pathlib import Path

CASES = Cases()
case = CASES.add

# ------------------------------------------------------------------------------------ around the numbers
case(
    "a row of units",
    lambda: [
        "time,position,voltage",
        "ms,deg,mV",
        *columns(
            lambda t: f"{1e3 * t:.3f}", lambda q: f"{DEG_PER_RAD * q:.6f}", lambda u: f"{1e3 * u:.3f}"
        ).lines(),
    ],
)
case(
    "PicoScope",
    lambda: [
        "Time,Angle,Voltage",
        "(ms),(deg),(V)",
        "",
        *columns(lambda t: f"{1e3 * t:.6f}", lambda q: f"{DEG_PER_RAD * q:.8f}").lines(),
    ],
)
case(
    "a preamble",
    lambda: [
        "Bench 3",
        "Operator;lab",
        "Date: 2026-03-02, 10:11:12",
        "Rate,500,Hz",
        "",
        *usual().splitlines(),
    ],
    expect=Expect(note="before the header left out"),
)
case(
    "LabVIEW",
    lambda: [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Separator\tTab",
        "***End_of_Header***\t",
        "",
        "Channels\t2\t\t",
        "Samples\t1500\t1500\t",
        "X0\t0.0\t0.0\t",
        "Delta_X\t0.002\t0.002\t",
        "***End_of_Header***\t\t\t",
        "X_Value\tposition_rad\tvoltage_V\tComment",
        *(f"{row}\t" for row in columns().lines("\t")),
    ],
)
case(
    "comment lines",
    lambda: [
        "# a",
        "# b,c",
        HEADER,
        *(
            line
            for k, row in enumerate(columns().lines())
            for line in ([f"# {k}"] if k % 300 == 7 else []) + [row]
        ),
    ],
)
case("MATLAB's comment sign", lambda: ["% time_s,position_rad,voltage_V", *columns().lines()])
case(
    "boot text, warnings, footer",
    lambda: [
        "ets Jul 29 2019",
        "rst:0x1 (POWERON_RESET),boot:0x13",
        *between("WARN: index", "E (1234) enc: lost 3, 4"),
        "# end of file",
        "Total rows: 1500",
    ],
    expect=Expect(note="2 lines before the header"),
)
case("header in the middle", lambda: between(HEADER), expect=Expect(note="The header comes 2 times"))
case(
    "the monitor's time before each line",
    lambda: [f"10:11:{12 + k * T:09.6f} -> {row}" for k, row in enumerate([HEADER, *columns().lines()])],
)
case(
    "pandas with an index", lambda: [f",{HEADER}", *(f"{k},{row}" for k, row in enumerate(columns().lines()))]
)
case(
    "R with row names",
    lambda: [
        '"time_s" "position_rad" "voltage_V"',
        *(f'"{k}" {row}' for k, row in enumerate(columns().lines(" "), 1)),
    ],
)
case("text columns", lambda: [f"frame_id,{HEADER},state", *(f"base,{row},RUN" for row in columns().lines())])
case(
    "PlotJuggler",
    lambda: [
        "__time,/joint_states/pendulum/position,/joint_states/pendulum/velocity,/cmd/voltage",
        *(f"{EPOCH_S + float(t):.6f},{q},0.0,{u}" for t, q, u in zip(*columns(), strict=True)),
    ],
    expect=Expect(near=1e-3),
)
case("no header", lambda: columns().lines(), time="1", position="2", voltage="3")
case(
    "no header, serial capture begins within a line",
    lambda: ["09970,0.1", *columns().lines()],
    time="1",
    position="2",
    voltage="3",
)

# ------------------------------------------------------------------------------------- what cannot be read
LEFT = Expect(near=2e-3)
case("empty cells", lambda: with_cell(1, "", "", ""), expect=LEFT._replace(out=3, note="3 rows left out"))
case(
    "NaN, inf, overflow",
    lambda: with_cell(
        1, "nan", "NaN", "inf", "-Inf", "1e999", "ovf", "#N/A", "-1.#IND", "1.#QNAN", "NULL", "--"
    ),
    expect=LEFT._replace(out=11, note="11 rows left out"),
)
case("NaN as input", lambda: with_cell(2, "nan", ""), expect=LEFT._replace(out=2))
case("no time in two rows", lambda: with_cell(0, "", "x"), expect=LEFT._replace(out=2))
case(
    "NULs within and between",
    lambda: "\n".join(between("\0\0\0\0\0")).replace("0.6", "0\0\0.6", 1).encode(),
    expect=LEFT._replace(note="NUL"),
)
case("torn last line", lambda: usual()[:-14], expect=LEFT._replace(note="left out"))
case("torn within the last number", lambda: usual()[:-3], expect=LEFT._replace(note="unfinished"))
case(
    "two rows run together",
    lambda: between("1.000000,0.0911.002000,0.1,0.5"),
    expect=Expect(note="1 line left out"),
)
case("a short row", lambda: between("1.000000,0.1"), expect=Expect(note="1 line left out"))
case(
    "a glitch of the position",
    lambda: with_cell(1, "99.5", "-340.25"),
    expect=LEFT._replace(out=2, note="no arm can have been at"),
)
case(
    "two velocities",
    lambda: [
        f"{HEADER},Motor Electrical Speed (RPM),Motor Optical Speed (RPM)",
        *(f"{row},0,0" for row in columns().lines()),
    ],
    expect=Expect(note="No velocity"),
)
case(
    "a velocity that is not wanted",
    lambda: [f"{HEADER},velocity_rad_s", *(f"{row},99" for row in columns().lines())],
    velocity="none",
)
case(
    "a velocity with holes",
    lambda: [
        f"{HEADER},velocity_rad_s",
        *(f"{row},{'nan' if k % 3 else '1.0'}" for k, row in enumerate(columns().lines())),
    ],
)
case(
    "a velocity of words",
    lambda: [f"{HEADER},velocity_rad_s", *(f"{row},off" for row in columns().lines())],
    expect=Expect(note="holds no number"),
)

# ------------------------------------------------------------------------------------- named instruments
case(
    "Rigol",
    lambda: [
        "X,CH1,CH2,Start,Increment,",
        "Sequence,Volt,Volt,-6.000000e-03,2.000000e-03",
        *(f"{k},{q},{u},," for k, (q, u) in enumerate(zip(columns().q, columns().u, strict=True))),
    ],
    time="X",
    position="CH1",
    position_unit="rad",
    voltage="CH2",
    period=T,
)
case(
    "Tektronix, without a header",
    lambda: [
        f"{'Record Length,1500,' if k == 0 else 'Source,CH1,' if k == 1 else ',,'},{t},{q},{u},"
        for k, (t, q, u) in enumerate(zip(*columns(), strict=True))
    ],
    time="4",
    position="5",
    voltage="6",
)
case(
    "Tektronix",
    lambda: [
        *("Model,MDO3014", "Firmware Version,1.2", "", "Horizontal Units,S,", ",,", "Sample Interval,0.002,"),
        *("Record Length,1500,", "Label,pos,volt", "TIME,CH1,CH2"),
        *columns().lines(),
    ],
    position="CH1",
    voltage="CH2",
)
case(
    "dSPACE",
    lambda: [
        *("type;time;angle;voltage", "unit;s;rad;V"),
        *(f"data;{row}" for row in columns().lines(";")),
    ],
)
case(
    "pandas with an index of times",
    lambda: [
        ",position_rad,voltage_V",
        *(f"{iso(float(t), '+00:00', ' ')},{q},{u}" for t, q, u in zip(*columns(), strict=True)),
    ],
)
case(
    "rosbag to csv",
    lambda: [
        "rosbagTimestamp,header,seq,stamp,secs,nsecs,frame_id,name,position,velocity,effort",
        *(
            f"{(EPOCH_S * 500 + k) * 2000000},,{k},,{EPOCH_S + k // 500},{k % 500 * 2000000},'',"
            f"['j'],[{q}],[0],[{u}]"
            for k, (q, u) in enumerate(zip(columns().q, columns().u, strict=True))
        ),
    ],
    voltage="effort",
)


@pytest.mark.parametrize("name", CASES)
def test_the_same_motion_gives_the_same_figure(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)
