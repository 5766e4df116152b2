"""What the tests of the encoder share: limits, and a tick of a device that runs."""

from typing import Any

from tests.firmware.bench import Bench, Core

RUN = 3
ORIGIN = 16
OVER_SPEED, OVER_TRAVEL, ENCODER_JUMP = 5, 6, 7


def speed_limits(core: Core, built: int) -> Any:
    return core.new("struct dcmp_speed_limits *", (built, built))


def tick_in_run(bench: Bench, step: int = 0) -> int:
    """Turn, with a host that goes on driving; return the latched code."""
    bench.counts += step
    bench.drive(100)
    bench.tick()
    return bench.fault[0]
