"""Finding a class that rig.toml names as `module:Class`."""

from __future__ import annotations

import importlib
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, cast

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


def find_named(path: str, key: str, known: Iterable[str] = ()) -> Callable[..., Any]:
    """Import what `path` means.

    Parameters
    ----------
    path
        `module:Name`.
    key
        The key of rig.toml that says so, for the message.
    known
        Names that would have been understood without a module.

    Raises
    ------
    ConfigError
        If the module cannot be imported or has no such name.
    """
    module_name, colon, name = path.partition(":")
    if not colon:
        close = get_close_matches(path, list(known), n=1)
        hint = (
            f'Did you mean "{close[0]}"?' if close else f"Write one of {', '.join(known)}, or module:Class."
        )
        raise ConfigError(f'{key}: got "{path}", which is unknown. {hint}')
    if not all(part.isidentifier() for part in module_name.split(".")):
        raise ConfigError(f'{key}: got "{path}"; expected module:Class, such as my_lab.rig:Motor.')
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        raise ConfigError(
            f'{key}: got "{path}", but importing {module_name} failed: {error}. '
            "Install the package, or start from the folder that holds the module."
        ) from error
    found = getattr(module, name, None)
    if not callable(found):
        names = [other for other in vars(module) if not other.startswith("_")]
        close = get_close_matches(name, names, n=1)
        hint = f" Did you mean {close[0]}?" if close else ""
        raise ConfigError(f'{key}: got "{path}", but {module_name} has no class {name}.{hint}')
    return cast("Callable[..., Any]", found)
