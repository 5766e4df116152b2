"""The diagnosis of the observer that closes the loop, as further columns; one that fails ends no run."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.stop_request import Interrupted
from dcmp_hil.plugins.error_text import at, file_of, message_of, place_of, shown_value
from dcmp_hil.plugins.numbers import plain_number
from dcmp_hil.telemetry.further_columns import NO_FURTHER_COLUMNS, fault_of
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.telemetry.further_columns import FurtherColumns
    from dcmp_hil.values import Cycle


def diagnosis_of(observer: object, kind: str) -> FurtherColumns:
    """Return the diagnosis of an observer as further columns; none where it has no `DIAGNOSIS`.

    Parameters
    ----------
    observer
        As it was made; see `dcmp_hil.control.observers.DiagnosedObserver`.
    kind
        As the rig names it, for messages.

    Raises
    ------
    ConfigError
        If the names are none, or `diagnose` is missing.
    """
    observer = getattr(observer, "inner", observer)  # of a class of the user's own
    names = getattr(observer, "DIAGNOSIS", ())
    if not isinstance(names, tuple | list) or not all(isinstance(name, str) for name in names):
        raise ConfigError(f'observer.kind = "{kind}": DIAGNOSIS is a tuple of names, such as ("bias_rad",).')
    fault = fault_of(tuple(names))
    if fault:
        raise ConfigError(f'observer.kind = "{kind}": DIAGNOSIS: {fault}.')
    if not names:
        return NO_FURTHER_COLUMNS
    diagnose = getattr(observer, "diagnose", None)
    if not callable(diagnose):
        raise ConfigError(
            f'observer.kind = "{kind}": it has DIAGNOSIS and no method diagnose, which returns a number for '
            "each of its names."
        )
    return DiagnosisColumns(tuple(names), diagnose, kind)


class DiagnosisColumns:
    """Further columns from a method that is called once a cycle, behind its command.

    Parameters
    ----------
    names
        Of the columns.
    diagnose
        Returns a number for each. If it raises, or returns other things, the columns are NaN from there on.
    kind
        The observer, for the event that says so.
    """

    def __init__(self, names: tuple[str, ...], diagnose: Callable[[], Any], kind: str) -> None:
        self.names, self._diagnose, self._kind = names, diagnose, kind
        self._count = len(names)
        self._unknown = (math.nan,) * self._count
        self._dropped = False
        self._events: list[Event] = []

    def values(self, cycle: Cycle) -> tuple[float, ...]:
        """Return the diagnosis after this cycle's sample."""
        if self._dropped:
            return self._unknown
        try:
            found = self._diagnose()
            if type(found) is tuple and len(found) == self._count and set(map(type, found)) == {float}:
                return found
            numbers = [plain_number(value) for value in (found if isinstance(found, Iterable) else ())]
        except Interrupted:
            raise
        except BaseException as error:  # noqa: BLE001 - no exception of a diagnosis ends a run
            where = at(place_of(error, file_of(self._diagnose)))
            return self._drop(cycle, f"raised {message_of(error)}{where}")
        known = tuple(number for number in numbers if number is not None)
        if len(known) == len(numbers) == self._count:
            return known
        wanted = f"{self._count} number{'s' * (self._count != 1)}"
        return self._drop(cycle, f"returned {shown_value(found)}, and not {wanted}")

    def events(self) -> Sequence[Event]:
        """Return the event that the diagnosis was dropped, once."""
        told, self._events = self._events, []
        return told

    def _drop(self, cycle: Cycle, why: str) -> tuple[float, ...]:
        self._dropped = True
        sentence = f"The diagnosis of {self._kind} {why}: it is left out from here on. The run goes on."
        self._events.append(Event(cycle.sample.t, "WARN", EventKind.TELEMETRY, sentence))
        return self._unknown
