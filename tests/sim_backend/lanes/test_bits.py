"""The outcome of a lane has the bits of the plain loop, on every build and at every number of lanes."""

from __future__ import annotations

import shutil
import subprocess
from functools import partial
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.sweeping.plain_loop import PlainLoop
from sim_backend.compiling import build
from sim_backend.lanes import engine, library
from sim_backend.lanes.engine import LaneEngine
from sim_backend.lanes.instruction_sets import SETS, here
from tests.sim_backend.lanes.mixed import MIXED_S, mixed
from tests.sim_backend.lanes.runs import CASES, REPEATED, TRIPS, drawn, rig_of, unequal

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.sweeping.engine import RunOutcome
    from sim_backend.lanes.instruction_sets import InstructionSet
    from sim_backend.lanes.library import Lanes

_PROMISED = {"nominal", "saturated", "lost samples", "1024 counts", "65536 counts", "ideal encoder"}


@pytest.fixture
def no_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no run be repeated by the plain loop."""

    def refuse(_: PlainLoop, rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
        assert not rigs, f"repeated: {len(rigs)} runs of {duration_s} s"
        return []

    class _None(PlainLoop):
        run = refuse

    monkeypatch.setattr(engine, "PlainLoop", _None)


@pytest.mark.usefixtures("no_loop")
@pytest.mark.parametrize("name", CASES)
def test_a_lane_has_the_bits_of_the_plain_loop(name: str) -> None:
    number = 20 if name in _PROMISED else 3
    assert not unequal(LaneEngine(), drawn(number, CASES[name]), 0.8)


@pytest.mark.usefixtures("no_loop")
@pytest.mark.parametrize("name", TRIPS)
def test_a_lane_trips_as_the_plain_loop_does(name: str) -> None:
    overrides, causes = TRIPS[name]
    rigs = drawn(2, overrides)
    found = {outcome.trip_cause for outcome in LaneEngine().run(rigs, 2.2)}
    assert found & causes
    assert found <= causes | {""}
    assert not unequal(LaneEngine(), rigs, 2.2)


@pytest.fixture(scope="module")
def expected() -> list[str]:
    """Return the outcomes of the mixed rigs by the usual build."""
    return [repr(outcome) for outcome in LaneEngine().run(mixed(), MIXED_S)]


def _outcomes(load: partial[Lanes], threads: int = 1) -> list[str]:
    return [repr(outcome) for outcome in LaneEngine(threads, load).run(mixed(), MIXED_S)]


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_bits_do_not_depend_on_the_number_of_lanes(expected: list[str], lanes: int) -> None:
    assert _outcomes(partial(library.load, lanes)) == expected


@pytest.mark.parametrize("chosen", SETS, ids=[one.name for one in SETS])
def test_bits_do_not_depend_on_the_instruction_set(expected: list[str], chosen: InstructionSet) -> None:
    if chosen not in here():
        pytest.skip(f"this processor has no {chosen.name}")
    assert _outcomes(partial(library.load, library.LANES, chosen)) == expected


def test_bits_do_not_depend_on_the_compiler(expected: list[str], tmp_path: Path) -> None:
    compiler = shutil.which("clang")
    if compiler is None:
        pytest.skip("no clang here: apt install clang")
    made = tmp_path / "liblanes.so"
    root = build.sources()
    command = [compiler, "-std=c11", "-Werror", *library.flags_for(here()[0], library.LANES)]
    source = root / "boards/simlib/lanes.c"
    subprocess.run([*command, f"-I{root / 'core'}", "-o", str(made), str(source)], check=True)
    assert _outcomes(partial(library.load_file, made, library.LANES)) == expected


def test_bits_do_not_depend_on_threads(expected: list[str]) -> None:
    assert _outcomes(partial(library.load), threads=2) == expected


@pytest.mark.parametrize("name", REPEATED)
def test_some_runs_are_repeated_by_the_plain_loop(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rigs = [*drawn(1, REPEATED[name]), *drawn(1, ())]
    repeated: list[int] = []

    class _Counted(PlainLoop):
        def run(self, rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
            repeated.append(len(rigs))
            return super().run(rigs, duration_s)

    monkeypatch.setattr(engine, "PlainLoop", _Counted)
    assert not unequal(LaneEngine(), rigs, 0.5)
    assert sum(repeated) == 1


def test_many_runs_that_have_nothing_in_common_go_in_single_lanes() -> None:
    rigs = [rig_of(f"reference.amplitude_rad={0.5 + 0.01 * k:g}") for k in range(64)]
    asked = []

    def single() -> Lanes:
        asked.append(1)
        return library.load(1)

    assert LaneEngine(single=single).run(rigs, 0.05) == LaneEngine(single=library.load).run(rigs, 0.05)
    assert len(asked) == len(rigs)
