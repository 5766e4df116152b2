"""Fixtures: the devices that docs/protocol.md describes, and a host at each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.contract.firmware_device import Firmware
from tests.contract.protocol_host import Device, Host
from tests.contract.reference_device import ReferenceDevice

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture(params=[ReferenceDevice, Firmware])
def device(request: pytest.FixtureRequest) -> Callable[..., Device]:
    make: Callable[..., Device] = request.param
    return make


@pytest.fixture(params=["cobs", "slcan", "can"])
def host(request: pytest.FixtureRequest, device: Callable[..., Device]) -> Callable[..., Host]:
    def make(*, carrier: str = request.param, node: int = 0, first_tick: int = 0, **built: int) -> Host:
        made = device(carrier=carrier, node=node, first_tick=first_tick, **built)
        return Host(made, carrier, node=node, first_tick=first_tick)

    return make


@pytest.fixture
def ready(host: Callable[..., Host]) -> Host:
    """Booted, owned, in IDLE."""
    made = host()
    made.tick()
    assert made.hello() == "o"
    return made


@pytest.fixture
def running(host: Callable[..., Host]) -> Host:
    made = host()
    made.arm()
    return made
