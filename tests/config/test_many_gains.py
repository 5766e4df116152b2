"""The rule for gains over many rigs at once says what it says of each one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.gain_rules import gains_hold
from dcmp_hil.config.many_gains import gain_faults
from tests.helpers import bench

if TYPE_CHECKING:
    from dcmp_hil.config import Rig


def watched(*overrides: str) -> Rig:
    """Return a rig whose gains no rule has looked at yet."""
    rig = bench("supervisor.monitors=finite", *overrides)
    return rig.model_copy(update={"supervisor": rig.supervisor.model_copy(update={"monitors": "all"})})


def test_many_rigs_at_once_have_the_same_faults_as_each_of_them() -> None:
    rigs = [
        watched(f"controller.kp_1_s2={kp}", f"controller.kd_1_s={kd}", f"loop.delay_samples={delay}", *more)
        for kp, kd in ((4500, 120), (20000, 20), (4500, 600), (3000, 100))
        for delay in (0, 1)
        for more in ((), ("observer.mu0_rad_s=3",), ("amplifier.voltage_limit_V=none",))
    ]
    rigs += [watched("observer.kind=kalman"), bench("supervisor.monitors=finite")]
    expected = [gains_hold(rig) for rig in rigs]
    assert gain_faults(rigs) == expected
    assert 0 < sum(map(bool, expected)) < len(rigs)
