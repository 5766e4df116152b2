"""The work of one block of a sweep: rigs, the engine of each, figures."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, cast

from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.named_class import find_named
from dcmp_hil.sweeping.design import SweepDesign
from dcmp_hil.sweeping.engine import ENGINES, LANES, PLAIN, RunOutcome
from dcmp_hil.sweeping.plain_loop import PlainLoop
from dcmp_hil.sweeping.variants import Refusal, variants

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.sweeping.engine import SweepEngine
    from dcmp_hil.sweeping.executor import SweepBlock
    from dcmp_hil.sweeping.spec import Scalar, SweepSpec


class RunRow(NamedTuple):
    """One run of a sweep."""

    run: int
    values: tuple[Scalar, ...]
    """Of the keys of the design."""
    engine: str
    """Name of the engine; empty for a run that was refused."""
    refused: str
    """Sentence of the rule that refuses these values; empty for none."""
    outcome: RunOutcome


class Assignment(NamedTuple):
    """The engine that a rig goes to, and what the engines before it said."""

    engine: str
    reasons: tuple[str, ...]


NO_OUTCOME = RunOutcome(periods=0)
"""Outcome of a run that was refused."""


@dataclass(frozen=True)
class BlockWork:
    """Runs blocks of a sweep; can be pickled, and always gives the same for the same block.

    Parameters
    ----------
    spec
        Of the sweep.
    base
        Its rig, `[set]` included.
    plain
        Whether every run is made by the plain loop; else by the first engine that takes it.
    """

    spec: SweepSpec
    base: Rig
    plain: bool = False

    def __call__(self, block: SweepBlock) -> list[RunRow]:
        """Return a row for each run of a block, in their order."""
        return self.rows(range(block.first, block.first + block.runs), self.spec.duration_s)

    def rows(self, runs: Sequence[int], duration_s: float) -> list[RunRow]:
        """Return a row for each of some runs, each of them `duration_s` (s) long."""
        design, engines = SweepDesign(self.spec), self.engines()
        values = [design.values(run) for run in runs]
        rigs = variants(self.base, (dict(zip(design.keys, one, strict=True)) for one in values))
        groups: dict[str, list[int]] = defaultdict(list)
        found = [RunRow(run, one, "", "", NO_OUTCOME) for run, one in zip(runs, values, strict=True)]
        for place, rig in enumerate(rigs):
            name, reasons = ("", (str(rig),)) if isinstance(rig, Refusal) else assigned(rig, engines)
            if name:
                groups[name].append(place)
            else:
                found[place] = found[place]._replace(refused=reasons[-1])
        for name, places in groups.items():
            outcomes = engines[name].run([cast("Rig", rigs[place]) for place in places], duration_s)
            for place, outcome in zip(places, outcomes, strict=True):
                found[place] = found[place]._replace(engine=name, outcome=outcome)
        return found

    def engines(self) -> dict[str, SweepEngine]:
        """Return the engines, the fastest first; one that must not be used refuses every rig."""
        lanes: SweepEngine
        if self.spec.faults:
            lanes = NoEngine("Faults are injected, which lanes do not have.")
        elif self.plain:
            lanes = NoEngine("--plain asks for it.")
        else:
            lanes = _lanes()
        return {LANES: lanes, PLAIN: PlainLoop(self.spec.faults)}


def assigned(rig: Rig, engines: Mapping[str, SweepEngine]) -> Assignment:
    """Return the engine of a rig, the first that does not refuse it: none if all do."""
    reasons: list[str] = []
    for name, engine in engines.items():
        reason = engine.refusal(rig)
        if not reason:
            return Assignment(name, tuple(reasons))
        reasons.append(reason)
    return Assignment("", tuple(reasons))


class NoEngine:
    """Stands for an engine that cannot be used.

    Parameters
    ----------
    sentence
        Why.
    """

    def __init__(self, sentence: str) -> None:
        self._sentence = sentence

    def refusal(self, _: Rig) -> str:
        """Return why."""
        return self._sentence

    @staticmethod
    def run(rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
        """Return nothing: every rig is refused."""
        raise NotImplementedError(f"{len(rigs)} runs of {duration_s} s, all of which are refused")


def _lanes() -> SweepEngine:
    try:
        made: SweepEngine = find_named(ENGINES[LANES], f"engine {LANES}")()
    except ConfigError:
        return NoEngine("The lanes in C are not part of this installation.")
    return made
