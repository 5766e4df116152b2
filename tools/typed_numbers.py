"""`make numbers`: random numbers typed into rig.toml (outside [sim]) and `set`; no arm may leave its limits.

Every number is drawn from what its key may hold by the schema: an end of its range, anything in it by
decades, or something near what the key has by default. A rig of the kind that has the key runs 5 s in
virtual time, from the number on or with the number set at a random instant. Refusing is allowed, tripping by
``travel`` or ``speed`` is not, and the simulated arm itself may not pass the rig's limits.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.config import Rig, load_rig
from dcmp_hil.config.rules import within_reason
from dcmp_hil.errors import ConfigError, DcmpError, TripError
from dcmp_hil.ipc.mailbox import Mailbox
from dcmp_hil.live.tunables import changed, settable
from dcmp_hil.session import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.control.change import Change

_RUN_DURATION_S = 5.0  # s, of a run
_KINDS = (
    ("reference.kind=sine",),
    ("reference.kind=chirp",),
    ("reference.kind=hold",),
    ("reference.kind=step", "reference.at_s=1.5"),
    ("reference.kind=trapezoid",),
    ("observer.kind=paper",),
    ("controller.kind=pd",),
)
_TABLES = ("loop", "encoder", "amplifier", "model", "observer", "controller", "reference", "supervisor",
           "timing", "run")  # fmt: skip
_SET_SHARE = 0.4  # of all numbers are set in a run
_RANGE_END_SHARE = 0.15  # of all numbers are ends of a range
_DECADES_SHARE = 0.5  # up to there, anything in the range by decades
_UNBOUNDED_MAX = 1e12  # of a key without a bound
_DECADES_MIN = 1e-6
_LIMIT_RATIO_MAX = 1.001  # times a limit: a sample may be that far on before the trip


class Typed(NamedTuple):
    """A number, and the place where it is typed."""

    kinds: tuple[str, ...]
    override: str
    at: float | None  # s, when it is set; None: it is in rig.toml


class Outcome(NamedTuple):
    """Result of typing a number."""

    end: str  # "refused", "not taken", "ended normally", or the reason of a trip
    position: float  # of the limit, the arm's own largest
    speed: float

    @property
    def accepted(self) -> bool:
        """Whether it was taken and ran the whole time."""
        return self.end == "ended normally"

    @property
    def bad(self) -> bool:
        """Whether the arm left its limits."""
        return self.end in ("travel", "speed") or max(self.position, self.speed) > _LIMIT_RATIO_MAX


def draw(rng: random.Random) -> Typed:
    """Draw a number: a key of a rig of some kind, and what it may hold."""
    kinds = rng.choice(_KINDS)
    rig = load_rig("bench-1khz", kinds)
    if rng.random() < _SET_SHARE:
        keys = [key for key in settable(rig) if not key.endswith(".kind")]
        key, at = rng.choice(keys), rng.uniform(0.05, _RUN_DURATION_S - 1.0)
    else:
        key, at = rng.choice(list(_numeric(rig))), None
    return Typed(kinds, f"{key}={_number(rig, key, rng)}", at)


def _numeric(rig: Rig) -> Iterator[str]:
    for table in _TABLES:
        section = getattr(rig, table)
        schema = type(section).model_json_schema()["properties"]
        for name in type(section).model_fields:
            kinds = [one for one in (schema[name], *schema[name].get("anyOf", ())) if "enum" not in one]
            if {one.get("type") for one in kinds} & {"number", "integer"}:
                yield f"{table}.{name}"


def _number(rig: Rig, key: str, rng: random.Random) -> str:
    table, name = key.split(".")
    section = getattr(rig, table)
    described = type(section).model_json_schema()["properties"][name]
    merged = {k: v for one in (described, *described.get("anyOf", ())) for k, v in one.items()}
    whole = "integer" in {one.get("type") for one in (described, *described.get("anyOf", ()))}
    low, high = within_reason(type(section), name)
    low = max(low, merged.get("minimum", low))
    high = min(high, merged.get("maximum", high), _UNBOUNDED_MAX)
    low = max(low, -_UNBOUNDED_MAX)
    value = getattr(section, name)
    usual = float(value) if isinstance(value, int | float) and value else math.sqrt(_between(low, high))
    way = rng.choice((-1.0, 1.0)) if low < 0.0 else 1.0
    how = rng.random()
    if how < _RANGE_END_SHARE:
        number = rng.choice((low, high))
    elif how < _DECADES_SHARE:
        number = way * 10.0 ** rng.uniform(math.log10(max(low, _DECADES_MIN)), math.log10(high))
    else:
        number = way * usual * 10.0 ** rng.gauss(0.0, 0.5)
    number = min(max(number, low), high)
    return str(round(number)) if whole else repr(float(f"{number:.6g}"))


def _between(low: float, high: float) -> float:
    return max(low, 1e-2) * min(high, 1e2)


class _Setter:
    """Puts a change into the mailbox of a run at an instant of device time."""

    def __init__(self) -> None:
        self.mailbox = Mailbox()
        self.signals, self.file, self.unattended = -1, None, None

    def open(
        self, rig: Rig, ring: int | None, warn: Callable[[str], None], further: tuple[str, ...] = ()
    ) -> None:
        """Nothing to start."""

    def wait_until_up(self, stopped: Callable[[], bool]) -> None:
        """Nothing to wait for."""

    def close(self, last_words: str, end: int) -> None:
        """Nothing to end."""


def judge(typed: Typed) -> Outcome:
    """Type the number; return the result."""
    nothing = Outcome("refused", 0.0, 0.0)
    try:
        rig = load_rig("bench-1khz", typed.kinds if typed.at is not None else (*typed.kinds, typed.override))
        change = changed(rig, [typed.override])[1] if typed.at is not None else None
        setter = _Setter()
        session = Session(rig, duration=_RUN_DURATION_S, fast=True, control=setter)
    except ConfigError:
        return nothing
    if change is not None:
        _set_at(session, setter.mailbox, change, typed.at or 0.0)
    end = "ended normally"
    try:
        session.run()
    except TripError as trip:
        end = trip.reason
    except ConfigError:
        return nothing
    except DcmpError as error:
        end = type(error).__name__
    columns = session.result().columns
    x = np.abs(columns["position_true_rad"]).max(initial=0.0) / rig.supervisor.position_limit_rad
    v = np.abs(columns["velocity_true_rad_s"]).max(initial=0.0) / rig.supervisor.velocity_limit_rad_s
    return Outcome(end, float(x), float(v))


def _set_at(session: Session, mailbox: Mailbox, change: Change, at: float) -> None:
    backend = session._stages.backend  # noqa: SLF001 - the only place that knows device time
    read = backend.read

    def reading() -> object:
        sample = read()
        if sample.t >= at and not mailbox.words[0]:
            mailbox.put(change)
        return sample

    backend.read = reading  # type: ignore[assignment,method-assign]


def main() -> int:
    """Draw and judge; 1 if an arm left its limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verbose", action="store_true")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)  # noqa: S311 - a seed, no secret
    ends: Counter[str] = Counter()
    accepted = bad = 0
    for _ in range(arguments.count):
        typed = draw(rng)
        outcome = judge(typed)
        ends[outcome.end] += 1
        bad += outcome.bad
        accepted += outcome.accepted
        if outcome.bad or (arguments.verbose and not outcome.accepted):
            _say(f"{'BAD ' if outcome.bad else ''}{typed} {outcome}")
    _say(
        f"{arguments.count} numbers: {bad} arms left their limits, {accepted} ran {_RUN_DURATION_S:g} s; "
        "ends: " + ", ".join(f"{end} {n}" for end, n in ends.most_common())
    )
    return int(bad > 0 or accepted < arguments.count / 3)


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
