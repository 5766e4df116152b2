"""The tables of rig.toml: every key with its unit, its bounds and what it means."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from dcmp_hil.common.section import Section
from dcmp_hil.control.model import Model, PlantDetails

PLANTS = {
    "moreau": ("sim_backend.plant:MoreauPlant", "friction that can stick"),
    "euler": ("sim_backend.plant:EulerPlant", "the paper's explicit Euler steps"),
}
"""Simulated plants by the word of `sim.integrator`, the default first: class, and what it is."""
if TYPE_CHECKING:
    _Integrator = str
else:
    _Integrator = Literal[tuple(PLANTS)]
_REFERENCE_LIMIT_SHARE = 0.95  # of a limit that trips: room to overshoot a reference that stops there


class LoopSection(Section):
    """`[loop]`: how often, and how late a command acts."""

    rate_hz: float = Field(default=1000.0, ge=10.0, le=20_000.0)
    """Samples per second, Hz."""
    delay_samples: Annotated[int, Field(ge=0, le=1)] = 1  # a Literal would take true and 1.0
    """Periods from a sample to the instant at which its command acts: 1 on every real device."""


class EncoderSection(Section):
    """`[encoder]`: what one count means."""

    counts_per_rev: Annotated[float, Field(ge=16, le=2**24)] | Literal["ideal"] = 4096.0
    """Counts per revolution (after quadrature), or "ideal" for no quantisation (simulation only)."""

    sign: Literal[1, -1] = 1
    """-1 if the encoder counts down when the arm rises; a simulated one then does."""
    zero: Annotated[int, Field(ge=-(2**23), le=2**23 - 1)] | Literal["at_start"] = "at_start"
    """Count at which the arm hangs, or "at_start": the count at the start. The simulated rig knows it."""

    @property
    def counts(self) -> float | None:
        """Counts per revolution; None for an ideal encoder."""
        return None if self.counts_per_rev == "ideal" else float(self.counts_per_rev)

    @property
    def count(self) -> float:
        """One count, rad; 0 for an ideal encoder."""
        return 0.0 if self.counts is None else math.tau / self.counts


class AmplifierSection(Section):
    """`[amplifier]`: what the amplifier may put out."""

    voltage_limit_V: Annotated[float, Field(gt=0, le=100)] | Literal["none"] = 10.0
    """Largest voltage of either sign, V; "none" in simulation only."""
    slew_V_s: Annotated[float, Field(ge=1, le=1e9)] | Literal["none"] = "none"
    """Largest change, V/s; "none" for no limit."""

    sign: Literal[1, -1] = 1
    """-1 if a positive voltage lowers the arm; a simulated motor is then wired so."""
    supply_V: Annotated[float, Field(ge=1, le=100)] | Literal["none"] = "none"
    """The motor's supply, V, if the board divides it (PWM); "none": the amplifier takes a voltage command."""

    @property
    def supply_mV(self) -> int:
        """The motor's supply, mV; 0 where none is divided."""
        return 0 if self.supply_V == "none" else round(1e3 * self.supply_V)

    @property
    def limit(self) -> float:
        """Largest voltage, V; infinity for none."""
        return math.inf if self.voltage_limit_V == "none" else float(self.voltage_limit_V)

    @property
    def slew(self) -> float:
        """Largest change, V/s; infinity for none."""
        return math.inf if self.slew_V_s == "none" else float(self.slew_V_s)


