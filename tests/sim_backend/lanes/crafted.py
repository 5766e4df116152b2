"""Lanes whose state a test makes by hand: what a drawn run meets rarely or never."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sim_backend.lanes.block_group import Mode, blocks_of, common_of, key_of
from sim_backend.lanes.library import address
from sim_backend.lanes.reference_rows import reference_rows
from tests.sim_backend.lanes.runs import rig_of

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from sim_backend.lanes.library import Lanes

    Change = Callable[[NDArray[np.void], NDArray[np.void]], None]

NOT_FINITE, SPEED, CHATTER = 1.0, 2.0, 7.0
BY_LOOP, WITH_EXACT = 1.0, 2.0
_STOPPING = 1.0
_HIGH_V_S, _LOW_V_S = 1e5, 1.0


def run_crafted(lanes: Lanes, change: Change, seconds: float, *, exact: bool = True) -> NDArray[np.void]:
    """Run 8 lanes of a nominal rig, whose block and rows were changed; return the block."""
    rig = rig_of("reference.soft_start_s=0", "reference.kind=hold")
    mode = Mode(exact_chatter=exact)
    blocks, _ = blocks_of([rig] * lanes.layout.lanes, lanes.layout, mode)
    key = key_of(rig)
    common = common_of(key, seconds, lanes.layout, mode)
    rows = reference_rows(key.reference, key.instants, range(round(seconds * 1e3) + 60), lanes.layout.row)
    change(blocks, rows)
    lanes.run(address(common), address(blocks), address(rows), 0, len(rows), None, None)
    return blocks


def causes(lanes: Lanes) -> list[float]:
    """Return why lanes end whose observers or controllers were broken."""

    def spoil(blocks: NDArray[np.void], _: NDArray[np.void]) -> None:
        blocks["own"]["h11"][0, 0] = math.nan
        blocks["own"]["L1"][0, 1] = blocks["watch"]["L1"][0, 2] = 1e9
        blocks["state"]["x1"][0, 1:3] = 0.2
        blocks["parameters"]["kp"][0, 3] = math.nan

    found: list[float] = run_crafted(lanes, spoil, 0.2)["state"]["cause"][0, :4].tolist()
    return found


def jumps(lanes: Lanes) -> list[float]:
    """Return how lanes are repeated whose reference jumps twice in 0.1 s, or too near to a limit."""

    def jump(blocks: NDArray[np.void], rows: NDArray[np.void]) -> None:
        rows["x"][100:] = rows["x_now"][100:] = 0.03
        rows["x"][200:] = rows["x_now"][200:] = 0.06
        blocks["parameters"]["reference_x_max"][0, 0] = 0.035
        blocks["parameters"]["jump_x_max"][0, 1] = 0.01

    found: list[float] = run_crafted(lanes, jump, 0.4)["state"]["repeat"][0, :3].tolist()
    return found


def chatter(lanes: Lanes) -> list[float]:
    """Return how lanes are repeated by the blocks before, of which the last is quiet or not."""

    def shake(limits: list[float]) -> Change:
        def change(blocks: NDArray[np.void], _: NDArray[np.void]) -> None:
            rates = blocks["rates"].reshape(11, -1)
            rates[:] = _HIGH_V_S
            rates[-1] = _LOW_V_S
            blocks["state"]["blocks"] = 11.0
            blocks["state"]["block_t"] = -0.01
            blocks["parameters"]["chatter_max"] = limits

        return change

    width = lanes.layout.lanes
    after = run_crafted(lanes, shake([math.inf] * width), 0.06)["rates"].reshape(11, -1)[:, 0].tolist()
    mean = 0.0
    for rate in after[1:]:
        mean += rate
    near = shake([mean / 10.0, _HIGH_V_S / 4.0] + [math.inf] * (width - 2))
    exact = run_crafted(lanes, near, 0.06)["state"]["repeat"][0, :2].tolist()
    rough = run_crafted(lanes, near, 0.06, exact=False)["state"]["repeat"][0, :2].tolist()
    return [*exact, *rough]


def bursts(lanes: Lanes) -> list[float]:
    """Return the causes of lanes with few blocks, with a pause, with a pause after many bursts, with none."""

    def shake(blocks: NDArray[np.void], _: NDArray[np.void]) -> None:
        rates, state = blocks["rates"].reshape(11, -1), blocks["state"]
        rates[:] = _HIGH_V_S
        rates[1:3, 1:3] = _LOW_V_S
        state["blocks"], state["block_t"] = 11.0, -0.01
        state["blocks"][0, 0] = 3.0
        state["bursts"][0, 2] = 39.0
        blocks["parameters"]["chatter_max"] = _HIGH_V_S / 4.0

    found: list[float] = run_crafted(lanes, shake, 0.06)["state"]["cause"][0, :4].tolist()
    return found


def ramps(lanes: Lanes) -> tuple[list[float], list[float]]:
    """Return cause and voltage of lanes that are on their way to 0 V when the run is over."""

    def stop(blocks: NDArray[np.void], _: NDArray[np.void]) -> None:
        state, parameters = blocks["state"], blocks["parameters"]
        state["x1"][0, :4] = 0.3, -0.3, 0.3, -0.3
        state["phase"] = _STOPPING
        state["cause"] = SPEED
        state["stop_since"], state["stop_from"] = -0.001, 5.0
        state["stop_from"][0, 4] = 0.0
        parameters["slew"][0, :2] = 0.1
        parameters["slew"][0, 2:] = math.inf
        parameters["disturbance_max"] = parameters["velocity_max"] = 1e9

    state = run_crafted(lanes, stop, 0.01)["state"]
    return state["cause"][0, :5].tolist(), state["peak"][0, :5].tolist()
