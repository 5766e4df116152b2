"""The simulated hardware of a rig: amplifier, plant and encoder, in stages or as one call of the core."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.counted_random import LOST_SAMPLES, CountedRandom
from dcmp_hil.values import Truth
from sim_backend.amplifier import Amplifier
from sim_backend.core_library import FIELDS, Simulation, load
from sim_backend.encoder import make_encoder
from sim_backend.plant import make_plant
from sim_backend.plant_fault_hooks import HEALTHY

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from sim_backend.engine import Engine
    from sim_backend.plant_fault_hooks import PlantFaults


_TICK, _MEASURED_POSITION, _VOLTAGE, _NEWEST_COMMAND = map(
    FIELDS.__getitem__, ("tick", "shown", "voltage", "newest")
)
_POSITION, _VELOCITY, _DISTURBANCE = map(FIELDS.__getitem__, ("position", "velocity", "disturbance"))
_COMMANDS = [FIELDS[name] for name in ("newest", "waiting_1", "waiting_2", "waiting_3", "ramp")]


class Hardware(Protocol):
    """Protocol of amplifier, plant and encoder."""

    def command(self, voltage: float) -> None:
        """Set the newest command, V; a number that is not finite counts as 0 V."""
        ...

    def release(self) -> None:
        """Go to 0 V at once, and forget commands that are under way."""
        ...

    def sample(self) -> tuple[int, float, float]:
        """Advance to the next sample that is not lost; return its tick, position (rad) and voltage (V).

        The first is that of now; tick 0 has had no voltage.
        """
        ...

    def advance(self) -> None:
        """Advance by a period without a sample."""
        ...

    def read(self) -> tuple[float, float]:
        """Read the encoder again; return the position, rad, and the voltage over the last period, V."""
        ...

    def truth(self) -> Truth:
        """Return the true state now."""
        ...


class StagedHardware:
    """Amplifier, plant and encoder one after the other; each may be faulty, and the plant any.

    Parameters
    ----------
    rig
        Its `[sim]`, `[model]`, `[encoder]`, `[amplifier]` and `[loop]` tables.
    engine
        What computes the plant.
    faults
        What goes wrong with plant and encoder.
    """

    def __init__(self, rig: Rig, engine: Engine, faults: PlantFaults = HEALTHY) -> None:
        self._plant = faults.plant(make_plant(rig, engine))
        self._encoder = faults.encoder(make_encoder(rig))
        self._amplifier = Amplifier(
            limit=rig.amplifier.limit,
            slew=rig.amplifier.slew * rig.period,
            dead_zone=rig.sim.dead_zone_V,
            quantum=rig.sim.voltage_step_mV * 1e-3,
            delay_samples=rig.loop.delay_samples,
        )
        self._amplifier.live = True
        self._lost = rig.sim.lost_samples
        self._chance = CountedRandom(rig.sim.seed, LOST_SAMPLES).uniform
        self._tick, self._voltage = -1, 0.0
        self._truth = Truth(rig.sim.position_rad, 0.0, math.nan)

    def command(self, voltage: float) -> None:
        """Set the newest command, V; a number that is not finite counts as 0 V."""
        self._amplifier.command(voltage)

    def release(self) -> None:
        """Go to 0 V at once, and forget commands that are under way."""
        self._amplifier.release()
        self._amplifier.live = True  # whether the rig is open is the backend's business

    def sample(self) -> tuple[int, float, float]:
        """Advance to the next sample that is not lost; return its tick, position (rad) and voltage (V)."""
        if self._tick < 0:
            self._tick = 0
        else:
            self.advance()
            while self._lost and self._chance(self._tick) < self._lost:
                self.advance()
        return self._tick, self._encoder.read(self._truth.position), self._voltage

    def advance(self) -> None:
        """Advance by a period without a sample."""
        self._voltage = voltage = self._amplifier.step()
        self._truth = self._plant.advance(voltage)
        self._tick += 1

    def read(self) -> tuple[float, float]:
        """Read the encoder again; return the position, rad, and the voltage over the last period, V."""
        return self._encoder.read(self._truth.position), self._voltage

    def truth(self) -> Truth:
        """Return the true state now."""
        return self._truth


class CoreHardware:
    """The same of a healthy rig, compiled from the C core: one call a period, and the same bits.

    Parameters
    ----------
    rig
        As for StagedHardware; one that is for the core.

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """

    def __init__(self, rig: Rig) -> None:
        library = load()
        self._next, self._advance, self._read = (
            library.simlib_sample, library.simlib_advance, library.simlib_read,
        )  # fmt: skip
        simulation = _simulation(rig)
        self._pointer = simulation.pointer
        self._numbers, self._integers = simulation.numbers, simulation.integers

    def command(self, voltage: float) -> None:
        """Set the newest command, V; a number that is not finite counts as 0 V."""
        self._numbers[_NEWEST_COMMAND] = voltage

    def release(self) -> None:
        """Go to 0 V at once, and forget commands that are under way."""
        for place in _COMMANDS:
            self._numbers[place] = 0.0

    def sample(self) -> tuple[int, float, float]:
        """Advance to the next sample that is not lost; return its tick, position (rad) and voltage (V)."""
        self._next(self._pointer)
        numbers = self._numbers
        return self._integers[_TICK], numbers[_MEASURED_POSITION], numbers[_VOLTAGE]

    def advance(self) -> None:
        """Advance by a period without a sample."""
        self._advance(self._pointer)

    def read(self) -> tuple[float, float]:
        """Read the encoder again; return the position, rad, and the voltage over the last period, V."""
        self._read(self._pointer)
        return self._numbers[_MEASURED_POSITION], self._numbers[_VOLTAGE]

    def truth(self) -> Truth:
        """Return the true state now."""
        numbers = self._numbers
        # 0.08 us less than the constructor
        return make(Truth, (numbers[_POSITION], numbers[_VELOCITY], numbers[_DISTURBANCE]))


def _simulation(rig: Rig) -> Simulation:
    """Return a rig as the core has it, at the start."""
    sim, model = rig.sim, rig.model.values()
    return Simulation(
        **rig.plant._asdict(),
        believed_f0=model.f0,
        believed_ku=model.ku,
        step=rig.period / rig.plant_steps,
        steps=rig.plant_steps,
        position=sim.position_rad,
        disturbance=math.nan,
        seed=as_signed(sim.seed),
        lost=sim.lost_samples,
        count=rig.encoder.count,
        phase=sim.encoder_phase_counts,
        noise=sim.encoder_noise_counts,
        limit=rig.amplifier.limit,
        slew=rig.amplifier.slew * rig.period,
        dead_zone=sim.dead_zone_V,
        quantum=sim.voltage_step_mV * 1e-3,
        delay=rig.loop.delay_samples,
    )


def as_signed(seed: int) -> int:
    """Return the lowest 64 bits of a seed as a signed integer."""
    return (seed + 2**63) % 2**64 - 2**63


def make_hardware(rig: Rig, engine: Engine, faults: PlantFaults = HEALTHY) -> Hardware:
    """Make the hardware of a rig: as one where it is healthy, and its encoder's edges in their places."""
    if why_not_core(rig, engine, faults):
        return StagedHardware(rig, engine, faults)
    return CoreHardware(rig)


def why_not_core(rig: Rig, engine: Engine, faults: PlantFaults = HEALTHY) -> str:
    """Return why the core does not have the hardware of a rig, in a sentence; empty if it does."""
    sim = rig.sim
    if engine.remark:
        return engine.remark
    if sim.engine != "core":
        return f'sim.engine is "{sim.engine}".'
    if not engine.core:
        return f'the core has the plant "moreau" without details alone; sim.integrator is "{sim.integrator}".'
    if faults is not HEALTHY:
        return "the core has no faults of plant and encoder."
    return "the core has encoders with even edges alone." if sim.encoder_edge_counts else ""