class ModelSection(Section):
    """`[model]`: the pendulum as observer and controller believe it, eqs. (1)-(4), (12), (13)."""

    f0_1_s: Annotated[float, Field(ge=0, le=100)] = 0.1
    """Viscous friction over inertia fd/J, 1/s."""
    f1_rad_s2: Annotated[float, Field(ge=0, le=1000)] = 1.3
    """Coulomb friction over inertia fc/J, rad/s2."""
    gravity_rad_s2: Annotated[float, Field(ge=0, le=1000)] = 14.03
    """Gravity over inertia gmL/J, rad/s2."""
    ku_rad_s2_V: Annotated[float, Field(gt=0, le=10_000)] = 5.4
    """Motor and amplifier gain over inertia ku/J, (rad/s2)/V."""
    eta_rad_s2: Annotated[float, Field(ge=-1000, le=1000)] = 0.84
    """External disturbance eta/J, constant part, rad/s2."""
    eta_amplitude_rad_s2: Annotated[float, Field(ge=-1000, le=1000)] = 0.2
    """External disturbance, swinging part, rad/s2."""
    eta_rate_rad_s: Annotated[float, Field(ge=0, le=1000)] = 0.2
    """Angular frequency of the swinging part, rad/s."""

    def values(self) -> Model:
        """Return the numbers without pydantic, for the loop."""
        return Model(
            f0=self.f0_1_s,
            f1=self.f1_rad_s2,
            gravity=self.gravity_rad_s2,
            ku=self.ku_rad_s2_V,
            eta=self.eta_rad_s2,
            eta_amplitude=self.eta_amplitude_rad_s2,
            eta_rate=self.eta_rate_rad_s,
        )


class SimSection(Section):
    """`[sim]`: the simulated rig, where it differs from the believed one."""

    step_us: Annotated[float, Field(ge=1, le=10_000)] | Literal["auto"] = "auto"
    """Plant step, us; must divide the period. "auto": the largest divisor not above 200 us."""
    integrator: Annotated[
        _Integrator,
        Field(description="; ".join(f"`{word}`: {what}" for word, (_, what) in PLANTS.items()) + "."),
    ] = next(iter(PLANTS))
    engine: Literal["core", "python"] = "core"
    """`core`: the firmware's C computes the plant, and runs in virtual time; `python`: the same, slower."""
    position_rad: Annotated[float, Field(ge=-100, le=100)] = 0.0
    """Position of the arm at the start, at rest, rad; 0 = hanging."""
    encoder_phase_counts: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Offset of the encoder's zero between two edges, counts."""
    encoder_noise_counts: Annotated[float, Field(ge=0, le=10_000)] = 0.0
    """Noise before the quantiser, standard deviation, counts (rad with an ideal encoder)."""
    encoder_edge_counts: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Each edge of a turn lies up to this far from its place, either way, counts."""
    lost_samples: Annotated[float, Field(ge=0, le=0.9)] = 0.0
    """Probability that a sample does not reach the host; the amplifier holds its voltage."""
    stribeck_ratio: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Friction at rest over that in motion, minus 1: f1 (1 + ratio exp(-(v/stribeck_rad_s)^2))."""
    stribeck_rad_s: Annotated[float, Field(ge=1e-4, le=100)] = 0.05
    """Velocity over which the friction falls from that at rest to that in motion, rad/s."""
    bristle_mrad: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Soft friction (LuGre): deflection at which the arm breaks away, mrad; 0 sticks rigidly."""
    cogging_rad_s2: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """Cogging of the motor, an acceleration of this amplitude, rad/s2."""
    cogging_per_rev: Annotated[int, Field(ge=1, le=1000)] = 24
    """Periods of the cogging in a turn."""
    dead_zone_V: Annotated[float, Field(ge=0, le=100)] = 0.0
    """The amplifier's output is 0 V below this, V."""
    voltage_step_mV: Annotated[float, Field(ge=0, le=10_000)] = 0.0
    """Step of the amplifier's output, mV; 0 for none."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all noise: the same seed gives the same run to the bit."""
    plant: ModelSection = ModelSection()
    """`[sim.plant]`: keys of [model] that differ in the simulated plant; the rest is as in [model]."""

    @property
    def details(self) -> PlantDetails | None:
        """Properties of the simulated motor beyond the model; None without any."""
        if not (self.stribeck_ratio or self.bristle_mrad or self.cogging_rad_s2):
            return None
        return PlantDetails(
            stribeck_ratio=self.stribeck_ratio,
            stribeck=self.stribeck_rad_s,
            bristle=1e-3 * self.bristle_mrad,
            cogging=self.cogging_rad_s2,
            cogging_per_rev=self.cogging_per_rev,
        )

    @property
    def plant_class(self) -> str:
        """Class of the simulated plant, as `module:Class`."""
        return PLANTS[self.integrator][0]


