"""The classes of the user's own that a rig names, looked at without running them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.backends import CustomBackend
from dcmp_hil.config.sections import Custom
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.roles import BACKEND, CONTROLLER, OBSERVER
from dcmp_hil.plugins.static_check import look_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.plugins.roles import Role


def check_named(rig: Rig) -> None:
    """Check that every class that the rig names exists and could be made.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    faults: list[str] = []
    for role, section in _named(rig):
        options = () if isinstance(section, CustomBackend) else section.options
        try:
            look_at(section.kind, role, rig.plugin_folders, options)
        except ConfigError as error:
            faults += error.faults
    if faults:
        raise ConfigError(*faults)


def names_a_class(rig: Rig) -> bool:
    """Whether the rig names a class of the user's own."""
    return any(True for _ in _named(rig))


def _named(rig: Rig) -> Iterator[tuple[Role, Custom]]:
    for role, section in ((BACKEND, rig.backend), (OBSERVER, rig.observer), (CONTROLLER, rig.controller)):
        if isinstance(section, Custom):
            yield role, section
