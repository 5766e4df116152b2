"""A run in C stops where it needs the host, also inside a cycle, and its rows do not depend on where."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from dcmp_hil.assembly import assemble
from dcmp_hil.platform.clock import SimulatedClock
from sim_backend.core_run.library import load
from sim_backend.core_run.parameters import parameters_of
from tests.helpers import bench

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig

FORWARD = "controller.friction_feedforward=true"
LOST = "sim.lost_samples=0.3"


class _Pieces(NamedTuple):
    """Rows, events and reference of one call; whether the reference has further instants."""

    rows: int
    events: int
    references: int
    further: bool


def _references(rig: Rig, first: int, pieces: _Pieces, t0: float) -> NDArray[np.void]:
    """Return the reference of some ticks from the first on, of a trajectory that began at t0, s."""
    rows = np.zeros(pieces.references, load().structures["run_reference"])
    at, period = rig.reference.source().at, rig.period
    for row, tick in zip(rows, range(first, first + len(rows)), strict=True):
        t = tick * period
        row["x"], row["v"], row["a"] = at(t + rig.delay - t0)
        if pieces.further:
            row["x_now"], row["v_now"], row["a_now"] = at(t - t0)
            row["x_middle"], row["v_middle"], _ = at(0.5 * (t + (tick - 1) * period) - t0)
    return rows


def _run(rig: Rig, pieces: _Pieces, until: float) -> tuple[NDArray[np.float64], list[object], set[str]]:
    """Run in pieces; return rows, events and the reasons for which it returned."""
    library = load()
    stages, recorder = assemble(rig, SimulatedClock(), [], in_line=True)
    recorder.close()
    parameters, state = parameters_of(rig, stages, library), np.empty(library.state_bytes // 8)
    library.begin(state.ctypes.data, parameters.ctypes.data)
    progress = np.zeros(1, library.structures["run_progress"])
    progress["began"], progress["until"], progress["fresh"] = math.inf, until, 1
    progress["has_now"] = progress["has_middle"] = pieces.further
    width = library.constants["RUN_FIELDS"] + len(recorder.further)
    out, log = np.empty((pieces.rows, width)), np.zeros(pieces.events, library.structures["run_event"])
    references = np.zeros(0, library.structures["run_reference"])
    rows, events, reasons, source = [], list[object](), set[str](), rig.reference.source()
    while not reasons & {"REACHED", "OVER"}:
        given = (
            references.ctypes.data,
            len(references),
            out.ctypes.data,
            len(out),
            log.ctypes.data,
            len(log),
        )
        reason = library.returns[library.cycles(state.ctypes.data, progress.ctypes.data, *given)]
        reasons.add(reason)
        rows.append(out[: progress["rows"][0]].copy())
        events += log[: progress["events"][0]].tolist()
        began, first = float(progress["began"][0]), int(progress["tick"][0])
        if reason in {"BEGINS", "REFERENCES_USED"}:
            progress["first_row"], references = first, _references(rig, first, pieces, began)
        if reason == "ASKS":
            answer = source.at(float(progress["asked"][0]) - began)
            progress["answer_x"], progress["answer_v"], progress["answer_a"] = answer
    return np.concatenate(rows), events, reasons


@pytest.mark.parametrize("settings", [(), (LOST,), (FORWARD,), (FORWARD, LOST), ("loop.delay_samples=0",)])
def test_rows_do_not_depend_on_where_a_call_ends(settings: tuple[str, ...]) -> None:
    rig = bench("reference.soft_start_s=0.1", *settings)
    whole, events, reasons = _run(rig, _Pieces(2000, 200, 2000, further=True), 0.9)
    small, same, seen = _run(rig, _Pieces(3, 17, 5, further=False), 0.9)
    assert np.array_equal(small, whole, equal_nan=True)
    assert same == events
    assert reasons - {"ASKS"} == {"BEGINS", "REACHED"}  # a middle after a gap is in no row
    assert seen >= {"ROWS_FULL", "BEGINS", "REFERENCES_USED", "REACHED"}
    assert ("ASKS" in seen) == (rig.delay > 0.0)


def test_log_without_room_for_a_cycle_ends_a_call() -> None:
    rig = bench()
    whole, events, _ = _run(rig, _Pieces(2000, 200, 2000, further=True), 0.9)
    small, same, seen = _run(rig, _Pieces(2000, 17, 2000, further=True), 0.9)
    assert np.array_equal(small, whole, equal_nan=True)
    assert same == events
    assert "LOG_FULL" in seen


def test_end_is_the_last_row() -> None:
    rig = bench("sim.plant.f1_rad_s2=60")  # the polarity check refuses an arm that is stuck
    rows, _, reasons = _run(rig, _Pieces(2000, 200, 2000, further=True), 1.9)
    assert "OVER" in reasons
    assert rows[-1, load().constants["RUN_FIELDS"] - 11] == 0.0  # V, sent
    assert rows[-1, 0] < 1.0
