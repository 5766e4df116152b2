"""Changes of a recorded run: which of them a repetition makes, key by key."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.tunables import changed
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.recorded_changes import UnrepeatedChange, changes_in
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.values import ChangeData, Event, EventKind
from tests.helpers import bench
from tests.live.here import ChangedRun

if TYPE_CHECKING:
    from pathlib import Path

MU0, KP, KIND = "observer.mu0_rad_s", "controller.kp_1_s2", "controller.kind"


def change(t: float, **values: float | str) -> Event:
    keys = {name.replace("__", "."): value for name, value in values.items()}
    return Event(t, "INFO", EventKind.CHANGE, "", ChangeData(keys))


def test_pinned_keys_are_parted_from_the_rest_of_a_change() -> None:
    events = [
        change(1.0, observer__mu0_rad_s=70.0, controller__kp_1_s2=5000.0),
        change(2.0, observer__mu0_rad_s=60.0),
    ]
    found = changes_in(events, bench(), {MU0})
    assert [(t, dict(made.values)) for t, made in found.made] == [(1.0, {KP: 5000.0})]
    assert found.unrepeated == (
        UnrepeatedChange(1.0, {MU0: 70.0}, "pinned"),
        UnrepeatedChange(2.0, {MU0: 60.0}, "pinned"),
    )
    assert changes_in(events, bench()).unrepeated == ()


def test_keys_of_a_kind_that_is_pinned_are_refused_and_those_that_both_kinds_have_made() -> None:
    events = [change(1.0, controller__kind="pd", controller__kp_1_s2=3000.0, observer__L1_1_s=6.0)]
    own = bench("observer.kind=paper")
    found = changes_in(events, own, {KIND})
    assert [dict(made.values) for _, made in found.made] == [{KP: 3000.0}]
    pinned, refused = found.unrepeated
    assert (pinned.why, pinned.values) == ("pinned", {KIND: "pd"})
    assert (refused.why, refused.values) == ("refused", {"observer.L1_1_s": 6.0})
    assert refused.reason == 'observer.kind = "paper" does not let it change in a run.'


def test_what_a_whole_change_lacks_is_refused_and_later_ones_go_on_from_there() -> None:
    events = [
        change(1.0, controller__kp_1_s2=-5.0),
        change(2.0, controller__kp_1_s2=5000.0),
        change(3.0, a__b=1.0),
    ]
    found = changes_in(events, bench())
    assert [t for t, _ in found.made] == [2.0]
    assert [(one.t, one.why) for one in found.unrepeated] == [(1.0, "refused"), (3.0, "refused")]
    assert found.unrepeated[0].reason.startswith("controller.kp_1_s2: got -5")
    assert found.unrepeated[1].reason == "this rig does not let it change in a run."


def test_reach_is_not_judged_where_references_are_the_recorded_ones() -> None:
    weak = bench("model.ku_rad_s2_V=2.5")
    far = ["reference.amplitude_rad=1.5", "reference.rate_rad_s=4"]
    with pytest.raises(ConfigError):
        changed(weak, far)
    events = [change(1.0, reference__amplitude_rad=1.5, reference__rate_rad_s=4.0)]
    (made,) = changes_in(events, weak).made
    assert made[1].reference is not None


def test_a_change_that_fails_in_its_cycle_is_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = bench()
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    ChangedRun({500: (f"{MU0}=70",)}, duration=0.7, sinks=[sink]).run()
    recorded = read_run(tmp_path)
    assert compare(recorded, reexecute(recorded)).identical

    def fail(*_: Any) -> None:
        raise OverflowError

    monkeypatch.setattr(SuperTwisting, "retune", fail)
    (one,) = reexecute(recorded).unrepeated
    assert (one.values, one.why, one.reason) == ({MU0: 70.0}, "refused", "It could not be applied.")
    assert one.t == pytest.approx(0.5, abs=0.01)
