"""Backends and listeners by the kind of `[backend]`: read from the settings of each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.backends import BackendSettings
from dcmp_hil.config.rig import KINDS

if TYPE_CHECKING:
    from collections.abc import Mapping

_SETTINGS = {kind: one for kind, one in KINDS["backend"].items() if issubclass(one, BackendSettings)}

BACKENDS: Mapping[str, str] = {kind: one.factory for kind, one in _SETTINGS.items()}
"""`module:factory` of every backend; a factory takes (rig, clock)."""

LISTENERS: Mapping[str, str] = {kind: one.listener for kind, one in _SETTINGS.items() if one.listener}
"""`module:factory` of every link that one can listen to; a factory takes (settings, clock)."""
