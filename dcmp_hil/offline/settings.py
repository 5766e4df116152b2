"""Options of a replay: the observer's parameters, the inertia, and the judgement of the figures."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from dcmp_hil.common.number_range import NumberRange, number
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.rules import own_bounds, within_reason
from dcmp_hil.config.sections import Custom, ModelSection
from dcmp_hil.control.model import Model
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.named_class import split_named

if TYPE_CHECKING:
    from dcmp_hil.config.kinds import ObserverSection

InputKind = Literal["torque", "voltage", "none"]
_PAPER_MODEL = Model()
_CURRENT_FOLDER = Path()
PERIOD_RANGE = NumberRange(1e-6, 10.0)
"""s, of a nominal sampling period."""
_COUNTS_RANGE = NumberRange(4.0, 1e9)  # a revolution
IDEAL = "ideal"
"""`counts_per_rev` of an encoder without steps."""


@dataclass(frozen=True, kw_only=True)
class ReplaySettings:
    """Options of a replay; None takes the default that its line names.

    Raises
    ------
    ConfigError
        If a value is out of range; names every one that is.
    """

    observer: str | ObserverSection = "super_twisting"
    """A kind that `[observer]` takes, such as `super_twisting` (R1) or `paper` (R0); or `module:Class`, made
    as Class(context, **observer_options); or the table itself, which then says what the gains below say."""
    observer_options: dict[str, Any] = field(default_factory=dict)
    """What `module:Class` is made with, by keyword."""
    folders: tuple[Path, ...] = (_CURRENT_FOLDER,)
    """Where its module is looked for beside what is installed."""
    from_zero: bool = False
    """Whether the paper's observer begins at 0, as in the paper, and not at the first position."""
    model: Model = _PAPER_MODEL
    """What an observer of your own is told of the plant; `f0` and `ku` below come first."""
    f0: float | None = None
    """Viscous friction over inertia fd/J, 1/s; None: that of `model`, the paper's 0.1."""
    inertia: float | None = None
    """J, kg m2: turns a torque into the input u = torque / J. Required with a torque."""
    ku: float | None = None
    """ku/J, (rad/s2)/V: turns a voltage into u = ku V; None: 5.4, the paper's. Unused with a torque."""
    input_at: Literal["start", "end"] = "start"
    """Which row holds the input over [k-1, k): `start` is row k-1, `end` is row k."""
    counts_per_rev: float | Literal["ideal"] | None = None
    """Encoder counts a revolution, for the rule of mu0; None estimates it from the recording."""
    period: float | None = None
    """Nominal sampling period T, s; None takes the median step."""
    L1: float | None = None
    """Copy gain, 1/s; None: the observer's own default, 4.9 in those of the package."""
    L2: float | None = None
    """Copy gain, 1/s2; None: the observer's own default, 5.51 in those of the package."""
    M: float | None = None
    """Differentiator gain, rad/s3; None: 15 (1000 for an ideal encoder) in super_twisting, 1000 in paper."""
    mu0: float | None = None
    """Bandwidth floor of super_twisting, rad/s; None goes by the rule of `bandwidth_floor`."""
    start: float = 0.3
    """The figures count what is later than this after the first row and after every restart, s."""
    cutoff: float = 15.0
    """Corner of the zero-phase reference, Hz."""

    def __post_init__(self) -> None:
        """Check every number against its range."""
        faults = [
            f"{option}: got {number(value)}; expected {allowed.words(unit)}. {remedy}"
            for option, value, unit, allowed, remedy in self._ranges()
            if not allowed.holds(value)
        ]
        if self.input_at not in ("start", "end"):
            faults.append(f'--input-at: got "{self.input_at}". Write start (row k-1) or end (row k).')
        if self.mu0 is not None and self.observer == "paper":
            faults.append("--mu0: the paper's observer has no bandwidth floor. Leave the option out.")
        if self.observer_options and isinstance(self.observer, str) and ":" not in self.observer:
            faults.append("observer.options: only an observer of your own (module:Class) takes them.")
        if faults:
            raise ConfigError(*faults)

    @property
    def friction(self) -> float:
        """Return f0, 1/s."""
        return self.model.f0 if self.f0 is None else self.f0

    @property
    def kind(self) -> str:
        """Return the observer's name."""
        return self.observer if isinstance(self.observer, str) else self.observer.kind

    @property
    def section(self) -> ObserverSection:
        """Return the table of the observer: `[observer]` with the gains that are set.

        Raises
        ------
        ConfigError
            If there is no such kind.
        """
        if not isinstance(self.observer, str):
            return self.observer
        known = {kind: table for kind, table in KINDS["observer"].items() if kind != "custom"}
        if self.observer not in known:
            split_named(self.observer, "--observer", known)
            return Custom.model_construct(kind=self.observer, options=self.observer_options)
        table = known[self.observer]
        gains = {
            "L1_1_s": self.L1,
            "L2_1_s2": self.L2,
            "M_rad_s3": self.M,
            "mu0_rad_s": self.mu0,
            "start": "zero" if self.from_zero else None,
        }
        # What is not set is left to the kind: it may have a default of its own under the same name.
        keys = {key: value for key, value in gains.items() if key in table.model_fields and value is not None}
        return cast("ObserverSection", table.model_validate({"kind": self.observer, **keys}))

    def _bounds(self, key: str) -> NumberRange:
        """Return the bounds that rig.toml has for a key of the observer; infinite where it has none."""
        table = KINDS["observer"].get(self.kind)
        return (
            NumberRange(*within_reason(table, key)) if table and key in table.model_fields else NumberRange()
        )

    def _ranges(self) -> list[tuple[str, float, str, NumberRange, str]]:
        """Of those that are set: option, value, unit, range, remedy."""
        counts = None if self.counts_per_rev == IDEAL else self.counts_per_rev
        rows: list[tuple[str, float | str | None, str, NumberRange, str]] = [
            (
                "--f0",
                self.f0,
                "1/s",
                own_bounds(ModelSection, "f0_1_s"),
                "It is the viscous friction over the inertia.",
            ),
            ("--inertia", self.inertia, "kg m2", _above_zero(1e6), "Give J in kg m2."),
            (
                "--ku",
                self.ku,
                "(rad/s2)/V",
                own_bounds(ModelSection, "ku_rad_s2_V"),
                "It is ku/J, the acceleration of one volt.",
            ),
            ("--counts-per-rev", counts, "", _COUNTS_RANGE, "Give the counts after quadrature, or ideal."),
            ("--period", self.period, "s", PERIOD_RANGE, "Leave it out to take the median step."),
            ("--L1", self.L1, "1/s", self._bounds("L1_1_s"), "The paper's is 4.9."),
            ("--L2", self.L2, "1/s2", self._bounds("L2_1_s2"), "The paper's is 5.51."),
            ("--M", self.M, "rad/s3", self._bounds("M_rad_s3"), "Leave it out for the default."),
            ("--mu0", self.mu0, "rad/s", self._bounds("mu0_rad_s"), "Leave it out to go by the rule."),
            (
                "--from",
                self.start,
                "s",
                NumberRange(0.0, 1e9),
                "Write the seconds to leave out at the start.",
            ),
            ("--cutoff", self.cutoff, "Hz", _above_zero(1e5), "The usual one is 15 Hz."),
        ]
        return [
            (option, _number(value), unit, allowed, remedy)
            for option, value, unit, allowed, remedy in rows
            if value is not None
        ]


def _above_zero(high: float) -> NumberRange:
    return NumberRange(0.0, high, low_excluded=True)


def _number(value: float | str) -> float:
    try:
        return float(value)
    except ValueError:
        return math.nan  # in no range, so that it is named like any other fault
