"""The sentences of the polarity check, made of their numbers: one text for every engine."""

from __future__ import annotations

from dcmp_hil.trip_request import TripRequest


def not_finite(t: float, position: float, voltage: float) -> TripRequest:
    """Return the refusal of a sample with a number that is not finite; s, rad and V."""
    return TripRequest(
        "not_finite",
        f"Not every number is finite while the arm is probed: position {position}, voltage "
        f"{voltage}, t = {t:.3f} s.",
        "Look at the encoder, and at the class that is the backend.",
    )


def moves(moved: float, since: float) -> TripRequest:
    """Return the refusal of an arm that moved by `moved` (rad) in `since` (s) without a voltage."""
    return TripRequest(
        "moving",
        f"The arm moves by itself: {moved:+.3f} rad in {since:.3f} s at 0 V.",
        'Bring it to rest, hanging, and start again; supervisor.probe = "off" starts without it.',
    )


def too_slow(reached: float, push: float, length: float) -> TripRequest:
    """Return the refusal of an amplifier whose output was too low to move the arm.

    Parameters
    ----------
    reached, push
        V, that were applied at most, and that were asked for.
    length
        s, of the first push.
    """
    return TripRequest(
        "slew",
        f"The amplifier put out {reached:.2g} V of the {push:g} V asked for in "
        f"{length:.2g} s, too little to move the arm.",
        "Look at the slew limit of the device and at amplifier.slew_V_s: 20 V/s and more would do.",
    )


def no_answer(push: float, up: float, down: float) -> TripRequest:
    """Return the refusal of an arm that did not move by a count; V and rad."""
    return TripRequest(
        "power",
        f"The arm does not answer: {_ways(push, up, down)}.",
        "Look at motor supply, e-stop and ENABLE, at the coupling, and at the encoder's cable.",
    )


def wrong_way(push: float, up: float, down: float) -> TripRequest:
    """Return the refusal of an arm that moved against the voltage; V and rad."""
    return TripRequest(
        "polarity",
        f"The arm goes the wrong way: {_ways(push, up, down)}.",
        "Change amplifier.sign, or encoder.sign if the count falls when you lift the arm by hand.",
    )


def unsure(push: float, up: float, down: float) -> TripRequest:
    """Return the refusal of an arm whose motion does not tell its direction; V and rad."""
    return TripRequest(
        "power",
        f"The arm hardly answers, too little to tell which way: {_ways(push, up, down)}.",
        'Look what holds it, and at the motor supply; supervisor.probe = "off" starts without.',
    )


def off(push: float, up: float, down: float, ratio: float) -> TripRequest:
    """Return the refusal of a motor whose gain is `ratio` times the believed one; V and rad."""
    return TripRequest(
        "gain",
        f"The arm answers {ratio:.2g} times as strongly as [model] says: {_ways(push, up, down)}.",
        "Look at encoder.counts_per_rev (after quadrature), at the gear, and at model.ku_rad_s2_V.",
    )


def _ways(push: float, up: float, down: float) -> str:
    volts = f"{push:g} V"
    return f"+{volts} moved the arm by {up:+.4f} rad, -{volts} by {down:+.4f} rad"
