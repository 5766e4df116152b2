"""Base of the settings of an observer: they make it, and state what the rest of the package asks of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from dcmp_hil.common.section import Section

if TYPE_CHECKING:
    from dcmp_hil.control.observers import Observer, ObserverContext, Predictor


class ObserverLimits(NamedTuple):
    """Facts of the rig that limit the gains of an observer."""

    count_rad: float  # one count of the encoder; 0 for an ideal one
    velocity: float  # rad/s, at which a run trips
    torque: float  # rad/s2, that the motor has at the amplifier's limit


class ObserverSettings(Section, ABC):
    """The settings of a kind of `[observer]`; its words are those of the field `kind`."""

    if TYPE_CHECKING:

        @property
        def kind(self) -> str:
            """The word in rig.toml; each kind has a field of this name."""
            ...

    @abstractmethod
    def build(self, context: ObserverContext) -> Observer:
        """Make the observer for a rig."""

    def predictor(
        self,
        observer: Observer,  # noqa: ARG002
        context: ObserverContext,  # noqa: ARG002
        delay_samples: int,  # noqa: ARG002
        *,
        measured: bool,  # noqa: ARG002
    ) -> Predictor | None:
        """Return the observer's own predictor; None where `LinearPredictor` serves it.

        Parameters
        ----------
        observer
            As `build` returned it.
        context
            The rig served.
        delay_samples, measured
            As for `LinearPredictor`.
        """
        return None

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run; if there are any, the observer has `retune`."""
        return ()

    @classmethod
    def at_start(cls) -> tuple[str, ...]:
        """Return the keys that act at the start of a run only: a change of one waits for the next start."""
        return ()

    @classmethod
    def diagnosis(cls) -> tuple[str, ...]:
        """Return the names of what the observer diagnoses of itself; see `DiagnosedObserver`."""
        return ()

    def tuning(self, context: ObserverContext) -> object:  # noqa: ARG002
        """Return what the observer's `retune` takes: small, and without pydantic."""
        return None

    def by_rule(self, name: str, context: ObserverContext) -> float | None:  # noqa: ARG002
        """Return what the rule makes of a key that was left out; None where there is no rule."""
        return None

    @property
    def knows_friction(self) -> bool:
        """Whether the friction of `[model]` is part of the observer's own prediction."""
        return False

    def warning(self, context: ObserverContext) -> str:  # noqa: ARG002
        """Return a warning of settings that are valid and rarely intended; empty without one."""
        return ""

    def fault(self, context: ObserverContext, limits: ObserverLimits) -> str:  # noqa: ARG002
        """Return why these gains must not be used on that rig, with the remedy; empty if they may be."""
        return ""


class OneGainSettings(ObserverSettings):
    """Settings of an observer with one gain, which may change in a run: its `retune` takes the new value."""

    gain: ClassVar[str]
    """Name of the key."""

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the gain, which may change in a run."""
        return (cls.gain,)

    def tuning(self, context: ObserverContext) -> float:  # noqa: ARG002
        """Return the gain's value."""
        return float(getattr(self, self.gain))
