"""What is outside the chip: the stage that makes a voltage of its pins, and the gate that ENABLE is."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.target.machine.system import System


class Stage:
    """The amplifier of either kind of board.

    Parameters
    ----------
    system
        Whose pins it is at.
    supply_mV
        mV, the motor's supply of a bridge.
    full_scale_mV
        mV, what 2048 codes of the DAC are behind the outer stage.
    """

    def __init__(self, system: System, *, supply_mV: float, full_scale_mV: float) -> None:
        self._system, self._supply_mV, self._full_scale_mV = system, supply_mV, full_scale_mV

    @property
    def enable(self) -> bool:
        """The level of ENABLE; its resistor pulls it down."""
        return self._system.wires.level("ENABLE")

    @property
    def input_mV(self) -> float:
        """What stands before the gate: full negative where the DAC's pin is not driven."""
        system = self._system
        if system.pwm.is_clocked():
            sign = -1.0 if system.wires.level("DIRECTION") else 1.0
            led = system.wires.leads("PWM")
            return sign * system.pwm.duty() * self._supply_mV * led
        code = system.dac.code()
        return -self._full_scale_mV if code is None else (code - 2048) * self._full_scale_mV / 2048

    @property
    def amplifier_mV(self) -> float:
        """Voltage at the motor, mV."""
        return self.input_mV if self.enable else 0.0
