"""Rules of rig.toml that only matter where frames travel."""

from __future__ import annotations

import pytest

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError

SERIAL = ("backend.kind=serial", "backend.port=/dev/null")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ((*SERIAL, "backend.baud=115200"), ["backend.baud", "411 periods", "280000 bit/s"]),
        (
            ("backend.kind=can", "backend.interface=slcan", "backend.baud=115200"),
            ["backend.baud", "440000 bit/s"],
        ),
        (("backend.kind=can", "backend.bitrate=250000"), ["backend.bitrate", "270000 bit/s"]),
        ((*SERIAL, "loop.rate_hz=3000"), ["loop.rate_hz", "333.333333 us", "whole microseconds"]),
        ((*SERIAL, "encoder.counts_per_rev=4095.5"), ["encoder.counts_per_rev", "whole counts"]),
        ((*SERIAL, "encoder.counts_per_rev=ideal"), ["backend.kind", "ideal"]),
        ((*SERIAL, "supervisor.start=immediate"), ["backend.kind", "immediate"]),
        (("backend.kind=sim-board", "loop.delay_samples=0"), ["backend.kind", "delay_samples"]),
        ((*SERIAL, "encoder.sign=0"), ["encoder.sign"]),
        ((*SERIAL, "backend.watchdog_ms=60"), ["backend.watchdog_ms", "at most 50"]),
    ],
)
def test_rig_is_refused_when_no_device_can_be_like_it(overrides: tuple[str, ...], words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        load_rig("bench-1khz", overrides)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    "overrides",
    [
        (*SERIAL, "loop.rate_hz=500"),
        ("backend.kind=can", "backend.bitrate=500000"),
        ("backend.kind=can", "backend.interface=virtual", "backend.bitrate=10000"),
        ("backend.kind=sim-board", "supervisor.start=immediate", "supervisor.monitors=finite"),
    ],
)
def test_rig_is_taken_when_the_device_can_do_it(overrides: tuple[str, ...]) -> None:
    assert load_rig("bench-1khz", overrides).backend.kind in overrides[0] + overrides[1]
