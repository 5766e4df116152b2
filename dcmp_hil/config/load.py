"""Reading a rig: shipped by name or from a file, with overrides, every fault at once."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import ValidationError

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.config.formatting import printable, toml_value
from dcmp_hil.config.overrides import apply_overrides
from dcmp_hil.config.rig import OpenLoopTables, Rig
from dcmp_hil.config.toml_text import name_from, parse
from dcmp_hil.config.validation_errors import explain_faults
from dcmp_hil.control.references.table import Table
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from dcmp_hil.config.tables import RigTables

T = TypeVar("T", bound="RigTables")
_RIGS_FOLDER = resources.files("dcmp_hil").joinpath("rigs")
_FILE_BYTES_MAX = 128 * 1024  # bytes: no rig is that long
_LINE_CHARS_MAX = 4096  # characters: the time for a dotted key grows with the square of its length
_SHOWN_KEYS_MAX = 3  # keys that a message lists


def shipped_rigs() -> list[str]:
    """Return the names of the rigs that come with the package."""
    return sorted(
        entry.name.removesuffix(".toml") for entry in _RIGS_FOLDER.iterdir() if entry.name.endswith(".toml")
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
    table = parse(text, place)
    table.setdefault("name", name_from(Path(place).stem))
    return _checked(table, place, folder, overrides)


def load_table(table: dict[str, Any], overrides: Sequence[str] = (), folder: Path | None = None) -> Rig:
    """Check a rig that is there as a table already, as a recording has it; see `load_rig`.

    `folder` is where the file of the rig was, for classes of the user's own.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    return _checked(table, "the recording", None, overrides).in_folder(folder)


def _checked(table: dict[str, Any], place: str, folder: Path | None, overrides: Sequence[str]) -> Rig:
    set_keys = apply_overrides(table, overrides)
    rig = _validated(Rig, table, place, set_keys)
    if folder is None:
        return rig
    rig = _with_reference_file(rig, folder, place, set_keys)
    return rig if folder == Path() else rig.in_folder(folder.absolute())


def load_tables(source: str | Path | None, overrides: Sequence[str] = ()) -> RigTables:
    """Read the tables of a rig for a computation that closes no loop; see `load_rig`.

    The rules that ask for a loop, such as its stability, do not apply; the bounds of each key do. No file of
    a reference is read.

    Parameters
    ----------
    source
        As for `load_rig`; None for the defaults.
    overrides
        As for `load_rig`.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    text, place, folder = ("", "the defaults", Path()) if source is None else _read(source)
    table = parse(text, place)
    if source is not None:
        table.setdefault("name", name_from(Path(place).stem))
    tables = _validated(OpenLoopTables, table, place, apply_overrides(table, overrides))
    return tables if folder == Path() else tables.in_folder(folder.absolute())


def change_rig(rig: T, overrides: Sequence[str]) -> T:
    """Return a rig with overrides on top of what it says, read and checked as those of `load_rig` are.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    table = rig.model_dump(exclude_unset=True)
    set_keys = apply_overrides(table, overrides)
    return _validated(type(rig), table, rig.name, set_keys).in_folder(rig.folder)


def _validated(kind: type[T], table: dict[str, Any], place: str, set_keys: Collection[str]) -> T:
    """Return the tables of a rig, checked; every rig that is loaded or changed is made here.

    Raises
    ------
    ConfigError
        With every fault found; or if a rule cannot be computed with these numbers.
    """
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        raise ConfigError(*explain_faults(error, table, place, set_keys)) from None
    except ArithmeticError as error:
        keys = [printable(key) for key in sorted(set_keys) if "." in key][:_SHOWN_KEYS_MAX]
        where = f"--set {', '.join(keys)}" if keys else place
        raise ConfigError(
            f"{where}: a number is too large or too small to compute with ({error}). Write a usual one."
        ) from None


