"""Facts of a sweep that are found out before it starts: its rig, engines, time and bytes."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from dcmp_hil.config.load import load_rig
from dcmp_hil.config.overrides import apply_values
from dcmp_hil.config.tables import RigTables
from dcmp_hil.config.validation_errors import explain_faults
from dcmp_hil.errors import ConfigError
from dcmp_hil.fault_hooks import inject
from dcmp_hil.platform.clock import cpu_ns
from dcmp_hil.sweeping.block_work import BlockWork, assigned
from dcmp_hil.sweeping.design import SweepDesign, override
from dcmp_hil.sweeping.engine import LANES, PLAIN
from dcmp_hil.sweeping.parts import PART_BYTES, ROW_BYTES, VALUE_BYTES, schema_of
from dcmp_hil.sweeping.variants import Refusal, variants

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.sweeping.spec import Scalar, SweepSpec

_CHECKED_MAX = 1000  # values of a key of the grid
_SAMPLED_RUNS = 128  # that are looked at for engines and refusals
_TIMED_CPU_S = 0.1  # s of work after which the timing of an engine ends
_TIMED_PLAIN_S = (0.25, 1.0)  # s of device time: its cost is a start and so much a second
_LANES_TOGETHER = 64  # runs: fewer cost as much
_BLOCK_CPU_S = 1.0
_BLOCKS_PER_WORKER = 10
_PARTS_MAX = 20_000


class EngineShare(NamedTuple):
    """The part of a sweep that one engine runs."""

    engine: str
    share: float
    """Of all runs; 0 to 1."""
    reasons: tuple[str, ...]
    """Why the faster engines do not."""
    cpu_s: float
    """CPU time of a run, s."""


@dataclass(frozen=True)
class PreparedSweep:
    """A sweep that can start.

    Parameters
    ----------
    work
        What its blocks are.
    design
        From the number of a run to its values.
    shares
        Engines of the sampled runs.
    refused
        Share of the sampled runs that the rules refuse.
    schema
        Columns of the results.
    """

    work: BlockWork
    design: SweepDesign
    shares: tuple[EngineShare, ...]
    refused: float
    schema: Any

    @property
    def cpu_s_per_run(self) -> float:
        """CPU time of a run on average, s."""
        return sum(one.share * one.cpu_s for one in self.shares)

    @property
    def cpu_s(self) -> float:
        """CPU time of all runs, s."""
        return self.cpu_s_per_run * self.design.total

    def bytes_of(self, runs: int, runs_per_part: int) -> float:
        """Return the bytes that the results of so many runs take, at most."""
        row = ROW_BYTES + VALUE_BYTES * len(self.design.keys)
        return runs * row + math.ceil(runs / runs_per_part) * PART_BYTES

    def runs_per_part(self, workers: int, *, together: bool) -> int:
        """Return how many runs a block has: a second of work, and fewer if some workers would have none.

        With `together` the blocks of a cluster are meant, which have a second of work in any case.
        """
        total = self.design.total
        runs = math.ceil(_BLOCK_CPU_S / self.cpu_s_per_run)
        if not together:
            runs = min(runs, math.ceil(total / (_BLOCKS_PER_WORKER * workers)))
        runs = max(runs, math.ceil(total / _PARTS_MAX))
        if any(one.engine == LANES for one in self.shares):
            runs = _LANES_TOGETHER * math.ceil(runs / _LANES_TOGETHER)
        return min(total, runs)


def prepare(spec: SweepSpec, place: str, *, plain: bool = False) -> PreparedSweep:
    """Find out everything about a sweep before it starts; it takes some tenths of a second of work.

    Parameters
    ----------
    spec
        Of the sweep.
    place
        First word of messages.
    plain
        Whether every run is made by the plain loop; else by the fastest engine that takes it.

    Raises
    ------
    ConfigError
        If a key or a value is none of the rig, or the rules refuse every run that was looked at.
    """
    base = _base(spec, place)
    _check_values(spec, base, place)
    design = SweepDesign(spec)
    work = BlockWork(spec, base, plain)
    step = max(1, design.total // _SAMPLED_RUNS)
    numbers = range(0, design.total, step)[: _SAMPLED_RUNS + 1]
    rigs = variants(base, (design.named(number) for number in numbers))
    shares, refused = _shares(work, numbers, rigs)
    return PreparedSweep(work, design, shares, refused, schema_of(design.keys, _examples(design, spec)))


def _base(spec: SweepSpec, place: str) -> Rig:
    """Return the rig of a sweep, with what `[set]` says."""
    try:
        rig = load_rig(spec.rig, [override(*one) for one in spec.set.items()])
    except ConfigError as error:
        raise ConfigError(*(_at_place(fault, f"{place}, set.") for fault in error.faults)) from None
    if spec.faults:
        inject(rig, spec.faults, f"{place}, faults:")
    if rig.backend.device and not rig.backend.simulated:
        raise ConfigError(
            f'{place}, rig: its backend.kind is "{rig.backend.kind}", a real device. Sweep a simulated rig: '
            'write backend.kind = "sim" into [set].'
        )
    return rig


def _at_place(fault: str, place: str) -> str:
    return place + fault.removeprefix("--set ") if fault.startswith("--set ") else fault


def _check_values(spec: SweepSpec, base: Rig, place: str) -> None:
    """Refuse keys that the rig has not, and values that a key alone cannot have.

    What a key cannot have together with others is a row of its own: the rules look at every run.
    """
    faults: dict[str, None] = {}
    for table, key, value in _values(spec):
        tables = base.model_dump(exclude_unset=True)
        where = f"{place} [{table}]"
        try:
            apply_values(tables, {tuple(key.split(".")): value})
            RigTables.model_validate(tables)
        except ValidationError as error:
            faults.update(dict.fromkeys(explain_faults(error, tables, where, ())))
        except ConfigError as error:
            faults.update(dict.fromkeys(_at_place(fault, f"{where}, ") for fault in error.faults))
    if faults:
        raise ConfigError(*faults)


def _values(spec: SweepSpec) -> Iterator[tuple[str, str, Scalar]]:
    """Yield table, key and value of every value of the grid, and of the ends of each distribution."""
    for key, axis in zip(spec.grid, spec.axes, strict=True):
        yield from (("grid", key, value) for value in axis[: _CHECKED_MAX - 1] + axis[-1:])
    for key, rule in spec.draw.items():
        ends: Sequence[Scalar] = rule.choice or (rule.normal or ())[:1]
        if (span := rule.uniform or rule.loguniform) is not None:  # the upper end itself is never drawn
            ends = (span[0], math.nextafter(span[1], span[0]))
        yield from (("draw", key, value) for value in ends)


def _examples(design: SweepDesign, spec: SweepSpec) -> list[Scalar]:
    """Return a value of each key, of the widest type that it has: a word, a number, a whole number."""
    lists = [*spec.axes, *(rule.choice or [1.0] for rule in spec.draw.values())]
    lists += [[1]] * (len(design.keys) - len(lists))
    return [max(values, key=_width) for values in lists]


def _width(value: Scalar) -> int:
    return 3 if isinstance(value, str) else 0 if isinstance(value, bool) else 1 + isinstance(value, float)


def _shares(
    work: BlockWork, numbers: Sequence[int], rigs: Sequence[Rig | Refusal]
) -> tuple[tuple[EngineShare, ...], float]:
    """Return the engines of sampled runs, timed, and the share of runs that are refused."""
    engines = work.engines()
    found: dict[str, list[int]] = {}
    reasons: dict[str, Counter[tuple[str, ...]]] = {}
    refusals: list[str] = []
    for number, rig in zip(numbers, rigs, strict=True):
        if isinstance(rig, Refusal):
            refusals.append(str(rig))
            continue
        one = assigned(rig, engines)
        if not one.engine:
            refusals.append(one.reasons[-1])
            continue
        found.setdefault(one.engine, []).append(number)
        reasons.setdefault(one.engine, Counter())[one.reasons] += 1
    if not found:
        raise ConfigError(f"no run of the sweep is possible; the first: {refusals[0]}")
    shares = [
        EngineShare(
            name, len(members) / len(numbers), reasons[name].most_common(1)[0][0], _cost(work, name, members)
        )
        for name, members in found.items()
    ]
    return tuple(sorted(shares, key=lambda one: one.engine)), len(refusals) / len(numbers)


def _cost(work: BlockWork, engine: str, numbers: Sequence[int]) -> float:
    """Return the CPU time of a run, s, by running a few."""
    length = work.spec.duration_s
    if engine == PLAIN and length > _TIMED_PLAIN_S[1]:
        work.rows(numbers[:1], _TIMED_PLAIN_S[0])  # imports
        short, long = (_timed(work, numbers[:1], seconds) for seconds in _TIMED_PLAIN_S)
        slope = max(0.0, long - short) / (_TIMED_PLAIN_S[1] - _TIMED_PLAIN_S[0])
        return long + slope * (length - _TIMED_PLAIN_S[1])
    most = len(numbers)
    count = 1 if engine == PLAIN else min(_LANES_TOGETHER, most)
    work.rows(numbers[:1], min(length, _TIMED_PLAIN_S[0]))  # compiles, or loads what is compiled
    while True:
        spent = _timed(work, numbers[:count], length)
        if spent >= _TIMED_CPU_S or count == most:
            return spent / count
        count = min(most, 8 * count)


def _timed(work: BlockWork, numbers: Sequence[int], seconds: float) -> float:
    begin = cpu_ns()
    work.rows(numbers, seconds)
    return max(1e-9 * (cpu_ns() - begin), 1e-7)
