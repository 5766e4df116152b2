"""From a rig to its stages: classes of one's own, and what is said when they cannot be made."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil import run
from dcmp_hil.assembly import make_controller, make_friction, make_observer
from dcmp_hil.control.controllers import ControllerContext
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.paper import PaperObserver
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.checked import CheckedController, CheckedObserver
from tests.helpers import STEADY, bench, figures, known, named

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import Observer
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Estimate, Reference, Sample


class _Mine:
    """An observer and a controller of a user's own."""

    def __init__(self, setting: Any, gain: float = 1.0) -> None:
        self.setting, self.gain = setting, gain

    def update(self, *_: object) -> Any:
        return 0.0


def _observer(*overrides: str) -> Observer:
    return make_observer(bench(*overrides))


def test_observer_is_the_one_that_the_rig_names() -> None:
    assert isinstance(_observer(), SuperTwisting)
    assert isinstance(_observer("observer.kind=paper"), PaperObserver)


def test_friction_is_fed_forward_where_the_controller_asks_for_it() -> None:
    assert make_friction(bench()) is None
    assert make_friction(bench("controller.friction_feedforward=true")) is not None
    assert make_friction(bench(f"controller.kind={named(_Mine)}")) is None


def test_observer_of_ones_own_gets_its_setting_and_its_options() -> None:
    made = _observer(
        f"observer.kind={named(_Mine)}", "observer.options.gain=7.0", "model.f0_1_s=0.3", "loop.rate_hz=2000"
    )
    assert isinstance(made, CheckedObserver)
    assert made.inner.gain == 7.0
    assert made.inner.setting == ObserverContext(Model(f0=0.3), 0.0005, 4096.0)


def test_controller_of_ones_own_gets_its_setting_and_its_options() -> None:
    made = make_controller(bench(f"controller.kind={named(_Mine)}", "controller.options.gain=-1"))
    assert isinstance(made, CheckedController)
    assert made.inner.gain == -1
    assert made.inner.setting == ControllerContext(Model(), 0.001)


@pytest.mark.parametrize("stage", ["observer", "controller"])
def test_stage_of_ones_own_is_explained_when_it_cannot_be_made(stage: str) -> None:
    rig = bench(f"{stage}.kind={named(_Mine)}", f"{stage}.options.gian=7.0")
    with pytest.raises(ConfigError, match="gian") as caught:
        run(rig, duration=1.0, fast=True)
    assert f"[{stage}.options]" in str(caught.value)


@pytest.mark.parametrize("stage", ["observer", "controller", "backend"])
def test_stage_of_ones_own_is_explained_when_it_is_not_there(stage: str) -> None:
    rig = bench(f"{stage}.kind=nowhere_to_be_found:Class")
    with pytest.raises(ConfigError, match=rf"{stage}\.kind.*nowhere_to_be_found"):
        run(rig, duration=1.0, fast=True)


@pytest.mark.parametrize("stage", ["observer", "controller"])
def test_no_thread_is_left_behind_when_a_stage_cannot_be_made(stage: str) -> None:
    rig = bench(f"{stage}.kind=nowhere_to_be_found:Class")
    before = set(threading.enumerate())
    with pytest.raises(ConfigError):
        run(rig, duration=1.0)  # on the wall's clock telemetry has a thread
    assert {thread.name for thread in set(threading.enumerate()) - before} == set()


class _Device:
    """What a factory of a real device looks like: it does not say that it is simulated."""

    def __init__(self, rig: Rig, clock: Clock) -> None:
        raise AssertionError(f"{rig.name} on {clock}: it must not even be made")


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("encoder.counts_per_rev=ideal", "ideal"),
        ("amplifier.voltage_limit_V=none", "voltage_limit_V"),
        ("loop.delay_samples=0", "delay_samples"),
        ("supervisor.monitors=finite", "monitors"),
        ("supervisor.start=immediate", "start"),
    ],
)
def test_real_device_is_refused_a_rig_for_simulation_only(override: str, says: str) -> None:
    rig = bench(f"backend.kind={named(_Device)}", override)
    with pytest.raises(ConfigError, match=r"backend\.kind") as caught:
        run(rig, duration=1.0)
    assert says in str(caught.value)


def test_real_device_is_refused_virtual_time() -> None:
    with pytest.raises(ConfigError, match="fast"):
        run(bench(f"backend.kind={named(_Device)}"), duration=1.0, fast=True)


@pytest.mark.untraced
def test_loop_runs_on_an_observer_and_a_controller_of_ones_own() -> None:
    class Position:
        def __init__(self, setting: ObserverContext) -> None:
            self._inner = SuperTwisting(setting)

        def update(self, sample: Sample) -> Estimate:
            return self._inner.update(sample)

    class Proportional:
        def __init__(self, setting: ControllerContext, kp: float, kd: float) -> None:
            self._ku, self._kp, self._kd = setting.model.ku, kp, kd

        def update(self, reference: Reference, estimate: Estimate) -> float:
            u = (
                reference.acceleration
                + self._kp * (reference.position - estimate.position)
                + self._kd * (reference.velocity - estimate.velocity)
                + 0.1 * estimate.velocity
                - estimate.disturbance
            )
            return u / self._ku

    result = run(
        bench(
            *STEADY,
            f"observer.kind={named(Position)}",
            f"controller.kind={named(Proportional)}",
            "controller.options={kp=4000.0, kd=130.0}",
        ),
        duration=30.13,
        fast=True,
        window_from=5.0,
    )
    own, shipped = known(result.summary.tracking_rms_rad), known(figures().tracking_rms_rad)
    assert own == pytest.approx(shipped, rel=0.3)  # the same law: only rounding at each count differs
