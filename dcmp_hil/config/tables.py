"""The tables of a rig.toml together, with what follows from more than one of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Self

from pydantic import Field, PrivateAttr

from dcmp_hil.common.section import Section
from dcmp_hil.config.backends import Sim
from dcmp_hil.config.kinds import BackendSection, ControllerSection, ObserverSection, ReferenceSection
from dcmp_hil.config.sections import (
    AmplifierSection,
    EncoderSection,
    LoopSection,
    ModelSection,
    RunSection,
    SimSection,
    SupervisorSection,
    TimingSection,
)
from dcmp_hil.control.controllers.pd_compensated import PdSettings
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings
from dcmp_hil.control.references.periodic import Sine

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model

_TOTAL_ACCELERATION_SHARE = 0.85  # of all that the motor has
_SPARE_ACCELERATION_SHARE = 0.7  # of what is left
_SPARE_ACCELERATION_SHARE_MIN = 0.25  # the same, at least, of all
_PLANT_STEP_MAX_S = 200e-6  # s: every figure of the project's tables holds there


class RigTables(Section):
    """Settings of one rig, before the rules that span more than one table."""

    name: str = Field(default="rig", max_length=60, pattern=r"^\w[\w.-]*$", examples=["my-rig"])
    """Name in the run's folder and on the dashboard: up to 60 letters, digits, and . _ - inside."""
    loop: LoopSection = LoopSection()
    backend: BackendSection = Sim()
    encoder: EncoderSection = EncoderSection()
    amplifier: AmplifierSection = AmplifierSection()
    model: ModelSection = ModelSection()
    observer: ObserverSection = SuperTwistingSettings()
    controller: ControllerSection = PdSettings()
    reference: ReferenceSection = Sine()
    supervisor: SupervisorSection = SupervisorSection()
    timing: TimingSection = TimingSection()
    run: RunSection = RunSection()
    sim: SimSection = SimSection()

    _folder: Path | None = PrivateAttr(default=None)

    @property
    def folder(self) -> Path | None:
        """The folder of the rig's file; None for a shipped rig."""
        return self._folder

    def in_folder(self, folder: Path | None) -> Self:
        """Return the same rig as from a file in that folder."""
        rig = self.model_copy()
        rig._folder = folder  # noqa: SLF001 - its own
        return rig

    @property
    def plugin_folders(self) -> tuple[Path, ...]:
        """Folders in which a `module:Class` is searched, besides installed packages."""
        return (Path(),) if self._folder is None else (self._folder, Path())

    @property
    def period(self) -> float:
        """Nominal period, s."""
        return 1.0 / self.loop.rate_hz

    @property
    def observer_context(self) -> ObserverContext:
        """Facts of the rig for its observer."""
        return ObserverContext(self.model.values(), self.period, self.encoder.counts)

    @property
    def delay(self) -> float:
        """From a sample to the instant at which its command acts, s."""
        return self.loop.delay_samples * self.period

    @property
    def plant(self) -> Model:
        """The simulated plant: `[model]` where `[sim.plant]` says nothing else."""
        changed = self.sim.plant.model_dump(exclude_unset=True)
        return self.model.model_copy(update=changed).values()

    @property
    def plant_steps(self) -> int:
        """Steps of the simulated plant in a period."""
        if self.sim.step_us == "auto":
            return math.ceil(self.period / _PLANT_STEP_MAX_S - 1e-9)
        return max(1, round(self.period / (self.sim.step_us * 1e-6)))

    @property
    def reference_accelerations(self) -> tuple[float, float]:
        """Return the accelerations of a reference and of a stop, rad/s2; infinite without a limit.

        Gravity helps at the ends of a swing; a stop has it against itself. Both leave the controller room.
        """
        model, motor = self.model, self.model.ku_rad_s2_V * self.amplifier.limit
        pushed = abs(model.eta_rad_s2) + abs(model.eta_amplitude_rad_s2)
        spare = max(
            _SPARE_ACCELERATION_SHARE * (motor - pushed - model.gravity_rad_s2),
            _SPARE_ACCELERATION_SHARE_MIN * motor,
        )
        return max(_TOTAL_ACCELERATION_SHARE * motor - pushed, spare), spare

    @property
    def impossible_on_a_wire(self) -> list[str]:
        """Return the settings that no device supports, not even a simulated one."""
        ideal = (
            ('encoder.counts_per_rev = "ideal"', self.encoder.counts is None),
            ('amplifier.voltage_limit_V = "none"', math.isinf(self.amplifier.limit)),
            ("loop.delay_samples = 0", self.loop.delay_samples == 0),
        )
        return [setting for setting, found in ideal if found]

    @property
    def simulation_only(self) -> list[str]:
        """Return the settings that are allowed in a simulation only."""
        loose = (
            ('supervisor.monitors = "finite"', self.supervisor.monitors == "finite"),
            ('supervisor.start = "immediate"', self.supervisor.start == "immediate"),
        )
        return self.impossible_on_a_wire + [setting for setting, found in loose if found]
