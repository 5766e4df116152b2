"""A backend of the user's own, with what it returns checked once a cycle; what it may not ends the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from dcmp_hil.errors import BackendError, DcmpError
from dcmp_hil.plugins.error_text import REMEDY, at, file_of, message_of, place_of, place_of_code, shown_value
from dcmp_hil.plugins.numbers import plain_number, whole_number
from dcmp_hil.values import Fault, Sample, Truth

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

_FAULT_CODE_TYPES = (Fault, int)


class CheckedBackend:
    """A backend of the user's own; what else it has than the methods of a backend is passed through.

    Parameters
    ----------
    inner
        The backend.
    name
        `module:Factory`, for the message.

    Attributes
    ----------
    inner
        As given.
    """

    def __init__(self, inner: Any, name: str) -> None:
        self.inner, self._name = inner, name
        self._read: Callable[[], Sample] = inner.read
        self._write: Callable[[float], None] = inner.write
        self._truth: Callable[[], Truth] = inner.truth

    def __getattr__(self, name: str) -> Any:
        """Return what else the backend has, such as counters of its link."""
        return getattr(self.inner, name)

    def __enter__(self) -> Self:
        """Open the device."""
        try:
            self.inner.__enter__()
        except DcmpError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failed(error, self.inner.__enter__) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Drive 0 V, disarm, close; a failure of that is a note where something was wrong before."""
        try:
            self.inner.__exit__(kind, error, trace)
        except DcmpError:
            raise
        except (Exception, SystemExit) as failure:
            said = self._failed(failure, self.inner.__exit__)
            if error is None:
                raise said from failure
            error.add_note(str(said))

    def read(self) -> Sample:
        """Wait for the next sample.

        Raises
        ------
        BackendError
            If the backend raises, or returns anything but a Sample of numbers.
        """
        try:
            sample = self._read()
        except DcmpError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failed(error, self._read) from error
        if type(sample) is Sample:
            t, position, voltage, fault = sample
            if type(t) is type(position) is type(voltage) is float and type(fault) in _FAULT_CODE_TYPES:
                return sample
        return self._converted(sample)

    def write(self, voltage: float) -> None:
        """Send a voltage, V.

        Raises
        ------
        BackendError
            If the backend raises.
        """
        try:
            self._write(voltage)
        except DcmpError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failed(error, self._write) from error

    def truth(self) -> Truth:
        """Return what a simulation knows at the last sample; NaN on a real device.

        Raises
        ------
        BackendError
            If the backend raises, or returns anything but a Truth of numbers.
        """
        try:
            truth = self._truth()
        except DcmpError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failed(error, self._truth) from error
        if isinstance(truth, Truth):
            numbers = [number for value in truth if (number := plain_number(value)) is not None]
            if len(numbers) == len(truth):
                return Truth(*numbers)
        raise self._wrong(truth, "Truth(position, velocity, disturbance)", "truth", self._truth)

    def _converted(self, sample: Any) -> Sample:
        if isinstance(sample, Sample):
            t, position, voltage = (plain_number(value) for value in sample[:3])
            fault = whole_number(sample.fault)
            if t is not None and position is not None and voltage is not None and fault is not None:
                return Sample(t, position, voltage, fault)
        raise self._wrong(sample, "Sample(t, position, voltage), numbers", "read", self._read)

    def _failed(self, error: BaseException, method: Callable[..., Any]) -> BackendError:
        where = place_of(error, file_of(method)) or place_of_code(method)
        return BackendError(f"{self._name} raised {message_of(error)}{at(where)}. {REMEDY}")

    def _wrong(self, value: object, expected: str, name: str, method: Callable[..., Any]) -> BackendError:
        where = at(place_of_code(method))
        return BackendError(
            f"{self._name}.{name} returned {shown_value(value)}{where}; expected {expected}. {REMEDY}"
        )
