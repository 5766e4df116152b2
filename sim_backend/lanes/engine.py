"""The engine of a sweep that runs in lanes of the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.errors import OpenError
from dcmp_hil.sweeping.plain_loop import PlainLoop
from sim_backend.lanes import refusal
from sim_backend.lanes.block_group import GroupKey, Mode, key_of
from sim_backend.lanes.group_run import run_group
from sim_backend.lanes.library import LANES, load, load_single
from sim_backend.lanes.outcome import DISTURBANCE, likely_cause, outcomes_of, samples_kept

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.sweeping.engine import RunOutcome
    from sim_backend.lanes.group_run import GroupResult
    from sim_backend.lanes.library import Lanes

_ALONE_MAX = 2  # runs of a group, for which a block of many lanes is slower than one lane
_APART_MIN = 64  # such runs, for which one more library is compiled
_BY_LOOP, _WITH_EXACT = 1.0, 2.0  # how a run has to be repeated: lanes.h


class LaneEngine:
    """Runs of a sweep side by side, in lanes of the core.

    A run in which something happens that lanes do not do, such as a reference that must be led, is repeated
    by the plain loop.

    Parameters
    ----------
    threads
        Blocks of lanes that run at the same time.
    library
        Loads the lanes; it may raise OpenError, which is a refusal.
    single
        Loads a library of one lane, for many runs that have nothing in common.
    """

    def __init__(
        self,
        threads: int = 1,
        library: Callable[[], Lanes] = load,
        single: Callable[[], Lanes] = load_single,
    ) -> None:
        self._threads, self._library, self._single = threads, library, single
        self._lanes: Lanes | None = None
        self._fault = ""

    def refusal(self, rig: Rig) -> str:
        """Return why lanes cannot run a rig, in a sentence with the remedy; empty if they can."""
        return refusal.refusal(rig) or self._missing()

    def run(self, rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
        """Run rigs, none of which is refused, for `duration_s` (s) each.

        Raises
        ------
        OpenError
            If the lanes cannot be compiled or loaded.
        """
        groups: dict[GroupKey, list[int]] = {}
        for number, rig in enumerate(rigs):
            groups.setdefault(key_of(rig), []).append(number)
        found: dict[int, RunOutcome] = {}
        apart = sum(len(numbers) for numbers in groups.values() if len(numbers) <= _ALONE_MAX)
        for numbers in groups.values():
            alone = len(numbers) <= _ALONE_MAX and apart >= _APART_MIN
            lanes = self._single() if alone else self._loaded()
            self._run_group(lanes, rigs, numbers, duration_s, Mode(), found)
        return [found[number] for number in range(len(rigs))]

    def _run_group(
        self,
        lanes: Lanes,
        rigs: Sequence[Rig],
        numbers: Sequence[int],
        duration_s: float,
        mode: Mode,
        found: dict[int, RunOutcome],
    ) -> None:
        """Find the outcomes of some rigs with equal keys, by their numbers."""
        chosen = [rigs[number] for number in numbers]
        result = run_group(lanes, chosen, duration_s, mode, self._threads)
        found.update(zip(numbers, outcomes_of(result, len(numbers)), strict=True))
        repeats, causes = result.of("repeat"), result.of("cause")
        by_loop = [number for k, number in enumerate(numbers) if repeats[k] == _BY_LOOP]
        plain = PlainLoop().run([rigs[number] for number in by_loop], duration_s)
        found.update(zip(by_loop, plain, strict=True))
        exact = [number for k, number in enumerate(numbers) if repeats[k] == _WITH_EXACT]
        if exact:
            self._run_group(lanes, rigs, exact, duration_s, mode._replace(exact_chatter=True), found)
        unknown = [k for k in range(len(numbers)) if causes[k] == DISTURBANCE and not repeats[k]]
        if mode.kept:
            self._find_causes(chosen, [(k, numbers[k]) for k in unknown], result, found)
        elif unknown:
            kept = mode._replace(kept=samples_kept(chosen[0]))
            self._run_group(lanes, rigs, [numbers[k] for k in unknown], duration_s, kept, found)

    @staticmethod
    def _find_causes(
        rigs: Sequence[Rig],
        lanes: Sequence[tuple[int, int]],
        result: GroupResult,
        found: dict[int, RunOutcome],
    ) -> None:
        """Replace "disturbance" by the likely cause, for lanes and the numbers of their runs."""
        assert result.kept is not None  # noqa: S101 - asked for
        width = result.kept.shape[-1]
        for lane, number in lanes:
            outcome = found[number]
            kept = result.kept[lane // width, :, :, lane % width]
            found[number] = outcome._replace(trip_cause=likely_cause(rigs[lane], kept, outcome.periods))

    def _loaded(self) -> Lanes:
        if self._lanes is None:
            self._lanes = self._library()
        return self._lanes

    def _missing(self) -> str:
        """Return why there are no lanes on this computer; looked at once."""
        if self._lanes is None and not self._fault:
            try:
                self._loaded()
            except OpenError as error:
                self._fault = str(error)
        return self._fault


__all__ = ["LANES", "LaneEngine"]
