"""History of a device: boots, the cause of the last reset, and the fault before it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.safety.device_faults import meaning_of, name_of
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Parameter, ParameterGet, ParameterResult, ParameterValue

if TYPE_CHECKING:
    from dcmp_hil.device.client import DeviceClient

_RESET_CAUSES = ("unknown", "power", "reset pin", "software", "watchdog", "brown-out")
_WATCHDOG_CAUSE, _BROWN_OUT_CAUSE = 4, 5
_RESET_REMEDIES = {
    _WATCHDOG_CAUSE: "Its processor hung: look at what its firmware did last.",
    _BROWN_OUT_CAUSE: "Its supply fell too low: look at the supply of its logic under load.",
}


class History(NamedTuple):
    """Parameters of a device that describe its past; None where it did not tell."""

    boots: int | None  # since it was flashed; 0 if it cannot know
    cause: int | None  # of the newest reset, as RESET_CAUSE has it
    fault: int | None  # the newest before this boot; 0 for none
    detail: int | None  # of it

    @property
    def sentence(self) -> str:
        """Return the history of the device as one sentence."""
        last = "none" if not self.fault else f"{name_of(self.fault)} (detail {_shown(self.detail)})"
        return (
            f"boot {_shown(self.boots)}, reset by {self._cause}, "
            f"fault before that: {'not told' if self.fault is None else last}"
        )

    @property
    def remarks(self) -> tuple[str, ...]:
        """Points that a person should check before the motor runs."""
        found = []
        if self.cause in _RESET_REMEDIES:
            found.append(f"The device was reset by its {self._cause}. {_RESET_REMEDIES[self.cause]}")
        if self.fault in {Fault.BREAK_INPUT, Fault.INTERNAL}:
            meaning = meaning_of(self.fault)
            found.append(
                f"The device's newest fault before this boot was {name_of(self.fault)}, detail "
                f"{_shown(self.detail)}: {meaning.sentence}. {meaning.remedy}"
            )
        return tuple(found)

    @property
    def _cause(self) -> str:
        if self.cause is None:
            return "not told"
        return _RESET_CAUSES[self.cause] if 0 <= self.cause < len(_RESET_CAUSES) else f"cause {self.cause}"


def history_of(client: DeviceClient) -> History:
    """Ask a device for its past; it need not be owned."""
    return History(
        *(
            _told(client, parameter)
            for parameter in (
                Parameter.BOOT_COUNT,
                Parameter.RESET_CAUSE,
                Parameter.LAST_FAULT,
                Parameter.LAST_FAULT_DETAIL,
            )
        )
    )


def _told(client: DeviceClient, parameter: Parameter) -> int | None:
    found = client.request(ParameterGet(parameter), ParameterValue, lambda answer: answer.id == parameter)
    return found.value if found is not None and found.result == ParameterResult.OK else None


def _shown(value: int | None) -> str:
    return "not told" if value is None else str(value)
