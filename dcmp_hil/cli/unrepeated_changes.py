"""Recorded changes that a repetition of a run did not make, told to the user and as a document."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from dcmp_hil.cli import console
from dcmp_hil.config.formatting import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from dcmp_hil.recording.recorded_changes import UnrepeatedChange

_SENTENCES_MAX = 20  # warnings of one repetition
_SHOWN_KEYS_MAX = 4  # keys that a sentence lists
_SHOWN_KEY_CHARS_MAX = 60  # characters of a key that are shown


def refused(changes: Iterable[UnrepeatedChange]) -> list[UnrepeatedChange]:
    """Return the changes that were not left out on the user's own demand."""
    return [change for change in changes if change.why == "refused"]


def tell(label: str, changes: Sequence[UnrepeatedChange]) -> None:
    """Print what a repetition left out: one note for pinned keys, else a warning for each cause.

    Parameters
    ----------
    label
        Of the repetition.
    changes
        What it left out.
    """
    pinned = Counter(key for change in changes if change.why == "pinned" for key in change.values)
    if pinned:
        many = sum(change.why == "pinned" for change in changes)
        said = f"1 change of {_keys(pinned)}" if many == 1 else f"{many} changes of {_keys(pinned)}"
        verb, what = "is" if many == 1 else "are", "the key was" if len(pinned) == 1 else "the keys were"
        console.note(f"{label}: {said} in the run {verb} not repeated here, because {what} given.")
    causes: dict[tuple[str, str], list[float]] = {}
    for change in refused(changes):
        causes.setdefault((_keys(change.values), change.reason), []).append(change.t)
    for (keys, reason), times in list(causes.items())[:_SENTENCES_MAX]:
        more = f" (and {len(times) - 1} later)" if len(times) > 1 else ""
        console.warn(
            f"{label}: the change of {keys} at {times[0]:.3f} s{more} is not repeated here: {reason}"
        )
    if len(causes) > _SENTENCES_MAX:
        console.warn(f"{label}: and {len(causes) - _SENTENCES_MAX} more of the kind.")


def document(changes: Iterable[UnrepeatedChange]) -> list[dict[str, Any]]:
    """Return what `--json` writes of them."""
    return [
        {"t_s": change.t, "values": dict(change.values), "why": change.why, "reason": change.reason}
        for change in changes
    ]


def _keys(keys: Iterable[str]) -> str:
    shown = [printable(key)[:_SHOWN_KEY_CHARS_MAX] for key in keys]
    more = [f"{len(shown) - _SHOWN_KEYS_MAX} more"] if len(shown) > _SHOWN_KEYS_MAX else []
    return ", ".join((*shown[:_SHOWN_KEYS_MAX], *more))
