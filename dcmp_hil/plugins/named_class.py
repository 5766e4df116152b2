"""Classes that rig.toml names as `module:Class`: found, made, and looked at without running them."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.errors import ConfigError, DcmpError
from dcmp_hil.plugins.error_text import file_of, message_of, place_of, place_of_code, shown_folder, syntax_of
from dcmp_hil.plugins.module_search import Place, load, locate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from types import ModuleType

    from dcmp_hil.plugins.roles import Role


def find_named(
    path: str, key: str, known: Iterable[str] = (), folders: Sequence[Path] = ()
) -> Callable[..., Any]:
    """Import the class or function that `module:Name` names.

    Parameters
    ----------
    path
        `module:Name`.
    key
        The key of rig.toml that says so, for the message.
    known
        Names that would have been understood without a module.
    folders
        Where the module is looked for beside what is installed. They do not become importable: only this
        module, or the package that it is in, is taken from there.

    Raises
    ------
    ConfigError
        If the module is not there, there twice, cannot be imported, or has no such name.
    """
    module_name, name, said = split_named(path, key, known)
    place = locate(module_name, folders, said)
    module = _imported(module_name, place, said, folders)
    try:
        found = getattr(module, name, None)
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{said}, but {_failed(error, module_name, place)}") from error
    if not callable(found):
        raise ConfigError(no_such_class(said, module_name, name, vars(module)))
    return cast("Callable[..., Any]", found)


def make_named(
    path: str, role: Role, folders: Sequence[Path], arguments: Sequence[object], options: Mapping[str, Any]
) -> Any:
    """Import a class and return an instance of it.

    Raises
    ------
    ConfigError
        If it is not there, cannot be made, or has not the methods of its role.
    """
    return make(find_named(path, role.key, folders=folders), path, role, arguments, options)


def make(
    factory: Callable[..., Any],
    path: str,
    role: Role,
    arguments: Sequence[object],
    options: Mapping[str, Any],
) -> Any:
    """Make one of a class that was found; see `make_named`."""
    try:
        made = factory(*arguments, **options)
    except DcmpError:
        raise
    except (Exception, SystemExit) as error:
        where = place_of(error, file_of(factory))
        if not where:  # it was never reached: the arguments do not fit
            where = place_of_code(getattr(factory, "__init__", factory)) or place_of_code(factory)
            hint = f" It is called as {role.call}."
        else:
            hint = " Correct it there."
        at = f" ({where})" if where else ""
        raise ConfigError(f"{role.key}: {path} could not be made: {message_of(error)}{at}.{hint}") from error
    fault = _lacks(made, role)
    if fault:
        where = place_of_code(type(made))
        raise ConfigError(f"{role.key}: {path}{f' ({where})' if where else ''} {fault}")
    return made


def split_named(path: str, key: str, known: Iterable[str] = ()) -> tuple[str, str, str]:
    """Return module, name, and the beginning of a message about them.

    Raises
    ------
    ConfigError
        If `path` is no `module:Name`.
    """
    known = list(known)
    said = f'{key}: got "{path}"'
    module_name, colon, name = path.partition(":")
    if not colon:
        hint = did_you_mean(path, known, f"Write one of {', '.join(known)}, or module:Class.")
        raise ConfigError(f"{said}, which is unknown. {hint}")
    if not all(part.isidentifier() for part in module_name.split(".")):
        raise ConfigError(f"{said}; expected module:Class, such as my_lab.rig:Motor.")
    return module_name, name, said


def no_such_class(said: str, module: str, name: str, names: Iterable[str]) -> str:
    """Return the error that a module has no such class, with similar names."""
    hint = did_you_mean(name, [other for other in names if not other.startswith("_")], shown=str)
    return f"{said}, but {module} has no class {name}.{hint and ' '}{hint}"


def not_found(said: str, module: str, folders: Sequence[Path], error: ImportError | None = None) -> str:
    """Return the error that there is no such module, with the places that were searched."""
    sentence = f"{said}, but importing {module} failed: {error or f'No module named {module!r}'}."
    if not folders:
        return f"{sentence} Install the package."
    where = " and ".join(dict.fromkeys(shown_folder(folder) for folder in folders))
    return (
        f"{sentence} It is not installed, and not in {where}. Install the package, or put the module beside "
        "the rig file or into the current folder."
    )


def _imported(name: str, place: Place | None, said: str, folders: Sequence[Path]) -> ModuleType:
    try:
        return load(name, place)
    except SyntaxError as error:
        raise ConfigError(f"{said}, but {syntax_of(error)}. Correct it there.") from error
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            raise ConfigError(not_found(said, name, folders, error)) from error
        raise ConfigError(f"{said}, but {_failed(error, name, place)} {_missing(error, place)}") from error
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{said}, but {_failed(error, name, place)}") from error


def _failed(error: BaseException, module: str, place: Place | None) -> str:
    file = place.specs[-1].origin if place else getattr(sys.modules.get(module), "__file__", None)
    where = place_of(error, file)
    at = f" ({where})" if where else ""
    hint = "" if isinstance(error, ModuleNotFoundError) else " Correct it there."
    return f"importing {module} failed: {message_of(error)}{at}.{hint}"


def _missing(error: ModuleNotFoundError, place: Place | None) -> str:
    """Return a remedy if a user's module imports one that is not found."""
    wanted = (error.name or "").partition(".")[0]
    if place is None or place.installed or not wanted:
        return "Install the package."
    folder = Path(place.where).parent
    if not (folder / f"{wanted}.py").exists() and not (folder / wanted).is_dir():
        return "Install the package."
    return (
        f"{wanted} lies beside it, but nothing else than the module that the rig names is taken from there. "
        f"Put both into a package: a folder with an empty __init__.py, named as folder.module:Class in the "
        f"rig, where `from . import {wanted}` works."
    )


def _lacks(made: object, role: Role) -> str:
    for name, count in role.methods.items():
        method = getattr(made, name, None)
        if not callable(method):
            return f"has no method {name}. {needs(role)}"
        if inspect.iscoroutinefunction(method):
            return f"has an async method {name}; the loop does not await. {needs(role)}"
        if not _takes(method, count):
            return (
                f"has a method {name} that does not take {count} argument{'s' * (count != 1)}. {needs(role)}"
            )
    return ""


def needs(role: Role) -> str:
    """Return a sentence on the methods that a class of this role must have."""
    return f"It needs {', '.join(role.methods)}: see docs/plugins.md."


def _takes(method: Callable[..., Any], count: int) -> bool:
    try:
        signature = inspect.signature(method)
    except (TypeError, ValueError):  # written in C: it will be seen when it is called
        return True
    try:
        signature.bind(*range(count))
    except TypeError:
        return False
    return True
