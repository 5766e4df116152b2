"""A change as the loop takes it: checked, worked out, and small."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from dcmp_hil.controllers import Gains
    from dcmp_hil.observers.super_twisting import Tuning
    from dcmp_hil.references import ReferenceSource


_APPLIED = re.compile(r"(.*), applied at t = [0-9.]+ s")
_ONE = re.compile(r"([a-z_]+\.\w+)(?:: .*? -> | = )(.*?)(?=, [a-z_]+\.\w+(?:: | = )|$)")


class Change(NamedTuple):
    """What is to be different from the next period on; None stays as it is."""

    words: str  # "controller.kp_1_s2: 4000 -> 5200"
    gains: Gains | None = None
    tuning: Tuning | None = None
    reference: ReferenceSource | None = None


def applied(words: str, t: float) -> str:
    """Return what the event of a change says, made at device time `t`, s."""
    return f"{words}, applied at t = {t:.3f} s"


def found_in(text: str) -> dict[str, str]:
    """Return each key that an event's text says was changed, with its new value; nothing for other events."""
    words = _APPLIED.fullmatch(text)
    return dict(_ONE.findall(words[1])) if words else {}