class SupervisorSection(Section):
    """`[supervisor]`: how a run starts, and what stops it."""

    start: Literal["engage", "immediate"] = "engage"
    """`engage`: settle at 0 V, then ramp authority; `immediate`: simulation and tests only."""
    probe: Literal["first", "off"] = "first"
    """`first`: before engaging, +-1 V for 0.1 s each show the arm's direction; `off`: trust the signs."""
    monitors: Literal["all", "finite"] = "all"
    """`finite`: watch for NaN and device faults only, not for speed or chatter (simulation only)."""
    velocity_limit_rad_s: Annotated[float, Field(ge=0.01, le=10_000)] = 20.0
    """Trip above this velocity, rad/s; by host and device. The reference stays 5 % below it."""
    position_limit_rad: Annotated[float, Field(ge=0.01, le=10_000)] = 6.2832
    """Trip beyond this position of either sign, rad; by host and device. The reference stays 5 % below it."""
    error_limit_rad: Annotated[float, Field(ge=0.001, le=10_000)] | Literal["none"] = 1.5
    """End the run if the arm deviates by more than this from the reference for 0.5 s, rad; "none": never."""
    disturbance_limit_rad_s2: Annotated[float, Field(ge=0.01, le=1e6)] = 50.0
    """Trip when the watching observer's |w_hat|, filtered over 10 ms, stays above this for 5 ms, rad/s2."""

    @property
    def reference_limits(self) -> tuple[float, float]:
        """Farthest position and largest velocity that a reference is let ask for, rad and rad/s."""
        return (
            _REFERENCE_LIMIT_SHARE * self.position_limit_rad,
            _REFERENCE_LIMIT_SHARE * self.velocity_limit_rad_s,
        )

    @property
    def error_limit(self) -> float:
        """Largest distance from the reference, rad; infinity for none."""
        return math.inf if self.error_limit_rad == "none" else float(self.error_limit_rad)


class TimingSection(Section):
    """`[timing]`: what a run in real time asks of the operating system, and what it does when it is late."""

    realtime: Literal["try", "enforce", "off"] = "try"
    """`try`: use what the system grants, report the rest; `enforce`: refuse to start without it, exit 5."""
    priority: Annotated[int, Field(ge=2, le=98)] = 80
    """SCHED_FIFO priority of the loop; other threads of its process get 1."""
    cpu: Annotated[int, Field(ge=0, le=4095)] | Literal["any"] = "any"
    """Number of the one CPU that the loop runs on, or "any"."""
    switch_interval_us: Annotated[int, Field(ge=20, le=5000)] = 100  # at 10 us no thread makes progress
    """Interval after which a Python thread that holds the interpreter lock releases it, us."""
    overrun: Literal["hold", "skip", "stop"] = "hold"
    """A late cycle: `hold`: count it, go on; `skip`: drop what was missed; `stop`: end the run, exit 5."""
    overrun_limit: Annotated[int, Field(ge=1, le=20)] = 5
    """`stop` ends the run at this many late cycles of 20; late is half a period, or slower than one."""


class RunSection(Section):
    """`[run]`: when and how a run ends."""

    duration_s: Annotated[float, Field(ge=0, le=1e6)] = 30.0
    """Length, s; 0 = until Ctrl-C."""
    end: Literal["release", "lower"] = "release"
    """After the duration: 0 V at once, or first a 2 s move to hanging."""


class Custom(Section):
    """An observer or a controller of your own: `kind = "module:Class"`, made as Class(context, **options)."""

    kind: Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$", examples=["my_lab.rig:Mine"])]
    """`module:Class`; the module is installed, or beside the rig file, or in the current folder."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Keyword arguments for the constructor of the class."""

    knows_friction: ClassVar[bool] = False


class CustomController(Custom):
    """A controller of your own; the loop hands it the position that it asks for here."""

    position: Literal["estimated", "measured"] = "estimated"
    """Position that the controller gets: x1_hat (quiet) or the encoder's."""

    feeds_friction_forward: ClassVar[bool] = False
