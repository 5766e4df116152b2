"""Search for the module of a `module:Class`: installed, beside the rig file, or in the current folder.

Nothing is run here: a package is looked into as files, its `__init__` is not imported.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.error_text import shown_path

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from pathlib import Path
    from types import ModuleType


_PACKAGES = ("dcmp_hil", "sim_backend")  # they run already: a checkout in the current folder is no second one


class Place(NamedTuple):
    """Location of a module.

    Parameters
    ----------
    specs
        Of the packages that it is in, outermost first, and of the module itself if it is there.
    whole
        Whether the module itself is there.
    installed
        Whether Python finds it by itself.
    """

    specs: tuple[ModuleSpec, ...]
    whole: bool
    installed: bool

    @property
    def where(self) -> str:
        """The file or folder of the outermost package or module."""
        top = self.specs[0]
        if top.origin is not None:
            return top.origin
        return next(iter(top.submodule_search_locations or ()), top.name)


def locate(module: str, folders: Sequence[Path], said: str) -> Place | None:
    """Return the location of a module, without importing anything; None if it is not found.

    Parameters
    ----------
    module
        Dotted name.
    folders
        Searched beside what is installed.
    said
        Beginning of the message: the key, and what was got.

    Returns
    -------
    Place or None
        None if there is no such module.

    Raises
    ------
    ConfigError
        If there are two of that name: which one is meant is not guessed.
    """
    importlib.invalidate_caches()  # the file may have been written a moment ago
    parts = module.split(".")
    others = () if parts[0] in _PACKAGES else _absolute(folders)
    searched = [_place(parts, None), *(_place(parts, [folder]) for folder in others)]
    places = {os.path.realpath(place.where): place for place in reversed(searched) if place is not None}
    if len(places) > 1:
        both = " and ".join(shown_path(place.where) for place in reversed(places.values()))
        raise ConfigError(f"{said}, but {parts[0]} is there twice: {both}. Rename yours, in the rig, too.")
    return next(iter(places.values()), None)


def load(module: str, place: Place | None) -> ModuleType:
    """Import a module from where it was located; anything that its code raises passes."""
    top = module.partition(".")[0]
    if place is not None and not place.installed and top not in sys.modules:
        _load_top(top, place.specs[0])
    return importlib.import_module(module)


def _load_top(name: str, spec: ModuleSpec) -> None:
    """Import one module or package from its folder; the folder does not become searched for others."""
    made = importlib.util.module_from_spec(spec)
    sys.modules[name] = made
    try:
        if spec.loader is not None:
            spec.loader.exec_module(made)
    except BaseException:
        sys.modules.pop(name, None)
        raise


def _absolute(folders: Sequence[Path]) -> list[str]:
    """Return the folders that there are: Python would remember a relative one when we are elsewhere."""
    found = []
    for folder in folders:
        try:
            found.append(str(folder.resolve()))
        except OSError:  # such as a current folder that was removed
            continue
    return found


def _place(parts: Sequence[str], path: list[str] | None) -> Place | None:
    specs: list[ModuleSpec] = []
    inside = path
    for depth in range(1, len(parts) + 1):
        spec = _spec(".".join(parts[:depth]), inside)
        if spec is None:
            break
        specs.append(spec)
        inside = list(spec.submodule_search_locations or [])
    if not specs:
        return None
    whole = len(specs) == len(parts) and specs[-1].origin is not None
    if specs[0].origin is None and not whole:  # a folder that happens to have this name
        return None
    return Place(tuple(specs), whole, installed=path is None)


def _spec(name: str, path: list[str] | None) -> ModuleSpec | None:
    if path is not None:
        return PathFinder.find_spec(name, path)
    try:
        return importlib.util.find_spec(name)
    except (AttributeError, ImportError, ValueError):  # ValueError: a module that was made by hand has none
        return None
