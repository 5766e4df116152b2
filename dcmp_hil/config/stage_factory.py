"""The one place where observers and controllers are made from their tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.sections import Custom
from dcmp_hil.plugins.checked import CheckedController, CheckedObserver
from dcmp_hil.plugins.named_class import make_named
from dcmp_hil.plugins.roles import CONTROLLER, OBSERVER

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from dcmp_hil.config.kinds import ControllerSection, ObserverSection
    from dcmp_hil.control.controllers import Controller, ControllerContext
    from dcmp_hil.control.observers import Observer, ObserverContext


def observer_of(
    section: ObserverSection, context: ObserverContext, folders: Sequence[Path], key: str = OBSERVER.key
) -> Observer:
    """Make the observer that a table asks for.

    Parameters
    ----------
    section
        `[observer]`, of any kind.
    context
        The rig served.
    folders
        Where the module of a `module:Class` is looked for, besides installed packages.
    key
        The key or option that named it, for messages.

    Raises
    ------
    ConfigError
        If a class of the user's own is not found, or cannot be made.
    """
    if not isinstance(section, Custom):
        return section.build(context)
    role = OBSERVER._replace(key=key)
    made = make_named(section.kind, role, folders, (context,), section.options)
    return CheckedObserver(made, section.kind)


def controller_of(
    section: ControllerSection, context: ControllerContext, folders: Sequence[Path]
) -> Controller:
    """Make the controller that a table asks for; see `observer_of`.

    Raises
    ------
    ConfigError
        If a class of the user's own is not found, or cannot be made.
    """
    if not isinstance(section, Custom):
        return section.build(context)
    made = make_named(section.kind, CONTROLLER, folders, (context,), section.options)
    return CheckedController(made, section.kind)
