"""The manifest of a sweep's folder: what the parts in it are, and that nothing else is put beside them."""

from __future__ import annotations

import hashlib
import json
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.common.atomic_file import write_text
from dcmp_hil.control.references.table import Table
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.sweeping.spec import SweepSpec

FILE_NAME = "manifest.json"
_LOCK_NAME = ".lock"
_FORMAT = 1


class Manifest(NamedTuple):
    """Description of the parts of a folder."""

    about: dict[str, Any]
    """Spec, rig and version of the arithmetic, on which the results depend."""
    runs_per_part: int

    @property
    def hash(self) -> str:
        """Hash of what the results depend on."""
        return hashlib.sha256(json.dumps(self.about, sort_keys=True).encode()).hexdigest()


def about(spec: SweepSpec, base: Rig, numerics: int) -> dict[str, Any]:
    """Return what the results of a sweep depend on."""
    found = {
        "spec": spec.model_dump(mode="json", exclude={"rig"}),
        "rig": base.model_dump(mode="json", exclude_unset=True, exclude={"timing"}),
        "numerics": numerics,
    }
    if isinstance(base.reference, Table):
        found["reference_file"] = hashlib.sha256(Path(base.reference.file).read_bytes()).hexdigest()
    return found


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest of a folder; None if there is none.

    Raises
    ------
    ConfigError
        If it cannot be read, or is of another version of this program.
    """
    path = folder / FILE_NAME
    try:
        found = json.loads(path.read_text("utf-8"))
        if found["format"] != _FORMAT:
            raise ConfigError(f"{path}: of another version of this program. Choose another --out.")
        return Manifest(found["about"], int(found["runs_per_part"]))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):
        raise ConfigError(f"{path}: no manifest of a sweep. Choose another --out, or remove it.") from None


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of a folder.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    content = {"format": _FORMAT, "hash": manifest.hash, **manifest._asdict()}
    write_text(folder / FILE_NAME, json.dumps(content, indent=2) + "\n")


def require_same(folder: Path, found: Manifest, wanted: dict[str, Any]) -> None:
    """Raise unless the parts in a folder are of the sweep that is wanted.

    Raises
    ------
    ConfigError
        With the first key that differs.
    """
    key = _difference(found.about, json.loads(json.dumps(wanted)))
    if key:
        raise ConfigError(
            f"{folder}: made for another sweep: {key} differs. Choose another --out, or remove the folder."
        )


def _difference(one: Any, other: Any, path: str = "") -> str:
    """Return the first key whose values differ; nothing if none does."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            found = _difference(one.get(key), other.get(key), f"{path}.{key}" if path else key)
            if found:
                return found
        return ""
    return "" if one == other else path.removeprefix("spec.")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other sweeps out of a folder; where it cannot be locked, go on without.

    Raises
    ------
    ConfigError
        If another sweep writes into it.
    """
    with ExitStack() as stack:
        try:
            import fcntl  # not everywhere

            file = stack.enter_context((folder / _LOCK_NAME).open("a"))
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError(
                f"{folder}: another sweep writes into it. Wait for it, or choose another --out."
            ) from None
        except (ImportError, OSError):  # some file systems of a network have no locks
            pass
        yield
