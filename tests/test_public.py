"""The names that `import dcmp_hil` promises, and the result that an ended run leaves in its error."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import dcmp_hil
from dcmp_hil import BackendError, Sample, TripError, run
from dcmp_hil.errors import DcmpError, DeadlineError, LinkError
from sim_backend.backend import SimBackend
from tests.helpers import bench, named

if TYPE_CHECKING:
    from dcmp_hil import Clock, Rig


@pytest.mark.parametrize("name", dcmp_hil.__all__)
def test_promised_name_is_there(name: str) -> None:
    assert getattr(dcmp_hil, name) is not None


def test_vocabulary_of_a_plug_in_is_promised() -> None:
    vocabulary = {"Sample", "Estimate", "Reference", "Truth", "Fault", "Observer", "Controller", "Backend"}
    assert vocabulary | {"ObserverContext", "ControllerContext", "Model", "Clock"} <= set(dcmp_hil.__all__)


def test_name_that_is_not_promised_is_refused() -> None:
    with pytest.raises(AttributeError, match="Setting"):
        dcmp_hil.Setting  # noqa: B018


class _Ends(SimBackend):
    """The simulated rig, until an error after a hundred periods."""

    error: DcmpError

    def __init__(self, rig: Rig, clock: Clock) -> None:
        super().__init__(rig, clock)
        self._reads = 0

    def read(self) -> Sample:
        self._reads += 1
        if self._reads > 100:
            raise self.error
        return super().read()


@pytest.mark.parametrize(
    "error",
    [TripError("speed", "Too fast.", "Look."), DeadlineError("Late."), LinkError("Unplugged.")],
    ids=lambda error: type(error).__name__,
)
def test_error_has_the_result_of_the_run_that_it_ended(error: DcmpError) -> None:
    backend = type("Ends", (_Ends,), {"error": error})
    with pytest.raises(type(error)) as caught:
        run(bench(f"backend.kind={named(backend)}"), duration=5.0, fast=True)
    result = caught.value.result
    assert result is not None
    assert result.summary.periods == 100
    assert len(result.columns["time_s"]) == 100
    assert result.rig.name == "bench-1khz"
    assert result.events[-1].text.endswith(("amplifier at 0 V", "goes there by itself"))


def test_error_of_a_run_that_never_began_has_a_result_without_periods() -> None:
    class Absent(SimBackend):
        def __enter__(self) -> Absent:
            raise BackendError("There is no device.")

    with pytest.raises(BackendError) as caught:
        run(bench(f"backend.kind={named(Absent)}"), duration=1.0, fast=True)
    assert caught.value.result is not None
    assert caught.value.result.summary.periods == 0
