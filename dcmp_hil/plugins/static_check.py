"""A class that rig.toml names, looked at in its source: nothing of it is run."""

from __future__ import annotations

import ast
import inspect
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.error_text import shown_path, syntax_of
from dcmp_hil.plugins.module_search import locate
from dcmp_hil.plugins.named_class import needs, no_such_class, not_found, split_named

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from dcmp_hil.plugins.roles import Role

_SOURCE_SUFFIXES = (".py", ".pyw")


def look_at(path: str, role: Role, folders: Sequence[Path], options: Collection[str] = ()) -> None:
    """Check that a class exists, without importing its module.

    Parameters
    ----------
    path
        `module:Class`.
    role
        What it is named for.
    folders
        As for `find_named`.
    options
        Names of the keyword arguments that it will be made with.

    Raises
    ------
    ConfigError
        If there is no such module or class, two of them, a syntax error in it or in a package above it, a
        method missing, or a constructor that does not take these arguments.
    """
    module, name, said = split_named(path, role.key)
    place = locate(module, folders, said)
    loaded = sys.modules.get(module)
    if loaded is not None and (place is None or not place.whole):  # made by hand, as in a notebook
        if not callable(getattr(loaded, name, None)):
            raise ConfigError(no_such_class(said, module, name, vars(loaded)))
        return
    if place is None or not place.whole:
        raise ConfigError(not_found(said, module, folders))
    trees = [
        _parsed(spec.origin, said) for spec in place.specs if (spec.origin or "").endswith(_SOURCE_SUFFIXES)
    ]
    if not (place.specs[-1].origin or "").endswith(_SOURCE_SUFFIXES):
        return  # compiled: only running it would tell
    names: dict[str, ast.stmt] = {}
    if not _collect(trees[-1].body, names):
        return  # `from x import *`, or a __getattr__: only running it would tell
    if name not in names:
        raise ConfigError(no_such_class(said, module, name, names))
    fault = _fault_of(names[name], role, options)
    if fault:
        where = f"{shown_path(place.specs[-1].origin or module)}, line {names[name].lineno}"
        raise ConfigError(f"{role.key}: {path} ({where}) {fault}")


def _parsed(file: str | None, said: str) -> ast.Module:
    try:
        text = Path(file or "").read_bytes()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are told when it is imported
            tree = ast.parse(text, file or "")
            compile(tree, file or "", "exec", dont_inherit=True)  # what only the compiler sees; runs nothing
    except SyntaxError as error:
        raise ConfigError(f"{said}, but {syntax_of(error)}. Correct it there.") from error
    except OSError as error:
        raise ConfigError(f"{said}, but {shown_path(file or '')}: {error.strerror or error}.") from error
    except (MemoryError, RecursionError, ValueError) as error:  # ValueError: a NUL in it
        raise ConfigError(f"{said}, but {shown_path(file or '')}: {error}. Correct it there.") from error
    return tree


def _collect(body: Sequence[ast.stmt], names: dict[str, ast.stmt]) -> bool:
    """Collect what a module binds; False where that cannot be known without running it."""
    known = True
    for statement in body:
        for name in _bound(statement):
            names[name] = statement
            known = known and name not in {"*", "__getattr__"}
        inner = (getattr(statement, field, ()) for field in ("body", "orelse", "finalbody"))
        if not isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            blocks = [*inner, *(part.body for part in _parts(statement))]
            for block in blocks:
                known = _collect(block, names) and known
    return known


def _parts(statement: ast.stmt) -> Sequence[Any]:
    """Return the handlers of a try, the cases of a match."""
    return [*getattr(statement, "handlers", ()), *getattr(statement, "cases", ())]


def _bound(statement: ast.stmt) -> Iterator[str]:
    if isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        yield statement.name
    elif isinstance(statement, ast.Import | ast.ImportFrom):
        for alias in statement.names:
            yield alias.asname or alias.name.partition(".")[0]
    else:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id


def _fault_of(statement: ast.stmt, role: Role, options: Collection[str]) -> str:
    if getattr(statement, "decorator_list", ()) or getattr(statement, "keywords", ()):
        return ""  # a decorator or a metaclass may give it everything
    if isinstance(statement, ast.FunctionDef):
        return _refusal(statement.args, role, options, bound=0)
    return _fault_of_class(statement, role, options) if isinstance(statement, ast.ClassDef) else ""


def _fault_of_class(statement: ast.ClassDef, role: Role, options: Collection[str]) -> str:
    names: dict[str, ast.stmt] = {}
    if not _collect(statement.body, names):
        return ""
    made = names.get("__init__")
    if isinstance(made, ast.FunctionDef) and not made.decorator_list and "__new__" not in names:
        refusal = _refusal(made.args, role, options, bound=1)
        if refusal:
            return refusal
    missing = [method for method in role.methods if method not in names]
    if missing and not statement.bases:  # otherwise it may inherit the rest
        return f"has no method {missing[0]}. {needs(role)}"
    return ""


def _refusal(arguments: ast.arguments, role: Role, options: Collection[str], *, bound: int) -> str:
    """Return why a call with the arguments of the role would fail; empty if it would not."""
    try:
        _signature(arguments).bind(*[None] * (bound + role.arguments), **dict.fromkeys(options))
    except (TypeError, ValueError) as error:
        return f"could not be made: {error}. It is called as {role.call}."
    return ""


def _signature(arguments: ast.arguments) -> inspect.Signature:
    kinds = inspect.Parameter
    plain = [*arguments.posonlyargs, *arguments.args]
    required, by_place = len(plain) - len(arguments.defaults), len(arguments.posonlyargs)
    made = [
        kinds(
            one.arg,
            kinds.POSITIONAL_ONLY if at < by_place else kinds.POSITIONAL_OR_KEYWORD,
            default=kinds.empty if at < required else None,
        )
        for at, one in enumerate(plain)
    ]
    if arguments.vararg:
        made.append(kinds(arguments.vararg.arg, kinds.VAR_POSITIONAL))
    made += [
        kinds(one.arg, kinds.KEYWORD_ONLY, default=kinds.empty if default is None else None)
        for one, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    ]
    if arguments.kwarg:
        made.append(kinds(arguments.kwarg.arg, kinds.VAR_KEYWORD))
    return inspect.Signature(made)
