"""Time columns in the formats of loggers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.offline import ColumnOptions, ReplaySettings, read_recording, replay
from tests.offline.logged import (
    EPOCH_S,
    HEADER,
    Cases,
    Expect,
    T,
    between,
    check,
    clocked,
    columns,
    figure,
    iso,
    motion,
    stamped,
    with_cell,
)

if TYPE_CHECKING:
    from pathlib import Path

CASES = Cases()
case = CASES.add

LEFT = Expect(near=2e-3)
# ------------------------------------------------------------------------------------------------- time
case("ISO", lambda: clocked(iso))
case("ISO with Z", lambda: clocked(lambda t: iso(t, "Z")))
case("ISO with a zone", lambda: clocked(lambda t: iso(t, "+01:00", " ")))
case("ISO, nanoseconds", lambda: clocked(lambda t: iso(t, "", " ", 9)))
case(
    "pandas, fraction only where there is one",
    lambda: clocked(lambda t: iso(t, "", " ").replace(".000000", "")),
)
case("ISO over midnight", lambda: clocked(lambda t: iso(t, start=86398.5)))
case(
    "time of day over midnight",
    lambda: clocked(lambda t: iso(t, start=86398.5)[11:], "Time"),
    expect=Expect(note="wraps at 86400 s"),
)
case(
    "German date and time",
    lambda: [
        "Zeit;position_rad;voltage_V",
        *(
            f"02.03.2026 {iso(float(t))[11:].replace('.', ',')};{q.replace('.', ',')};{u.replace('.', ',')}"
            for t, q, u in zip(*columns(), strict=True)
        ),
    ],
)
case("American time", lambda: clocked(lambda t: "3/2/2026 " + iso(t)[11:] + " AM", "DateTime"))
case("time in brackets", lambda: clocked(lambda t: f"({EPOCH_S + t:.6f})"), expect=Expect(near=1e-3))


def epoch(a_second: int) -> list[str]:
    return stamped(lambda k: f"{(EPOCH_S * 500 + k) * a_second // 500}", "timestamp")


case("epoch in s", lambda: stamped(lambda k: f"{EPOCH_S + k * T:.6f}", "timestamp"), expect=Expect(near=1e-3))
case("epoch in ms", lambda: epoch(10**3), expect=Expect(near=1e-3))
case("epoch in us", lambda: epoch(10**6), expect=Expect(near=1e-3))
case("epoch in ns", lambda: epoch(10**9), expect=Expect(near=1e-3))
case(
    "ROS, %time in ns",
    lambda: stamped(lambda k: str(EPOCH_S * 10**9 + k * 2 * 10**6), "%time"),
    expect=Expect(near=1e-3),
)
case(
    "secs and nsecs",
    lambda: stamped(lambda k: f"{EPOCH_S + k // 500},{k % 500 * 2 * 10**6}", "stamp.secs,stamp.nsecs"),
)
case("sec and usec", lambda: stamped(lambda k: f"{EPOCH_S + k // 500},{k % 500 * 2000}", "tv_sec,tv_usec"))
case(
    "sec and nanosec, by option",
    lambda: stamped(lambda k: f"{EPOCH_S + k // 500},{k % 500 * 2 * 10**6}", "header_sec,header_nanosec"),
    time="header_sec+header_nanosec",
)
case("the same time twice", lambda: stamped(lambda k: f"{k * T:.6f},{2 * k}", "time_s,time_ms"))
case("millis()", lambda: stamped(lambda k: str(2 * k), "millis"))
WRAP = Expect(note="The time counter wraps at 2^32")
case(
    "micros() wraps",
    lambda: stamped(lambda k: str((2**32 - 10**6 + 2000 * k) % 2**32), "micros"),
    expect=WRAP,
)
case(
    "micros() wraps, signed",
    lambda: stamped(lambda k: str((2**31 - 10**6 + 2000 * k + 2**31) % 2**32 - 2**31), "time_us"),
    expect=WRAP,
)
case("millis() wraps", lambda: stamped(lambda k: str((2**32 - 1000 + 2 * k) % 2**32), "time_ms"), expect=WRAP)
case(
    "millis() wraps, signed",
    lambda: stamped(lambda k: str((2**31 - 1000 + 2 * k + 2**31) % 2**32 - 2**31), "time_ms"),
    expect=WRAP,
)
case(
    "micros() in seconds wraps",
    lambda: stamped(lambda k: f"{(2**32 - 10**6 + 2000 * k) % 2**32 / 1e6:.6f}", "time_s"),
    expect=WRAP,
)
case(
    "a 16-bit timer wraps",
    lambda: stamped(lambda k: str(2000 * k % 2**16), "time_us"),
    expect=Expect(note="wraps at 2^16"),
)
BACK = Expect(near=5e-3, restarts=1, note="goes back in 1 place, the first time by")
case(
    "clock set back",
    lambda: stamped(lambda k: f"{EPOCH_S + k * T - (0.25 if k > 700 else 0):.6f}", "time_s"),
    expect=BACK,
)
case(
    "clock set back by an hour",
    lambda: stamped(lambda k: f"{EPOCH_S + k * T - (3600 if k > 700 else 0):.6f}", "time_s"),
    expect=BACK,
)
case(
    "recorder restarted, time from 0 again",
    lambda: stamped(lambda k: f"{k % 700 * T:.6f}", "time_s"),
    expect=Expect(near=8e-3, restarts=2),
)
case(
    "clock set forward",
    lambda: stamped(lambda k: f"{k * T + (0.25 if k > 700 else 0):.6f}", "time_s"),
    expect=Expect(near=5e-3, restarts=1),
)
case(
    "two rows exchanged",
    lambda: (
        stamped(lambda k: f"{k * T:.6f}", "time_s")[:600]
        + [line for pair in [stamped(lambda k: f"{k * T:.6f}", "time_s")[600:602]] for line in reversed(pair)]
        + stamped(lambda k: f"{k * T:.6f}", "time_s")[602:]
    ),
    expect=Expect(note="exchanged"),
)
case(
    "one stamp of nonsense",
    lambda: with_cell(0, "77777.1"),
    expect=LEFT._replace(out=1, note="fits neither"),
)
EVEN = Expect(note="evenly sampled by them")
case("stamps of 5 ms", lambda: stamped(lambda k: str(2 * k // 5 * 5), "time_ms"), expect=EVEN)
case("two decimals", lambda: stamped(lambda k: f"{k * T:.2f}", "time_s"), expect=EVEN)
case(
    "stamps of 5 ms, told",
    lambda: stamped(lambda k: str(2 * k // 5 * 5), "time_ms"),
    period=T,
    expect=Expect(note="no lost row", near=1e-7),
)
case(
    "two decimals, told",
    lambda: stamped(lambda k: f"{k * T:.2f}", "time_s"),
    period=T,
    expect=Expect(near=1e-7),
)
case(
    "stamps that came late, told",
    lambda: stamped(lambda k: f"{k * T + 7e-4 * (k * 7919 % 13) / 13:.6f}", "time_s"),
    period=T,
)
case(
    "stamps of 16 ms from Windows, told",
    lambda: stamped(lambda k: f"{k * T // 0.015625 * 0.015625:.6f}", "time_s"),
    period=T,
)
case(
    "every row twice",
    lambda: [HEADER, *(row for row in columns().lines() for _ in range(2))],
    expect=Expect(out=1500, note="1500 rows left out that the file holds twice"),
)
case(
    "one row twice",
    lambda: between(columns().lines()[499]),
    expect=Expect(out=1, note="1 row left out that the file holds twice"),
)
case(
    "one stamp repeated", lambda: with_cell(0, columns().t[499]), expect=Expect(note="1 of the stamps repeat")
)
case(
    "a sample number",
    lambda: stamped(str, "sample"),
    time="sample",
    period=T,
    expect=Expect(note="numbers the samples"),
)
case(
    "a sample number that wraps",
    lambda: stamped(lambda k: str(k % 256), "seq"),
    time="seq",
    period=T,
    expect=Expect(note="wraps at 2^8"),
)
case(
    "no time column",
    lambda: ["position_rad,voltage_V", *(f"{q},{u}" for _, q, u in zip(*columns(), strict=True))],
    period=T,
)
case("a time column of no use", lambda: stamped(lambda _: "1.76723e+09", "time_s"), time="none", period=T)
case(
    "the day numbers of Excel",
    lambda: stamped(lambda k: f"{46083.42444 + k * T / 86400:.12f}", "time"),
    expect=Expect(near=1e-3),
)
case("all stamps the same, told", lambda: stamped(lambda _: "1.76723e+09", "time_s"), period=T)
case("stamps of 1 s, told", lambda: clocked(lambda t: iso(t + 0.3)[:19]), period=T)
case(
    "the newest row first",
    lambda: [HEADER, *reversed(columns().lines())],
    expect=Expect(note="reverse order"),
)


@pytest.mark.parametrize("name", CASES)
def test_the_same_motion_gives_the_same_figure(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)


def test_lost_rows_are_seen_through_coarse_stamps(tmp_path: Path) -> None:
    truth = motion()
    kept = np.random.default_rng(4).random(len(truth.time)) > 0.05
    kept[:20] = kept[-20:] = True
    rows = [
        row
        for row, keep in zip(stamped(lambda k: str(2 * k // 5 * 5), "time_ms")[1:], kept, strict=True)
        if keep
    ]
    path = tmp_path / "rec.csv"
    path.write_text("\n".join(["time_ms,position_rad,voltage_V", *rows]) + "\n")
    figures = replay(read_recording(path, ColumnOptions(period=T)), ReplaySettings(ku=5.4)).figures
    assert figures.lost_samples == np.count_nonzero(~kept)
    assert figures.velocity_error_rms_rad_s == pytest.approx(figure(), abs=0.02)
