"""The law in C behind columns of numbers, and samples of a closed loop to compare it with Python on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.control.controllers import ControllerContext
from dcmp_hil.control.controllers.pd_compensated import PdCompensated
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.control.predictor import LinearPredictor
from dcmp_hil.values import Reference, Sample
from sim_backend.plant import MoreauPlant

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.firmware.bench import Core

Array = np.ndarray[Any, np.dtype[np.float64]]

T = 1e-3  # s
COUNTS = 4096.0


class Law:
    """The functions of the check files, for double or for float.

    Parameters
    ----------
    core
        The library.
    kind
        `float_` for the law in single precision.
    """

    def __init__(self, core: Core, kind: str = "") -> None:
        self._ffi: Any = core.ffi
        self._lib, self._kind = core.lib, kind

    def __call__(self, name: str, *given: Any, width: int = 1, rows: int | None = None) -> Array:
        """Call a check; the last array given has a row for each of the results, which are `width` wide."""
        arrays = [
            np.ascontiguousarray(each, float) if isinstance(each, np.ndarray) else each for each in given
        ]
        n = len(arrays[-1]) if rows is None else rows
        out = np.full(n * width, math.nan)
        pointers = [
            self._ffi.from_buffer("double[]", each) if isinstance(each, np.ndarray) else each
            for each in arrays
        ]
        getattr(self._lib, f"check_{self._kind}{name}")(*pointers, self._ffi.from_buffer("double[]", out), n)
        return out if width == 1 else out.reshape(n, width)


def same_bits(got: Array, wanted: Array) -> bool:
    """Return whether two arrays have the same bits; one NaN is as good as another."""
    none = np.isnan(wanted)
    return (
        got.shape == wanted.shape
        and np.array_equal(none, np.isnan(got))
        and np.array_equal(got[~none].view(np.int64), wanted[~none].view(np.int64))
    )


def context(counts: float | None = COUNTS, period: float = T, model: Model | None = None) -> ObserverContext:
    """Return the facts of a rig."""
    return ObserverContext(model or Model(), period, counts)


def reference(t: float) -> Reference:
    """Return a reference that reverses, and rests for a quarter of its period."""
    s, c = math.sin(2.0 * t), math.cos(2.0 * t)
    if s < -0.5:
        return Reference(-0.5, 0.0, 0.0)
    return Reference(s, 2.0 * c, -4.0 * s)


def ride(counts: float | None = COUNTS, periods: int = 2500, push: float = 0.0) -> list[Sample]:
    """Return the samples of a closed loop: R1, predictor and controller of Python on the simulated plant.

    Parameters
    ----------
    counts
        Of the encoder, per revolution; None is ideal.
    periods
        How many samples.
    push
        V, of a hand that pulls the arm for 0.3 s as this voltage would.
    """
    model, rig = Model(), context(counts)
    plant = MoreauPlant(model, model, position=-1.57, step=T / 5, steps=5)
    observer, predictor = SuperTwisting(rig), LinearPredictor(model, T, 1)
    controller = PdCompensated(ControllerContext(model, T), kp=400.0, kd=40.0)
    samples, voltage, position = [], 0.0, -1.57
    for k in range(periods):
        t = k * T
        q = 0.0 if counts is None else 2.0 * math.pi / counts
        sample = Sample(t, round(position / q) * q if q else position, voltage)
        samples.append(sample)
        estimate = observer.update(sample)
        ahead = predictor.ahead(sample, estimate, reference(t + T))
        hand = push if 0.5 < t % 1.5 < 0.8 else 0.0
        position = plant.advance(voltage + hand).position
        voltage = min(5.0, max(-5.0, controller.update(reference(t + T), ahead)))
        predictor.sent(voltage)
    return samples


def thinned(samples: Sequence[Sample]) -> list[Sample]:
    """Return samples of which some are lost: one, up to nine in a row, more than a step can bridge."""
    lost = {*range(101, 2000, 37), *range(201, 210), *range(300, 302), *range(500, 600), *range(705, 710)}
    return [sample for k, sample in enumerate(samples) if k not in lost]


def table(samples: Sequence[tuple[float, ...]], columns: int) -> Array:
    """Return the first columns of rows as an array."""
    return np.array([tuple(each)[:columns] for each in samples], float)
