"""Plans: text, bounds, times, random numbers, and where they may be used."""

from __future__ import annotations

import math
import pickle
import re
import secrets
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.errors import ConfigError, TripError
from dcmp_hil.ipc.mailbox import APPLIED
from dcmp_hil.live.tunables import changed
from dcmp_hil.session import Session
from sim_backend.faults.fault_model import Number
from sim_backend.faults.fault_spec import KINDS, FaultSpec
from sim_backend.faults.host import InjectedError
from sim_backend.faults.parser import WrongFaultError
from sim_backend.faults.plan import FaultPlan, inject
from tests.faults.matrix import judge, outcome_of
from tests.faults.rows import SILENT, Row
from tests.helpers import bench
from tests.live.here import Here

if TYPE_CHECKING:
    from dcmp_hil.result import Result
    from sim_backend.faults.fault_model import FaultContext

BOARD = "backend.kind=sim-board"
QUICK = "supervisor.start=immediate"


@pytest.fixture(autouse=True)
def same_host(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every host choose the same session."""
    monkeypatch.setattr(secrets, "randbelow", lambda below: below // 2)


def quick(*faults: FaultSpec, backend: str = BOARD, duration: float = 0.2, seed: int = 1) -> Result:
    return run(bench(backend, QUICK, f"sim.seed={seed}"), duration=duration, fast=True, faults=faults)


def lost_at(result: Result) -> list[int]:
    """Return the ticks whose samples never came."""
    ticks = np.round(1e3 * result.columns["time_s"]).astype(int)
    return sorted(set(range(ticks[0], ticks[-1])) - set(ticks.tolist()))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_made_with_its_defaults(kind: str) -> None:
    assert FaultSpec.of(kind).params.keys() == KINDS[kind].params.keys()


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_has_bounds_around_its_default(kind: str) -> None:
    for name, param in KINDS[kind].params.items():
        if isinstance(param, Number):
            assert param.low <= param.default <= param.high
            for beyond in (math.nextafter(param.high, math.inf) * 2 + 1, math.nan):
                with pytest.raises(WrongFaultError, match=name):
                    FaultSpec(kind, **{name: beyond})


def test_text_says_what_the_constructor_says() -> None:
    read = FaultSpec.of("wire.drop: p=20%, burst=5, at=3s, for=200ms, way=up")
    made = FaultSpec("wire.drop", at=3.0, for_=0.2, p=0.2, burst=5, way="up")
    assert (read.kind, read.at, read.params) == (made.kind, made.at, made.params)
    assert read.for_ == pytest.approx(made.for_)
    assert FaultSpec.of("wire.hold:ms=0.2s").params["ms"] == 200.0
    assert FaultSpec.of("plant.shove:rad_s2=1e2rad/s2").params["rad_s2"] == 100.0
    assert FaultSpec.of("wire.garble:at=boot").at == "boot"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("wire.drp", 'Did you mean "wire.drop"?'),
        ("xyzzy", "Known: wire.drop"),
        ("wire.drop:q=1", '"q" is no parameter. Known: p, burst'),
        ("wire.drop:burts=1", 'Did you mean "burst"?'),
        ("wire.drop:p=2", "a number, at least 0 and at most 1."),
        ("wire.drop:p=nan", "a number, at least 0 and at most 1."),
        ("wire.drop:p", "a number, at least 0 and at most 1."),
        ("wire.drop:p=0.1V", "a number, at least 0 and at most 1."),
        ("wire.drop:way=left", "both or up or down"),
        ("wire.delay:ms=3V", "a number in ms, at least 1 and at most 500."),
        ("wire.drop:at=soon", "a time such as 3s"),
        ("wire.drop:at=-1", "a time such as 3s"),
        ("wire.drop:for=boot", "a time such as 3s"),
    ],
)
def test_wrong_text_is_refused_with_a_remedy(text: str, says: str) -> None:
    with pytest.raises(ConfigError, match=r"^--fault") as caught:
        inject(bench(BOARD), [text], "--fault")
    assert says in str(caught.value)


def test_unknown_parameter_of_the_constructor_is_answered_with_the_known_ones() -> None:
    with pytest.raises(WrongFaultError, match=re.escape('"burts" is no parameter. Did you mean "burst"?')):
        FaultSpec("wire.drop", burts=1)
    with pytest.raises(WrongFaultError, match=re.escape('"xyzzy" is no parameter. Known: p, burst')):
        FaultSpec("wire.drop", xyzzy=1)


def test_every_wrong_fault_is_named_at_once() -> None:
    with pytest.raises(ConfigError) as caught:
        inject(bench(BOARD), ["wire.drp", "wire.drop:q=1,p=2", "plant.power"])
    assert len(caught.value.faults) == 3


def test_faults_are_refused_where_they_cannot_happen() -> None:
    with pytest.raises(ConfigError, match="has no wire") as caught:
        inject(bench(), ["wire.drop", "firmware.reset", "plant.power"])
    assert len(caught.value.faults) == 2
    real = bench("backend.kind=serial", "backend.port=/dev/ttyACM0")
    with pytest.raises(ConfigError, match="faults are for the simulated rigs"):
        inject(real, ["plant.power"])
    with pytest.raises(ConfigError, match="faults are for the simulated rigs"):
        inject(bench("backend.kind=tests.helpers:LosesSamples"), ["plant.power"])


def test_faults_of_the_host_act_on_an_observer_of_ones_own() -> None:
    own = bench("observer.kind=tests.helpers:IgnoresGaps")
    with pytest.raises(InjectedError, match="injected: observer"):
        run(own, duration=0.2, fast=True, faults=["host.raise:where=observer,at=0.1s"])


def test_a_run_takes_texts_and_objects_together() -> None:
    push = FaultSpec("plant.shove", at=50, for_=10, rad_s2=100.0)
    faulty = run(
        bench(BOARD, QUICK), duration=0.2, fast=True, faults=["wire.drop:p=1,at=100ms,for=2ms", push]
    )
    assert lost_at(faulty) == [100, 101]
    pushed, usual = (result.columns["position_true_rad"] for result in (faulty, quick()))
    assert pushed[60] != usual[60]


@pytest.mark.parametrize("backend", ["backend.kind=sim", BOARD])
def test_a_run_with_faults_of_the_host_can_be_changed_while_it_goes_on(backend: str) -> None:
    rig, control = bench(backend, QUICK), Here()
    faults = ["host.slow:ms=0.1,at=0.1s", "host.spoil:where=demand,at=0.4s"]
    session = Session(rig, duration=0.5, fast=True, control=control, faults=faults)
    number = control.mailbox.put(changed(rig, ["controller.kp_1_s2=4100", "observer.M_rad_s3=20"])[1])
    with pytest.raises(TripError, match="asked for nan"):
        session.run()
    answer = control.mailbox.answer(number)
    assert answer is not None
    assert answer.what == APPLIED


def test_what_is_no_fault_is_refused_in_words() -> None:
    with pytest.raises(ConfigError, match="faults: got 42; expected a text") as caught:
        run(bench(BOARD), duration=0.1, fast=True, faults=[42, "wire.drp"])
    assert len(caught.value.faults) == 2
    with pytest.raises(ConfigError, match=r'Did you mean "wire\.drop"'):
        run(bench(BOARD), duration=0.1, fast=True, faults="wire.drp")


def test_a_rig_is_the_same_object_with_any_fault() -> None:
    rig = bench(BOARD, QUICK)
    before = pickle.dumps(rig)
    session = Session(rig, duration=0.1, fast=True, faults=["host.slow", "wire.drop"])
    session.run()
    assert session.rig is rig
    assert pickle.dumps(rig) == before


def test_times_are_ticks_or_seconds_or_a_predicate() -> None:
    def at_fifty(moment: FaultContext) -> bool:
        return moment.tick >= 50 and moment.truth.position < 1.0

    for at in (50, 0.05, at_fifty):
        found = lost_at(quick(FaultSpec("wire.drop", at=at, for_=4, p=1, way="down")))
        assert found == [50, 51, 52, 53], at


@pytest.mark.parametrize("text", ["wire.drop:p=0.2", "wire.flip:p=0.2,way=down", "wire.reorder:p=0.3"])
def test_a_seed_repeats_itself_to_the_bit_and_another_does_not(text: str) -> None:
    def lost(seed: int) -> list[int]:
        return lost_at(quick(FaultSpec.of(text), seed=seed, duration=0.3))

    assert lost(3) == lost(3) != lost(4)


def test_one_fault_more_leaves_the_random_numbers_of_the_others_alone() -> None:
    drop = FaultSpec("wire.drop", p=0.1, way="down")
    assert lost_at(quick(drop)) == lost_at(quick(drop, FaultSpec("plant.enc_noise")))


def test_a_whole_verdict_repeats_itself() -> None:
    row = Row("wire.flip:p=0.1,bits=3", settled_mrad=None)
    assert str(judge(row, 5)) == str(judge(row, 5))


def test_a_plan_can_be_used_again() -> None:
    plan = FaultPlan([FaultSpec("wire.drop", p=0.2, way="down")])
    rig = bench(BOARD, QUICK)
    sessions = [Session(rig, duration=0.2, fast=True, faults=plan.on(rig)) for _ in range(2)]
    for session in sessions:
        session.run()
    first, second = (session.result() for session in sessions)
    assert lost_at(first) == lost_at(second) != []


@pytest.mark.parametrize("carrier", ["cobs", "slcan", "can"])
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.startswith("wire.")])
def test_wire_faults_do_something_on_every_carrier(carrier: str, kind: str) -> None:
    if (kind, carrier) == ("wire.garbage", "can"):
        pytest.skip("what is between the frames of a CAN bus is its controller's business")
    rig = bench(BOARD, QUICK, f"backend.carrier={carrier}")
    healthy = run(rig, duration=0.2, fast=True)
    likely = {"p": 0.3} if "p" in KINDS[kind].params else {}
    session = Session(rig, duration=0.2, fast=True, faults=[FaultSpec(kind, at=50, for_=50, **likely)])
    outcome = outcome_of(session)
    assert outcome in {"completed", *SILENT, "CORRUPT_LINK", "LINK_DOWN"}
    result = session.result()
    applied, usual = (each.columns["voltage_applied_V"] for each in (result, healthy))
    same = outcome == "completed" and result.link == healthy.link and np.array_equal(applied, usual)
    assert not same


def test_every_healthy_run_is_the_same_with_an_empty_plan() -> None:
    plain = run(bench(BOARD), duration=1.0, fast=True)
    session = Session(bench(BOARD), duration=1.0, fast=True, faults=FaultPlan().on(bench(BOARD)))
    session.run()
    planned = session.result()
    for name, column in plain.columns.items():
        np.testing.assert_array_equal(column, planned.columns[name], err_msg=name)


def test_truth_counts_a_push_as_disturbance() -> None:
    pushed = quick(FaultSpec("plant.shove", rad_s2=30, way="up", at=50, for_=100), backend="backend.kind=sim")
    still = quick(backend="backend.kind=sim")
    at = slice(60, 140)
    gone = pushed.columns["disturbance_true_rad_s2"][at] - still.columns["disturbance_true_rad_s2"][at]
    assert np.mean(gone) == pytest.approx(30.0, abs=3.0)
