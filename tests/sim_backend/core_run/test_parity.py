"""A run in the core has the bits of the loop of the host: rows, figures, events, trip."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig, simulate
from dcmp_hil.platform.stop_request import StopRequest
from sim_backend.core_run import cycles
from tests.sim_backend.core_run.runs import both, differences, drawn, ride

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

_RIGS, _DURATION_S = 50, 1.2
_LED = ("reference.amplitude_rad=8", "reference.rate_rad_s=3")
"""A reference beyond the limits: the arm is led, and events tell of it."""
_TRIPS: dict[str, tuple[tuple[str, ...], str]] = {
    "travel": (
        (
            *("supervisor.position_limit_rad=0.5", "supervisor.probe=off", "reference.kind=hold"),
            *("sim.plant.eta_rad_s2=12", "amplifier.voltage_limit_V=1"),
        ),
        "travel",
    ),
    "speed": (
        ("supervisor.disturbance_limit_rad_s2=1e6", "sim.plant.eta_rad_s2=140", "supervisor.start=immediate"),
        "speed",
    ),
    "stuck": (("sim.plant.ku_rad_s2_V=0.05", "supervisor.start=immediate"), "stuck"),
    "disturbance": (("sim.plant.eta_rad_s2=45", "supervisor.probe=off"), "disturbance"),
    "tracking": (
        ("supervisor.error_limit_rad=0.02", "controller.kp_1_s2=30", "controller.kind=pd"),
        "tracking",
    ),
    "saturation": (
        ("amplifier.voltage_limit_V=2", "reference.kind=hold", "reference.position_rad=1.5"),
        "saturation",
    ),
    "chatter": (
        (
            *("sim.encoder_noise_counts=9", "supervisor.disturbance_limit_rad_s2=5000"),
            "supervisor.start=immediate",
        ),
        "chatter",
    ),
    "jump": (("sim.encoder_noise_counts=300", "supervisor.start=immediate"), "jump"),
    "moving": (("sim.plant.eta_rad_s2=30",), "moving"),
    "no answer": (("sim.plant.ku_rad_s2_V=0.1",), "power"),
    "gain": (("sim.plant.ku_rad_s2_V=30",), "gain"),
    "slew": (("amplifier.slew_V_s=2", "sim.plant.f1_rad_s2=4"), "slew"),
}
"""Overrides of runs that trip, and the reason."""
_WHOLE: dict[str, tuple[str, ...]] = {
    "as shipped": (),
    "lowered before it begins": ("run.duration_s=0.2", "run.end=lower"),
    "lowered": ("run.end=lower", "controller.friction_feedforward=true", "sim.lost_samples=0.1"),
    "friction filter": ("observer.kind=friction_kalman", "sim.lost_samples=0.05"),
    "10 kHz": ("loop.rate_hz=10000", "reference.kind=trapezoid", "run.duration_s=0.9"),
    "ideal encoder": ("encoder.counts_per_rev=ideal", "loop.delay_samples=0"),
}


def test_random_rigs_run_alike() -> None:
    ends: Counter[bool] = Counter()
    for seed in range(_RIGS):
        loop, core = both(drawn(seed), _DURATION_S)
        assert differences(loop, core) == [], f"seed {seed}"
        ends[core.error is not None] += 1
    assert min(ends[False], ends[True]) > _RIGS // 5


@pytest.mark.parametrize("name", _WHOLE)
def test_runs_to_the_end_are_alike(name: str) -> None:
    rig = load_rig("bench-1khz", ["run.duration_s=2.5", *_WHOLE[name]])
    loop, core = both(rig, rig.run.duration_s)
    assert core.error is None
    assert differences(loop, core) == []


@pytest.mark.parametrize("name", _TRIPS)
def test_trips_are_alike(name: str) -> None:
    overrides, reason = _TRIPS[name]
    loop, core = both(load_rig("bench-1khz", overrides), 4.0)
    assert getattr(core.error, "reason", None) == reason
    assert differences(loop, core) == []


def test_reference_of_a_file_is_alike(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time_s,position_rad\n0,0\n0.5,0.6\n0.8,0.2\n", encoding="utf-8")
    loop, core = both(load_rig("bench-1khz", ["reference.kind=csv", f"reference.file={file}"]), 2.0)
    assert differences(loop, core) == []


def test_a_small_log_and_few_references_at_once_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cycles, "_LOG_EVENTS", 17)
    monkeypatch.setattr(cycles, "_TICKS_AT_ONCE", 50)
    rig = load_rig("bench-1khz", [*_LED, "run.end=lower"])
    loop, core = both(rig, 4.0)
    assert sum(event.kind == "limit" for event in core.result.events) > 2
    assert differences(loop, core) == []


class _Tape:
    """A sink that keeps what it gets in its order, and asks for the end in its second block."""

    def __init__(self, stop: StopRequest | None = None) -> None:
        self.taken: list[str] = []
        self._stop, self._blocks = stop, 0

    def block(self, block: Block) -> None:
        self.taken.append(repr(block.rows.tolist()))
        self._blocks += 1
        if self._stop and self._blocks == 2:
            self._stop.requested = True

    def event(self, event: Event) -> None:
        if event.kind != "host":
            self.taken.append(repr(event))

    def close(self) -> None:
        self.taken.append("closed")


@pytest.mark.parametrize("end", ["release", "lower"])
def test_sinks_get_the_same_blocks_and_events_in_the_same_order(end: str) -> None:
    rig = load_rig("bench-1khz", [f"run.end={end}", *_LED])
    loop, core = _Tape(), _Tape()
    simulate(rig, 2.3, sinks=[loop], plain=True)
    assert simulate(rig, 2.3, sinks=[core]).engine == "core"
    assert len(loop.taken) > 8
    assert loop.taken == core.taken


@pytest.mark.parametrize("overrides", [(), ("sim.plant.ku_rad_s2_V=0.05", "supervisor.start=immediate")])
def test_a_sink_that_asks_for_the_end_ends_both_at_the_same_cycle(overrides: tuple[str, ...]) -> None:
    rides = []
    for plain in (True, False):
        stop = StopRequest()
        rides.append(
            ride(load_rig("bench-1khz", overrides), 9.0, plain=plain, sinks=[_Tape(stop)], stop=stop)
        )
    loop, core = rides
    assert core.result.engine == "core"
    assert core.result.periods <= 2000
    assert differences(loop, core) == []
