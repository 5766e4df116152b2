"""Orderly ends on the firmware: the voltage is led to 0 V, the device disarmed without a fault to keep."""

from __future__ import annotations

import numpy as np
import pytest

from dcmp_hil import load_rig
from dcmp_hil.errors import DeadlineError, TripError
from dcmp_hil.session import Session
from dcmp_hil.wire.messages import State
from sim_backend.board.board import Board
from sim_backend.faults.fault_spec import FaultSpec
from sim_backend.faults.plan import FaultPlan
from tests.faults.oracle import Oracle

pytestmark = pytest.mark.untraced
_RIG = ("backend.kind=sim-board", "encoder.zero=0", "reference.soft_start_s=0.5")


def _run(*overrides: str, fault: str = "") -> tuple[Session, Board, Exception]:
    """Run until the supervisor ends it; return what is left."""
    rig = load_rig("bench-1khz", (*_RIG, *overrides))
    board, oracle = Board(rig, carrier="cobs"), Oracle()
    plan = FaultPlan([FaultSpec.of(fault)] if fault else [])
    session = Session(rig, duration=6.0, fast=True, faults=plan.on(rig, oracle, board))
    with pytest.raises((TripError, DeadlineError)) as caught:
        session.run()
    assert not oracle.violations
    return session, board, caught.value


@pytest.mark.parametrize(
    ("overrides", "fault", "reason"),
    [
        (("amplifier.voltage_limit_V=4", "sim.plant.gravity_rad_s2=40"), "", "saturation"),
        (("reference.rate_rad_s=4", "supervisor.error_limit_rad=0.001"), "", "tracking"),
        (("timing.overrun=stop",), "host.slow:ms=2,at=1.5s", "late"),
    ],
)
def test_orderly_end_takes_fifty_milliseconds_and_leaves_the_device_idle(
    overrides: tuple[str, ...], fault: str, reason: str
) -> None:
    session, board, error = _run(*overrides, fault=fault)
    assert getattr(error, "reason", "late") == reason
    assert board.state == State.IDLE
    assert board.applied_mV == 0
    assert not board.enable
    result = session.result()
    phases = {event.text: event.t for event in result.events if event.kind == "phase"}
    assert phases["tripped"] - phases["stopping"] == pytest.approx(0.05, abs=0.004)
    t, sent = result.columns["time_s"], np.abs(result.columns["voltage_sent_V"])
    ramp = sent[t > phases["stopping"]]
    allowed = sent[t <= phases["stopping"]][-1] * (
        1.0 - (t[t > phases["stopping"]] - phases["stopping"]) / 0.05
    )
    assert (ramp <= np.maximum(allowed, 0.0) + 1e-9).all()
    assert ramp[-1] == 0.0


def test_trip_without_a_ramp_is_a_fault_of_the_device() -> None:
    _, board, error = _run(fault="plant.power:at=1.5s")
    assert getattr(error, "reason", "") == "power"
    assert board.state == State.FAULT
