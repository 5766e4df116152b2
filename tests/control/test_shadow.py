"""Observers beside the loop: the same numbers as in it, and no way for them to disturb it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil.assembly import make_controller, make_shadows
from dcmp_hil.config import change_rig
from dcmp_hil.config.rig import KINDS
from dcmp_hil.control.shadow import Shadow, Shadows
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.values import Cycle, Estimate, Reference, Sample, Timing
from tests.helpers import T, bench, cycle, named
from tests.recording.test_reexecute import record

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.recording.reader import RecordedRun

OTHERS = [kind for kind in KINDS["observer"] if kind not in {"super_twisting", "custom"}]


def cycles(recorded: RecordedRun) -> list[Cycle]:
    """Return what telemetry was given of a run."""
    return [
        Cycle(
            Sample(row[0], row[1], row[2], int(row[3])),
            Estimate(*row[4:7]),
            Reference(*row[7:10]),
            row[10],
            row[11],
            Timing(*row[12:15]),
        )
        for row in recorded.rows.tolist()
    ]


@pytest.mark.parametrize("position", ["estimated", "measured"])
@pytest.mark.parametrize("kind", ["super_twisting", *OTHERS])
def test_a_shadow_has_the_bits_that_the_loop_has_of_the_same_kind(
    tmp_path: Path, kind: str, position: str
) -> None:
    overrides = (f"observer.kind={kind}", f"controller.position={position}", "supervisor.start=immediate")
    recorded = read_run(record(tmp_path, *overrides, duration=0.4))
    again = reexecute(recorded)
    other = "kalman" if kind != "kalman" else "super_twisting"
    rig = change_rig(recorded.rig, [f"observer.kind={other}"])
    shadows = make_shadows(rig, [kind], make_controller(rig))
    assert shadows.names == (
        f"position_{kind}_rad",
        f"velocity_{kind}_rad_s",
        f"disturbance_{kind}_rad_s2",
        f"voltage_demand_{kind}_V",
    )
    found = np.array([shadows.values(one) for one in cycles(recorded)])
    assert len(found) == 400
    assert found[:, :3].tobytes() == again.estimate.tobytes()
    assert found[:, 3].tobytes() == again.demand.tobytes()
    assert shadows.events() == []


def test_the_present_gains_of_the_loop_are_those_of_its_shadows(tmp_path: Path) -> None:
    recorded = read_run(record(tmp_path, duration=0.5))
    controller = make_controller(recorded.rig)
    shadows = make_shadows(recorded.rig, ["kalman"], controller)
    controller.gains = controller.gains._replace(kp=0.0, kd=0.0, compensation=0.0)  # type: ignore[attr-defined]
    last = [shadows.values(one) for one in cycles(recorded)][-1]
    reference, f0, ku = cycles(recorded)[-1].reference, 0.1, 5.4
    assert last[3] == pytest.approx((reference.acceleration + f0 * last[1]) / ku, abs=2e-3)  # x2 is ahead


class _Broken:
    """An observer that fails in its fourth cycle."""

    def __init__(self, found: object) -> None:
        self.calls, self.found = 0, found

    def update(self, sample: Sample) -> Any:
        self.calls += 1
        if self.calls < 4:
            return Estimate(sample.position, 0.0, 0.0)
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


class _Still:
    """A predictor and a controller that do nothing."""

    def ahead(self, sample: Sample, estimate: Estimate, reference: Reference) -> Estimate:  # noqa: ARG002
        return estimate

    def sent(self, voltage: float) -> None:
        self.voltage = voltage

    def update(self, reference: Reference, estimate: Estimate) -> float:
        return reference.position - estimate.position


@pytest.mark.parametrize(
    ("found", "why"),
    [
        (ZeroDivisionError("by a sign"), "it raised ZeroDivisionError: by a sign"),
        (Estimate(0.0, math.nan, 0.0), "its estimate is not finite"),
        (Estimate(0.0, 0.0, math.inf), "its estimate is not finite"),
        (None, "it raised AttributeError"),
    ],
    ids=str,
)
def test_a_shadow_that_fails_has_no_numbers_from_then_on_and_says_why_once(found: object, why: str) -> None:
    broken, sound = _Broken(found), _Still()
    shadows = Shadows(
        [
            Shadow("broken", broken, _Still(), sound),
            Shadow("sound", _Broken(Estimate(1.0, 2.0, 3.0)), _Still()),
        ]
    )
    assert len(shadows.names) == 4 + 3  # without a controller there is no demand
    rows = [shadows.values(cycle(k * T, position=0.5, sent=1.0)) for k in range(8)]
    assert rows[2] == (0.5, 0.0, 0.0, -0.5, 0.5, 0.0, 0.0)
    for row in rows[3:]:
        assert all(math.isnan(value) for value in row[:4])
        assert row[4:] == (1.0, 2.0, 3.0)
    assert broken.calls == 4
    (event,) = shadows.events()
    assert event.t == pytest.approx(3 * T)
    assert event.level == "WARN"
    assert event.text.startswith(f"broken, which runs beside the loop only, gave up: {why}")
    assert shadows.events() == []


def test_a_class_of_ones_own_runs_beside_the_loop_and_is_checked(tmp_path: Path) -> None:
    class Mine:
        def __init__(self, context: object) -> None:  # noqa: ARG002 - a rig's observer is made with it
            self.calls = 0

        def update(self, sample: Sample) -> Any:
            self.calls += 1
            return Estimate(sample.position, 0.0, 0.0) if self.calls < 3 else "nothing"

    recorded = read_run(record(tmp_path, duration=0.1))
    kind = named(Mine)
    shadows = make_shadows(recorded.rig, [kind], make_controller(recorded.rig))
    name = "own_" + kind.replace(".", "_").replace(":", "_")
    assert shadows.names[1] == f"velocity_{name}_rad_s"
    rows = [shadows.values(one) for one in cycles(recorded)]
    assert math.isfinite(rows[1][0])
    assert math.isnan(rows[2][0])
    (event,) = shadows.events()
    assert "expected Estimate(position, velocity, disturbance), three numbers" in event.text


def test_a_controller_of_ones_own_is_asked_by_the_loop_alone() -> None:
    class Own:
        def __init__(self, context: object) -> None:
            pass

        def update(self, reference: Reference, estimate: Estimate) -> float:  # noqa: ARG002
            return 0.0

    rig = bench(f"controller.kind={named(Own)}")
    shadows = make_shadows(rig, ["kalman", "derivative"], make_controller(rig))
    assert [name for name in shadows.names if "voltage" in name] == []
    assert len(shadows.names) == 6


@pytest.mark.parametrize("kind", [kind for kind in KINDS["controller"] if kind != "custom"])
def test_a_controller_of_the_package_keeps_no_state_so_that_shadows_may_share_it(kind: str) -> None:
    controller = make_controller(bench(f"controller.kind={kind}"))
    first = Reference(0.3, 0.2, 0.1), Estimate(0.1, -0.2, 4.0)
    asked = controller.update(*first)
    for k in range(5):
        controller.update(Reference(0.1 * k, 1.0, -2.0), Estimate(-k, 0.3 * k, 1.0))
    assert controller.update(*first) == asked


def test_the_observer_that_closes_the_loop_has_no_shadow() -> None:
    rig = bench("observer.kind=kalman")
    shadows = make_shadows(rig, ["kalman", "super_twisting"], make_controller(rig))
    assert {name.split("_")[1] for name in shadows.names} == {"super", "demand"}


@pytest.mark.parametrize("kind", ["friction_kalman", "kalman"])
def test_an_observer_that_the_rig_is_none_for_is_refused_in_words(kind: str) -> None:
    rig = bench("encoder.counts_per_rev=ideal")
    with pytest.raises(ConfigError, match=r"(one|encoder) is ideal") as refused:
        make_shadows(rig, [kind], make_controller(rig))
    assert str(refused.value).startswith(f"--compare {kind}: ")
