"""Runs that go side by side: what they have in common, and their blocks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS
from dcmp_hil.safety.chatter import block_cycles
from dcmp_hil.safety.limiter import CONSECUTIVE_GAP_PERIODS_MAX
from sim_backend.lanes.parameters import lane_numbers
from sim_backend.lanes.reference_rows import Instants

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.control.references import ReferenceSettings
    from sim_backend.lanes.layout import LanesLayout
    from sim_backend.lanes.parameters import LaneNumbers

_LAST_PERIODS = 1.5  # before the end: the cycle there is the last
_OVER = 2.0


class GroupKey(NamedTuple):
    """Settings that the runs of a group have in common: two runs with equal keys are of one group."""

    reference: ReferenceSettings
    period: float
    plant_steps: int
    delay_samples: int
    shaped: bool
    noisy: bool
    gaps: bool
    friction: bool
    measured: bool
    watched: bool

    @property
    def instants(self) -> Instants:
        """When the runs ask for their reference."""
        return Instants(self.period, self.delay_samples * self.period, self.gaps, self.friction)


class Mode(NamedTuple):
    """The way in which a group is run.

    Parameters
    ----------
    exact_chatter
        Whether the limit of the voltage's variation is each rig's own, and not the lowest there is.
    kept
        Samples at the end of each run that are kept for a diagnosis.
    """

    exact_chatter: bool = False
    kept: int = 0


def key_of(rig: Rig) -> GroupKey:
    """Return the key of a rig's group."""
    sim = rig.sim
    return GroupKey(
        rig.reference,
        rig.period,
        rig.plant_steps,
        rig.loop.delay_samples,
        bool(math.isfinite(rig.amplifier.slew) or sim.dead_zone_V or sim.voltage_step_mV),
        bool(sim.encoder_noise_counts),
        bool(sim.lost_samples),
        rig.controller.feeds_friction_forward,
        rig.controller.position == "measured",
        rig.supervisor.monitors == "all",
    )


def common_of(key: GroupKey, duration_s: float, layout: LanesLayout, mode: Mode) -> NDArray[np.void]:
    """Return `struct lanes_common` of a group."""
    common = np.zeros(1, layout.common)
    values = {
        "period": key.period,
        "until": duration_s - _LAST_PERIODS * key.period,
        "longest_gap": GAP_PERIODS_MAX * key.period + STEP_TOLERANCE_PERIODS * key.period,
        "consecutive_gap": CONSECUTIVE_GAP_PERIODS_MAX * key.period,
        "plant_steps": key.plant_steps,
        "delayed": key.delay_samples,
        "chatter_cycles": block_cycles(key.period),
        "kept": mode.kept,
        "exact": mode.exact_chatter,
        **{
            name: getattr(key, name)
            for name in ("shaped", "noisy", "gaps", "friction", "measured", "watched")
        },
    }
    for name, value in values.items():
        common[name] = value
    return common


def blocks_of(
    rigs: Sequence[Rig], layout: LanesLayout, mode: Mode
) -> tuple[NDArray[np.void], NDArray[np.float64] | None]:
    """Return the blocks of the rigs of a group, and the constants of their steps where samples are lost.

    The last block is filled with copies of the last rig, which are over before they begin.
    """
    numbers = [lane_numbers(rig, exact_chatter=mode.exact_chatter) for rig in rigs]
    lanes = layout.lanes
    count = -(-len(rigs) // lanes)
    spare = count * lanes - len(rigs)
    numbers += numbers[-1:] * spare
    blocks = np.zeros(count, layout.block)
    _fill(blocks["parameters"], (one.parameters for one in numbers))
    _fill(blocks["own"], (one.own for one in numbers))
    _fill(blocks["watch"], (one.watch for one in numbers))
    start = np.array([rig.sim.position_rad for rig in rigs] + [0.0] * spare).reshape(count, lanes)
    _begin(blocks, start, float(block_cycles(rigs[0].period)))
    if spare:
        blocks["state"]["phase"][-1, -spare:] = _OVER
    return blocks, _gap_steps(numbers, lanes) if numbers[0].gap_steps else None


def _fill(rows: NDArray[np.void], lanes: Iterable[Mapping[str, float]]) -> None:
    """Write numbers of lanes, by name, into the rows of blocks."""
    listed = list(lanes)
    names = list(listed[0])
    table = np.array([list(one.values()) for one in listed]).T
    for name, values in zip(names, table, strict=True):
        rows[name] = values.reshape(rows[name].shape)


def _begin(blocks: NDArray[np.void], position: NDArray[np.float64], chatter_cycles: float) -> None:
    """Write the state before the first tick."""
    state = blocks["state"]
    state["x1"] = position
    state["gap"] = 1.0
    state["left"] = chatter_cycles
    for name in ("w", "t", "reference_x", "block_t"):
        state[name] = math.nan
    for name in ("astray_since", "saturated_since"):
        state[name] = math.inf
    for name in ("astray_last", "saturated_last", "jumped"):
        state[name] = -math.inf
    blocks["own"]["y"] = math.nan


def _gap_steps(numbers: Sequence[LaneNumbers], lanes: int) -> NDArray[np.float64]:
    """Return the constants of steps, shape (blocks, observers, gaps, numbers, lanes)."""
    table = np.array([one.gap_steps for one in numbers])
    return np.ascontiguousarray(np.moveaxis(table.reshape(-1, lanes, *table.shape[1:]), 1, -1))
