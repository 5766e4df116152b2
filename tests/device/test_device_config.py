"""The settings of a rig that concern its device."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.device.device_config import DeviceConfig
from dcmp_hil.errors import ConfigError
from tests.helpers import bench


def test_config_is_in_whole_units_and_signed_by_the_wiring() -> None:
    config = DeviceConfig.of(
        bench(
            "backend.kind=serial",
            "backend.port=/dev/null",
            "backend.node=3",
            "backend.watchdog_ms=15",
            "loop.rate_hz=500",
            "encoder.counts_per_rev=2000",
            "encoder.sign=-1",
            "encoder.zero=-7",
            "amplifier.sign=-1",
            "amplifier.voltage_limit_V=4.5",
            "amplifier.slew_V_s=250",
            "amplifier.supply_V=24",
        )
    )
    assert config == DeviceConfig(
        *(3, 2000, 2000, 4500, 250, 15, -math.tau / 2000, -1000.0, 24_000, -7, 20.0, 6.2832),
        *(6491, 2000, 3.0, 0.005, 0.005),
    )


@pytest.mark.parametrize(("limit", "counts"), [(2.0, 1428), (6366.2, 4_150_242), (0.01, 131)])
def test_a_speed_limit_in_counts_is_the_rigs_and_one_count_in_8_ms(limit: float, counts: int) -> None:
    config = DeviceConfig.of(
        bench(
            "backend.kind=sim-board",
            'supervisor.monitors="finite"',
            f"supervisor.velocity_limit_rad_s={limit}",
        )
    )
    assert config.speed_limit_counts_s == counts
    assert config.velocity_limit is None
    assert 0.0 <= limit + math.tau / 4096 / 8e-3 - counts * config.rad_per_count < config.rad_per_count


def test_config_of_a_rig_without_a_wire_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"backend\.kind"):
        DeviceConfig.of(bench())
