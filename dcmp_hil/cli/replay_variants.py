"""Variants of `replay --compare`: keys of a rig, or a list of observers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from dcmp_hil.config import change_rig
from dcmp_hil.config.compared_observers import observer_kinds
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from dcmp_hil.config.tables import RigTables

T = TypeVar("T", bound="RigTables")

_OTHER_FORM = "Write KEY=VALUE for another key, such as mu0=90."


class Variant(NamedTuple, Generic[T]):
    """A variant of `--compare`.

    Parameters
    ----------
    label
        Its overrides in one text.
    overrides
        `key=value` with the full key.
    tables
        The rig with them.
    observer
        Its kind, where a list of observers names it; else empty.
    """

    label: str
    overrides: tuple[str, ...]
    tables: T
    observer: str = ""


def variants_of(
    texts: Iterable[str], tables: T, allowed: Sequence[str], full_key: Callable[[str], str]
) -> list[Variant[T]]:
    """Return each variant of `--compare`.

    Parameters
    ----------
    texts
        Each `KEY=VALUE`, several of them with semicolons in between, or a list of observers.
    tables
        What `--set` has left of the rig. Its own observer is left out of the lists.
    allowed
        Tables whose keys a variant may name.
    full_key
        Returns an override with the key that a short option stands for.

    Raises
    ------
    ConfigError
        If a variant is there twice, or cannot be made.
    """
    found: dict[str, Variant[T]] = {}
    for text, keys, observer in _parted(texts, full_key):
        if observer and observer == tables.observer.kind:
            continue
        label = "; ".join(keys)
        if label in found:
            raise ConfigError(f"--compare {text}: given twice. Leave one out.")
        if not keys or any(key.partition(".")[0] not in allowed for key in keys):
            raise ConfigError(
                f"--compare {text}: what was measured stays as it was. Write KEY=VALUE with a key of "
                f"{', '.join(allowed[:-1])} or {allowed[-1]}, such as observer.kind=paper; a semicolon "
                "parts several keys."
            )
        try:
            found[label] = Variant(label, keys, change_rig(tables, keys), observer)
        except ConfigError as error:
            faults = (f"--compare {fault.removeprefix('--set ')}" for fault in error.faults)
            raise ConfigError(*faults) from None
    return list(found.values())


def _parted(
    texts: Iterable[str], full_key: Callable[[str], str]
) -> Iterable[tuple[str, tuple[str, ...], str]]:
    """Yield each variant as it was written, its keys, and its observer if it is one of a list."""
    for text in texts:
        if "=" in text or ";" in text:
            yield text, tuple(full_key(part.strip()) for part in text.split(";") if part.strip()), ""
            continue
        try:
            kinds = observer_kinds([text])
        except ConfigError as error:
            raise ConfigError(*(f"{fault} {_OTHER_FORM}" for fault in error.faults)) from None
        for kind in kinds:
            yield text, (f"observer.kind={kind}",), kind
