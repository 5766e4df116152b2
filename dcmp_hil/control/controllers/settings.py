"""Base of the settings of a controller: they make it, and state what the rest of the package asks of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.section import Section

if TYPE_CHECKING:
    from dcmp_hil.control.controllers import Controller, ControllerContext


class ControllerSettings(Section, ABC):
    """The settings of a kind of `[controller]`; its words are those of the field `kind`."""

    if TYPE_CHECKING:

        @property
        def kind(self) -> str:
            """The word in rig.toml; each kind has a field of this name."""
            ...

        @property
        def position(self) -> str:
            """`estimated` or `measured`: the position that it gets; each kind has a field of this name."""
            ...

    @abstractmethod
    def build(self, context: ControllerContext) -> Controller:
        """Make the controller for a rig."""

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run; if there are any, the controller has `gains`."""
        return ()

    @property
    def gains(self) -> NamedTuple | None:
        """Numbers to which the controller's `gains` are ramped in a run; None if it has none."""
        return None

    @property
    def feeds_friction_forward(self) -> bool:
        """Whether the friction of `[model]` is a known input of the observer."""
        return False

    def warning(self) -> str:
        """Return a warning of settings that are valid and rarely intended; empty without one."""
        return ""