def copy_rig(name: str, target: Path) -> list[Path]:
    """Write a shipped rig to `target`, and its schema beside it so that editors can complete and check it.

    Returns
    -------
    list of Path
        What was written. A schema that is there already is left alone.

    Raises
    ------
    ConfigError
        If there is no such rig, `target` exists, does not end in .toml, or cannot be written.
    """
    text = shipped_text(name)
    if target.suffix != ".toml":  # nothing else would be taken for a file when it is loaded
        raise ConfigError(f"{target}: a rig file ends in .toml. Call it {target.name or 'rig'}.toml.")
    schema = target.parent / "rig.schema.json"
    written, made = [target], False
    try:
        with target.open("x", encoding="utf-8") as file:
            made = True
            file.write(text)
        if not schema.exists():
            written.append(schema)
            schema.write_text(_RIGS_FOLDER.joinpath(schema.name).read_text("utf-8"), "utf-8")
    except FileExistsError:
        raise ConfigError(f"{target}: exists already. Choose another name, or remove it first.") from None
    except FileNotFoundError:
        raise ConfigError(f"{target}: there is no folder {target.parent}. Make it first.") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        if made:
            for path in written:
                path.unlink(missing_ok=True)  # half a file
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{target}: {reason}. Choose a place you may write.") from None
    return written


def _read(source: str | Path) -> tuple[str, str, Path]:
    """Return the text, what to call it, and the folder that relative paths in it start from."""
    name = str(source)
    if not name.endswith(".toml") and "/" not in name:
        return shipped_text(name), f"{name}.toml", Path()
    path, place = Path(source), printable(name)
    try:
        with path.open("rb") as file:
            raw = file.read(_FILE_BYTES_MAX + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(
            f"{place}: {reason}. Check the path; `dcmp-hil rigs` lists the shipped rigs."
        ) from None
    if len(raw) > _FILE_BYTES_MAX:
        raise ConfigError(
            f"{place}: more than {_FILE_BYTES_MAX // 1024} KiB, which no rig is. Check the path."
        )
    if max(map(len, raw.split(b"\n"))) > _LINE_CHARS_MAX:
        raise ConfigError(f"{place}: a line of more than {_LINE_CHARS_MAX} characters. Break it into lines.")
    try:
        return raw.decode("utf-8-sig"), place, path.parent
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{place}, line {line}: not UTF-8 text. Save the file as UTF-8.") from None


def shipped_text(name: str) -> str:
    """Return the text of a shipped rig.

    Raises
    ------
    ConfigError
        If there is no such rig, with the names that there are.
    """
    known = shipped_rigs()
    if name not in known:
        hint = did_you_mean(name, known, cutoff=0.5)
        raise ConfigError(
            f"{toml_value(name)} is no shipped rig. {hint}{hint and ' '}There are: {', '.join(known)}; "
            "a file of your own ends in .toml."
        )
    return _RIGS_FOLDER.joinpath(f"{name}.toml").read_text("utf-8")


def _with_reference_file(rig: Rig, folder: Path, place: str, set_keys: Collection[str]) -> Rig:
    """Resolve the file of a csv reference, and read it once now: a bad one is a fault of the rig."""
    if not isinstance(rig.reference, Table):
        return rig
    given = bool({"reference", "reference.file"} & set(set_keys))
    file = rig.reference.file if given else str(folder / rig.reference.file)
    reference = rig.reference.model_copy(update={"file": file})
    where = f"{'--set' if given else f'{place},'} reference.file:"
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            reference.at(0.0)
    except ConfigError as error:
        first, *others = error.faults
        raise ConfigError(f"{where} {first}", *others) from None
    except (ArithmeticError, ValueError) as error:  # figures that no spline goes through
        raise ConfigError(
            f"{where} {file}: no smooth curve goes through its points ({error}). "
            "Look for positions that are far too large, or times that lie far too close."
        ) from None
    return rig.model_copy(update={"reference": reference})
