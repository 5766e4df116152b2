"""Faults of iron: encoder, motor, power stage, and people."""

from __future__ import annotations

from sim_backend.faults.encoder_faults import EncoderNoise, EncoderSign, Glitch, Jump, Missed, Scale, Stuck
from sim_backend.faults.fault_model import Choice, Kind, Number
from sim_backend.faults.motor_faults import (
    DeadBand,
    Gain,
    MotorSign,
    Offset,
    Power,
    Push,
    Saturation,
    Shove,
    Square,
    Sway,
    UnknownDelay,
)

_COUNTS = Number("counts", -1e6, 1e6, 1000)
_REPETITION_PARAMETERS = {"times": Number("", 1, 1e6, 1), "every": Number("periods", 1, 1e6, 3)}
_TORQUE_PARAMETER = {"rad_s2": Number("rad/s2", -1e5, 1e5, 8)}
_VOLTAGE_PARAMETER = {"V": Number("V", 0, 100, 1)}
PLANT = {
    "plant.enc_stuck": Kind(Stuck, "the encoder shows one position for ever"),
    "plant.enc_jump": Kind(Jump, "the count jumps, and stays", {"counts": _COUNTS, **_REPETITION_PARAMETERS}),
    "plant.enc_glitch": Kind(
        Glitch, "the count is wrong for a period", {"counts": _COUNTS, **_REPETITION_PARAMETERS}
    ),
    "plant.enc_noise": Kind(EncoderNoise, "the encoder is noisy", {"counts": Number("counts", 0, 1e4, 1)}),
    "plant.enc_missed": Kind(Missed, "counts get lost", {"p": Number("", 0, 1, 0.02)}),
    "plant.enc_sign": Kind(EncoderSign, "the encoder counts the other way"),
    "plant.cpr": Kind(Scale, "the encoder has other counts/rev", {"factor": Number("", 0.01, 100, 4)}),
    "plant.motor_sign": Kind(MotorSign, "the motor's wires are swapped"),
    "plant.power": Kind(Power, "the motor has no power"),
    "plant.gain": Kind(Gain, "the motor has another gain", {"factor": Number("", -10, 10, 0.5)}),
    "plant.saturation": Kind(Saturation, "the amplifier gives no more than this", _VOLTAGE_PARAMETER),
    "plant.offset": Kind(Offset, "the amplifier adds a voltage", {"V": Number("V", -100, 100, 1)}),
    "plant.dead_band": Kind(DeadBand, "the amplifier gives nothing below this", _VOLTAGE_PARAMETER),
    "plant.delay": Kind(
        UnknownDelay, "the motor sees a voltage later than it is reported", {"periods": Number("", 1, 100, 2)}
    ),
    "plant.push": Kind(
        Push,
        "a hand pushes the arm: half a sine",
        {**_TORQUE_PARAMETER, "ms": Number("ms", 1, 1e5, 300)},
    ),
    "plant.sway": Kind(
        Sway, "a hand moves the arm to and fro", {**_TORQUE_PARAMETER, "hz": Number("Hz", 1e-3, 1e3, 0.3)}
    ),
    "plant.square": Kind(
        Square, "a torque changes its sign", {**_TORQUE_PARAMETER, "hz": Number("Hz", 1e-3, 1e3, 0.4)}
    ),
    "plant.shove": Kind(
        Shove,
        "the arm is pushed",
        {"rad_s2": Number("rad/s2", 0, 1e5, 100), "way": Choice(("either", "up", "down"))},
    ),
}
