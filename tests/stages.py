"""What the tests of a run share: stages that do nothing, and the texts of the events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.values import Estimate, Reference, Sample

if TYPE_CHECKING:
    from dcmp_hil.result import Result


def texts_of(result: Result) -> list[str]:
    return [event.text for event in result.events]


class ZeroController:
    """A controller that requests 0 V."""

    def __init__(self, setting: object) -> None:
        pass

    def update(self, reference: Reference, estimate: Estimate) -> Any:  # noqa: ARG002
        return 0.0


class ObserverAtRest:
    """An observer whose estimate is always at rest."""

    def __init__(self, setting: object) -> None:  # noqa: ARG002 - a rig's observer is made with it
        self.calls = 0

    def update(self, sample: Sample) -> Any:
        self.calls += 1
        return Estimate(sample.position, 0.0, 0.0)
