"""A cycle in C: the bits of the loop with its Python stages, sample by sample, to the end of the run."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import loop
from dcmp_hil.assembly import assemble
from dcmp_hil.errors import TripError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.safety.supervisor import Phase, Supervisor
from dcmp_hil.values import Cycle, Event, LimitData, PhaseData, ProbeData, Reference, Sample
from sim_backend.core_run.library import load
from sim_backend.core_run.parameters import parameters_of
from tests.firmware.causes import CAUSES, FORMATS
from tests.firmware.law import Array, Law, same_bits
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.telemetry.block import Block
    from tests.firmware.bench import Core

WIDTH = 39
NUMBERS = 1  # of enum dcmp_cause
UNUSED = (7.0, -7.0)  # rad/s, where nothing is fed forward
PHASES = list(Phase)
LIMITS = ["", "reference", "velocity", "acceleration", "way", "voltage", "slew"]


class Seen:
    """The stages around the law, which note what goes through, and change what a test asks for."""

    def __init__(self, stages: loop.LoopStages, changed: Mapping[int, float], none: float) -> None:
        self._backend, self._trajectory, self._changed = stages.backend, stages.trajectory, changed
        self._none = none  # s, from which on the reference is no number
        self.rows: list[list[float]] = []
        self.cycles: list[Cycle] = []
        self.begun: list[float] = []
        self._reads, self._velocities = 0, list[float]()
        self._reference = Reference(0.0, 0.0, 0.0)

    def read(self) -> Sample:
        sample = self._backend.read()
        self._reads += 1
        moved = self._changed.get(self._reads, 0.0)
        sample = sample._replace(position=sample.position + moved)
        self.rows.append([sample.t, sample.position, sample.voltage, *[0.0] * 5])
        return sample

    def write(self, voltage: float) -> None:
        self._backend.write(voltage)

    def hold(self, position: float) -> None:
        self._trajectory.hold(position)

    def begin(self, t: float, position: float) -> None:
        self.begun.append(t)
        self._trajectory.begin(t, position)

    def lower(self, t: float) -> None:
        raise NotImplementedError

    def at(self, t: float) -> Reference:
        self._reference = self._trajectory.at(t)
        if t >= self._none:
            self._reference = Reference(math.nan, 0.0, 0.0)
        return self._reference

    def velocity(self, t: float) -> float:
        self._velocities.append(self._trajectory.velocity(t))
        return self._velocities[-1]

    def record(self, cycle: Cycle) -> None:
        self.cycles.append(cycle)
        self.rows[-1][3:] = [*(self._velocities or UNUSED), *self._reference]
        self._velocities.clear()


class Ride:
    """A run of the Python loop: what C is given, and what it should find."""

    def __init__(
        self,
        *settings: str,
        duration: float = 1.3,
        changed: Mapping[int, float] | None = None,
        none: float = math.inf,
    ) -> None:
        rig = bench(*settings)
        self.period = rig.period
        self.events: list[Event] = []
        stages, recorder = assemble(rig, SimulatedClock(), [self], in_line=True)
        self.parameters = parameters_of(rig, stages, load())
        assert isinstance(stages.supervisor, Supervisor)
        self.supervisor, self.filter = stages.supervisor, stages.outlier_filter
        self.seen = seen = Seen(stages, changed or {}, none)
        own: dict[str, Any] = {"backend": seen, "trajectory": seen, "telemetry": seen}
        self.trip: TripError | None = None
        with stages.backend:
            try:
                loop.run(dataclasses.replace(stages, **own), duration, StopRequest())
            except TripError as trip:
                self.trip = trip
        recorder.close()

    def block(self, block: Block) -> None:
        """Take rows, as a sink of the run."""

    def event(self, event: Event) -> None:
        self.events.append(event)

    def close(self) -> None:
        """Have nothing to close."""

    @property
    def rows(self) -> Array:
        rows = np.array(self.seen.rows)
        rows[:, 0] = np.round(rows[:, 0] / self.period)
        return rows

    def in_c(self, core: Core, kind: str = "") -> Array:
        plain = np.frombuffer(self.parameters.tobytes(), float)
        return Law(core, kind)("cycle", plain, self.rows, width=WIDTH)

    def check(self, core: Core) -> None:
        got = self.in_c(core)
        kept = got[got[:, 0] == 0.0]
        assert len(got) - len(kept) == self.filter.count
        cycles = self.seen.cycles
        wanted = np.array([(*c.estimate, *c.reference, c.demand, c.voltage) for c in cycles])
        assert same_bits(kept[:, 1:9], wanted)
        t = [cycle.sample.t for cycle in cycles]
        assert [t[k] for k in np.flatnonzero(kept[:, 9])] == self.seen.begun
        assert _told(kept, t) == [(one.t, *_code(one)) for one in self.events]
        began = self.seen.begun
        place = t.index(began[0]) if began else 0
        assert kept[-1, 36] == cycles[place].estimate.position
        assert tuple(kept[-1, 37:]) == (round(began[0] / self.period) if began else 0.0, float(bool(began)))
        gain = self.supervisor.motor_gain
        assert tuple(kept[-1, 34:36]) == ((gain.gain, gain.deviation) if gain else (0.0, 0.0))
        self._check_end(kept[-1].tolist())

    def _check_end(self, last: list[float]) -> None:
        chatter = self.supervisor.limiter.chatter
        seen = list(chatter.samples)[-1:] if chatter else []
        assert (last[17] == 1.0) == ([one.t for one in seen] == [self.seen.cycles[-1].sample.t])
        assert PHASES[int(last[10])] is self.supervisor.phase
        assert (last[11] == 1.0) == (self.trip is not None)
        if self.trip is None:
            assert last[13] == 0.0 or self.supervisor.stopping
            return
        assert int(last[13]) in CAUSES[self.trip.reason]
        assert (last[12] == 1.0) == self.trip.orderly
        text = str(self.trip)
        cause, first, second = int(last[13]), last[15], last[16]
        assert ("Not every number is finite at" in text) == (cause == NUMBERS)
        if cause in FORMATS:
            assert FORMATS[cause].format(first) in text
        assert (
            second == 0.0
            or f"{second:+.4f} rad" in text
            or f"{second:.2f}" in text
            or f"{second:.3f}" in text
        )


def _told(kept: Array, t: list[float]) -> list[tuple[float, int, float, float]]:
    told = []
    for row, at in zip(kept.tolist(), t, strict=True):
        notes = [row[19 + 3 * k : 22 + 3 * k] for k in range(int(row[18]))]
        told += [(at, int(code), *(numbers if code <= 2 else (0.0, 0.0))) for code, *numbers in notes]
    return told


def _code(event: Event) -> tuple[int, float, float]:
    if isinstance(event.data, PhaseData):
        return 1, PHASES.index(Phase(event.data.phase)), 0.0
    if isinstance(event.data, LimitData):
        return 2 + LIMITS.index(event.data.limit), 0.0, 0.0
    assert isinstance(event.data, ProbeData)
    return 2, event.data.gain_rad_s2_V, event.data.deviation_rad_s2_V


AT_ONCE = 'supervisor.start="immediate"'
FILTER = 'observer.kind="friction_kalman"'
RIDES: Mapping[str, tuple[str, ...]] = {
    "as shipped": (),
    "at once": (AT_ONCE, "loop.delay_samples=0", "reference.soft_start_s=0"),
    "lost": (AT_ONCE, "sim.lost_samples=0.3", "sim.encoder_noise_counts=0.5"),
    "lost for long": (AT_ONCE, "sim.lost_samples=0.8"),
    "fed forward": (AT_ONCE, "controller.friction_feedforward=true", "sim.lost_samples=0.1"),
    "fed forward from the start": ("controller.friction_feedforward=true", 'supervisor.probe="off"'),
    "measured": ('controller.position="measured"', "controller.kp_1_s2=400", "controller.kd_1_s=40"),
    "filter": (FILTER, "sim.lost_samples=0.1"),
    "filter, measured": (FILTER, AT_ONCE, 'controller.position="measured"', "loop.delay_samples=0"),
    "finite": (AT_ONCE, 'supervisor.monitors="finite"'),
    "governed": (AT_ONCE, "reference.soft_start_s=0", "reference.amplitude_rad=5", "reference.rate_rad_s=9"),
    "limits": ("amplifier.slew_V_s=50", "amplifier.voltage_limit_V=2", "sim.plant.f1_rad_s2=8"),
    "stuck": ("sim.plant.f1_rad_s2=60",),
    "falls": ("sim.position_rad=1.5",),
    "strong": ("sim.plant.ku_rad_s2_V=14", 'supervisor.probe="off"'),
    "weak": ("sim.plant.ku_rad_s2_V=0.5",),
    "too far": (AT_ONCE, "supervisor.position_limit_rad=0.9", "sim.position_rad=1.2"),
    "too fast": (
        AT_ONCE,
        "supervisor.velocity_limit_rad_s=3",
        "sim.position_rad=2.9",
        "controller.kp_1_s2=9",
    ),
    "too fast for itself": (
        *(AT_ONCE, "supervisor.velocity_limit_rad_s=3", "sim.position_rad=2.9", "controller.kp_1_s2=9"),
        *("observer.mu0_rad_s=300", 'controller.kind="pd"', "controller.kd_1_s=3"),
    ),
    "astray": (AT_ONCE, "supervisor.error_limit_rad=0.01", "sim.plant.gravity_rad_s2=40"),
}


@pytest.mark.parametrize("name", RIDES)
def test_cycle_has_the_bits_of_the_loop(core: Core, name: str) -> None:
    Ride(*RIDES[name]).check(core)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({400: 0.5, 650: -0.5}, ""),
        ({400: 0.5, 420: -0.5, 440: 0.5}, "jump"),
        ({3: 0.5, 4: 0.5, 5: 0.5}, "jump"),
        ({400: math.nan}, "not_finite"),
        ({900: math.inf}, "not_finite"),
        (dict.fromkeys(range(500, 2000), 0.2), "disturbance"),  # the third is within reach
    ],
)
def test_positions_that_are_wrong(core: Core, changed: dict[int, float], reason: str) -> None:
    ride = Ride(changed=changed)
    ride.check(core)
    assert (ride.trip.reason if ride.trip else "") == reason


def test_demand_that_is_no_number(core: Core) -> None:
    ride = Ride(AT_ONCE, none=0.5)
    ride.check(core)
    assert ride.trip is not None
    assert "controller asked for nan" in str(ride.trip)


def test_second_observer_sees_what_the_first_does_not(core: Core) -> None:
    slow = ("observer.mu0_rad_s=12", "observer.M_rad_s3=15", "controller.kp_1_s2=50", "controller.kd_1_s=14")
    ride = Ride(
        *slow,
        "supervisor.disturbance_limit_rad_s2=1e5",
        changed={k: 0.02 * (k - 900) for k in range(900, 1300)},
    )
    ride.check(core)
    assert ride.trip is not None
    assert "own observer" in str(ride.trip)


def test_single_precision_follows(core: Core) -> None:
    ride = Ride()
    single, double = ride.in_c(core, "float_"), ride.in_c(core)
    assert np.mean(single[:, 10] == double[:, 10]) > 0.99  # a phase may end a cycle earlier
    assert np.abs(single[:, 1] - double[:, 1]).max() < 1e-5
    assert np.quantile(np.abs(single[:, 8] - double[:, 8]), 0.98) < 0.05


def test_tick_that_does_not_come_later_begins_again(core: Core) -> None:
    ride = Ride(AT_ONCE, duration=0.05)
    ride.seen.rows[30][0] = ride.seen.rows[29][0]
    got, position = ride.in_c(core), ride.seen.rows[30][1]
    assert same_bits(got[30, 1:4], np.array([position, 0.0, 0.0]))
