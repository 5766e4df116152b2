"""Reading a rig: shipped by name or from a file, with overrides, every fault at once."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from dcmp_hil.config.messages import explain_faults
from dcmp_hil.config.rig import KINDS, Rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.references.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence

_FOLDER = resources.files("dcmp_hil").joinpath("rigs")
_LARGEST_FILE = 1 << 20  # bytes: no rig is that long; whatever it is, it is not read into memory


def shipped_rigs() -> list[str]:
    """Return the names of the rigs that come with the package."""
    return sorted(
        entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml")
    )


def load_rig(source: str | Path, overrides: Sequence[str] = ()) -> Rig:
    """Read and check a rig.

    Parameters
    ----------
    source
        The name of a shipped rig, or the path of a file ending in .toml.
    overrides
        `key=value` in dotted form, such as "loop.rate_hz=500"; they go through the same check. A value
        that is no TOML is taken as text. Choosing another kind of reference, observer or controller
        drops the keys of the old kind.

    Raises
    ------
    ConfigError
        With every fault found: place, what was got, what was expected, remedy.
    """
    text, place, folder = _read(source)
    table = _parse(text, place)
    table.setdefault("name", re.sub(r"[^\w.-]+", "-", Path(place).stem)[:60] or "rig")
    set_keys = _override(table, overrides)
    try:
        rig = Rig.model_validate(table)
    except ValidationError as error:
        raise ConfigError(*explain_faults(error, table, place, set_keys)) from None
    return _with_reference_file(rig, Path() if "reference.file" in set_keys else folder)


def copy_rig(name: str, target: Path) -> list[Path]:
    """Write a shipped rig to `target`, and its schema beside it so that editors can complete and check it.

    Returns
    -------
    list of Path
        What was written. A schema that is there already is left alone.

    Raises
    ------
    ConfigError
        If there is no such rig, `target` exists, or it cannot be written.
    """
    text = _shipped_text(name)
    schema = target.parent / "rig.schema.json"
    written = [target]
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
        if not schema.exists():
            schema.write_text(_FOLDER.joinpath(schema.name).read_text("utf-8"), "utf-8")
            written.append(schema)
    except FileExistsError:
        raise ConfigError(f"{target}: exists already. Choose another name, or remove it first.") from None
    except OSError as error:
        raise ConfigError(f"{target}: {error.strerror or error}. Choose a place you may write.") from None
    return written


def _read(source: str | Path) -> tuple[str, str, Path]:
    """Return the text, what to call it, and the folder that relative paths in it start from."""
    name = str(source)
    if not name.endswith(".toml") and "/" not in name:
        return _shipped_text(name), f"{name}.toml", Path()
    path = Path(source)
    try:
        with path.open("rb") as file:
            raw = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise ConfigError(
            f"{path}: {error.strerror or error}. Check the path; `dcmp-hil rigs` lists the shipped rigs."
        ) from None
    if len(raw) > _LARGEST_FILE:
        raise ConfigError(f"{path}: more than 1 MiB, which no rig file is. Check the path.")
    try:
        return raw.decode("utf-8-sig"), name, path.parent
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not UTF-8 text (byte {error.start}). Save it as UTF-8.") from None


def _shipped_text(name: str) -> str:
    known = shipped_rigs()
    if name not in known:
        close = get_close_matches(name, known, n=1, cutoff=0.5)
        hint = f'Did you mean "{close[0]}"? ' if close else ""
        raise ConfigError(
            f'"{name}" is no shipped rig. {hint}There are: {", ".join(known)}; '
            "a file of your own ends in .toml."
        )
    return _FOLDER.joinpath(f"{name}.toml").read_text("utf-8")


def _parse(text: str, place: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(
            f"{place}: not TOML: {error}. Strings need quotes, tables need [brackets]."
        ) from None


def _override(table: dict[str, Any], overrides: Sequence[str]) -> set[str]:
    """Put the overrides into the table; return their keys."""
    parsed = [_parse_override(override) for override in overrides]
    faults = [entry for entry in parsed if isinstance(entry, str)]
    if faults:
        raise ConfigError(*faults)
    pairs = [entry for entry in parsed if not isinstance(entry, str)]
    for key, value in pairs:
        if key[-1] == "kind" and len(key) == 2:  # noqa: PLR2004 - table and key
            _drop_keys_of_old_kind(table, key[0], value)
    for key, value in pairs:
        _put(table, key, value)
    return {".".join(key) for key, _ in pairs}


def _parse_override(override: str) -> tuple[list[str], Any] | str:
    """Return key and value, or the fault."""
    key, equals, text = override.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        return f'--set {override}: expected KEY=VALUE, such as loop.rate_hz=500 or reference.kind="hold".'
    try:
        return parts, tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return parts, text.strip()


def _put(table: dict[str, Any], key: list[str], value: Any) -> None:
    for depth, part in enumerate(key[:-1]):
        inner = table.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ConfigError(f"--set {'.'.join(key)}: {'.'.join(key[: depth + 1])} is a value, not a table.")
        table = inner
    table[key[-1]] = value


def _drop_keys_of_old_kind(table: dict[str, Any], name: str, kind: Any) -> None:
    section = table.get(name)
    if name not in KINDS or not isinstance(section, dict) or section.get("kind") == kind:
        return
    settings = KINDS[name].get(str(kind), KINDS[name].get("custom"))
    known = settings.model_fields if settings else {}
    table[name] = {key: value for key, value in section.items() if key in known}


def _with_reference_file(rig: Rig, folder: Path) -> Rig:
    """Resolve the file of a csv reference, and read it once now: a bad one is a fault of the rig."""
    if not isinstance(rig.reference, Table):
        return rig
    reference = rig.reference.model_copy(update={"file": str(folder / rig.reference.file)})
    reference.at(0.0)
    return rig.model_copy(update={"reference": reference})
