"""Runs of the same rig by the core and by the loop of the host, and what differs between them."""

from __future__ import annotations

import random
from contextlib import suppress
from dataclasses import fields, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError, DcmpError, TripError
from dcmp_hil.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.stop_request import StopRequest
    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.recorder import Sink

_WORDS = ("sentence", "remedy", "reason", "orderly", "further", "further_values", "cycles")
_OF_ENGINE = {"engine", "engine_reason"}


class Ride(NamedTuple):
    """A run to its end."""

    result: Result
    error: DcmpError | None


def ride(
    rig: Rig,
    duration: float,
    *,
    plain: bool,
    sinks: Sequence[Sink] = (),
    stop: StopRequest | None = None,
) -> Ride:
    session = Session(rig, duration=duration, fast=True, plain=plain, sinks=sinks, stop=stop)
    try:
        session.run()
    except DcmpError as error:
        return Ride(session.result(), error)
    return Ride(session.result(), None)


def both(rig: Rig, duration: float) -> tuple[Ride, Ride]:
    """Return the ride of the loop and that of the core; fail if the core does not take it."""
    core = ride(rig, duration, plain=False)
    assert core.result.engine == "core", core.result.engine_reason
    return ride(rig, duration, plain=True), core


def differences(loop: Ride, core: Ride) -> list[str]:
    """Return in what two rides differ; a NaN is any NaN, everything else to the bit."""
    columns, results = _of_columns(loop.result, core.result), _of_results(loop.result, core.result)
    return [*columns, *results, *_of_errors(loop, core)]


def _of_columns(one: Result, other: Result) -> Iterator[str]:
    if list(one.columns) != list(other.columns):
        yield "names of columns"
    for name, column in one.columns.items():
        if _bits(column) != _bits(other.columns[name]):
            yield f"column {name}"


def _bits(column: NDArray[np.float64]) -> bytes:
    return np.where(np.isnan(column), np.nan, column).tobytes()


def _of_results(one: Result, other: Result) -> Iterator[str]:
    for field in fields(one):
        if field.name in _OF_ENGINE | {"columns"}:
            continue
        pair = [getattr(result, field.name) for result in (one, other)]
        if field.name == "summary":
            pair = [replace(summary, realtime_factor=0.0) for summary in pair]
        if repr(pair[0]) != repr(pair[1]):
            yield f"{field.name}: {pair}"


def _of_errors(one: Ride, other: Ride) -> Iterator[str]:
    if repr(one.error) != repr(other.error):
        yield f"error: {one.error!r}, {other.error!r}"
    if isinstance(one.error, TripError):
        for name in _WORDS:
            pair = [repr(getattr(ride.error, name)) for ride in (one, other)]
            if pair[0] != pair[1]:
                yield f"{name} of the trip: {[text[-300:] for text in pair]}"


def drawn(seed: int) -> Rig:
    """Draw a rig that no rule refuses; some 4 in 10 of them trip."""
    draw = random.Random(seed)
    while True:
        overrides = [*_of_start(draw), *_of_hardware(draw), *_of_law(draw), *_of_reference(draw)]
        with suppress(ConfigError):
            return load_rig("bench-1khz", overrides)


def _some(draw: random.Random, share: float, *overrides: str) -> Sequence[str]:
    return overrides if draw.random() < share else ()


def _of_start(draw: random.Random) -> Iterator[str]:
    yield f"sim.position_rad={draw.choice((0.0, 0.0, draw.uniform(-0.05, 0.05), draw.uniform(-1.5, 1.5)))!r}"
    yield f"supervisor.start={draw.choice(('engage', 'engage', 'immediate'))}"
    yield from _some(draw, 0.4, "supervisor.probe=off")
    yield from _some(draw, 0.2, "supervisor.monitors=finite")
    yield from _some(draw, 0.3, "run.end=lower")
    yield from _some(draw, 0.2, f"supervisor.error_limit_rad={draw.uniform(0.01, 0.3)!r}")


def _of_hardware(draw: random.Random) -> Iterator[str]:
    yield f"sim.seed={draw.randrange(2**40)}"
    yield f"encoder.counts_per_rev={draw.choice((1024, 4096, 4096, 65536))}"
    yield f"sim.encoder_phase_counts={draw.random()!r}"
    yield f"loop.rate_hz={draw.choice((500, 1000, 1000, 2000))}"
    yield f"loop.delay_samples={draw.choice((0, 1, 1))}"
    yield f"sim.plant.f1_rad_s2={draw.uniform(0.5, 2.0)!r}"
    yield f"sim.plant.ku_rad_s2_V={draw.choice((5.4, draw.uniform(3.5, 8.0), draw.uniform(0.1, 20.0)))!r}"
    yield from _some(draw, 0.3, f"sim.plant.eta_rad_s2={draw.uniform(-30.0, 30.0)!r}")
    yield from _some(draw, 0.3, f"sim.lost_samples={draw.choice((0.02, 0.2))}")
    yield from _some(draw, 0.3, f"sim.encoder_noise_counts={draw.choice((0.5, 3.0, 20.0))}")
    yield from _some(draw, 0.3, f"amplifier.slew_V_s={draw.choice((20.0, 200.0))}")
    yield from _some(draw, 0.2, "sim.dead_zone_V=0.1", "sim.voltage_step_mV=20")
    yield from _some(draw, 0.2, f"amplifier.voltage_limit_V={draw.uniform(1.5, 4.0)!r}")


def _of_law(draw: random.Random) -> Iterator[str]:
    if draw.random() < 0.3:
        yield "observer.kind=friction_kalman"
    else:
        yield from _some(draw, 0.3, "controller.friction_feedforward=true")
        yield from _some(draw, 0.3, "observer.M_rad_s3=1000")
    yield from _some(draw, 0.2, "controller.position=measured")
    yield from _some(draw, 0.2, "controller.kind=pd")


def _of_reference(draw: random.Random) -> Iterator[str]:
    yield f"reference.soft_start_s={draw.choice((0.0, 0.3, 2.0))}"
    kind = draw.choice(("sine", "sine", "hold", "step", "trapezoid", "chirp"))
    yield f"reference.kind={kind}"
    if kind == "sine":
        yield f"reference.rate_rad_s={draw.choice((0.5, 3.0, 12.0))}"
    elif kind == "step":
        yield f"reference.at_s={draw.uniform(0.1, 1.0)!r}"
        yield f"reference.after_rad={draw.uniform(-7.0, 7.0)!r}"
    elif kind == "trapezoid":
        yield f"reference.velocity_rad_s={draw.uniform(1.0, 30.0)!r}"
    elif kind == "chirp":
        yield from ("reference.to_hz=3", "reference.sweep_s=2")
