"""Parameters of a device: read, and the limits of a run put into it for a session."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.device import open_errors
from dcmp_hil.device.client import ANSWER_TIMEOUT_S
from dcmp_hil.device.compatibility import COMPARED_PARAMETERS, is_possible
from dcmp_hil.wire.messages import Parameter, ParameterGet, ParameterResult, ParameterSet, ParameterValue
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.device.client import DeviceClient
    from dcmp_hil.device.device_config import DeviceConfig

_COUNT_READINGS = 3  # at a count before it is taken for the arm's
_COUNTS = 2**24  # of a SAMPLE


class DeviceParameters:
    """Reads and sets the parameters of one device, for one session.

    Parameters
    ----------
    name
        Of the link, for what is refused.
    client
        On that link.
    session
        That owns the device when something is set.
    """

    def __init__(self, name: str, client: DeviceClient, session: int) -> None:
        self._name, self._client, self._session = name, client, session

    def get(self, parameter: Parameter) -> int:
        """Return a value that is possible on any device.

        Raises
        ------
        OpenError
            If there is no answer, or one that cannot be.
        """
        found = self._ask(ParameterGet(parameter))
        if found is None or found.result != ParameterResult.OK:
            raise open_errors.not_told(self._name, parameter.name)
        if not is_possible(parameter, found.value):
            raise open_errors.impossible(self._name, f"{parameter.name} = {found.value}")
        return found.value

    def compared(self) -> dict[Parameter, int]:
        """Return the device's parameters that are compared with the rig."""
        return {parameter: self.get(parameter) for parameter in COMPARED_PARAMETERS}

    def put_limits(self, config: DeviceConfig, built: Mapping[Parameter, int]) -> int:
        """Lower the device's limits to the rig's, and read back that it keeps them.

        They are the session's: they end with it. Never more is set than the board was built with.

        Parameters
        ----------
        config
            What the rig says.
        built
            What the device said before anything was set.

        Returns
        -------
        int
            Count modulo 2^24 at which the arm hangs, from which travel counts.

        Raises
        ------
        OpenError
            If the device does not take a value, or does not keep it.
        """
        speed, travel = Parameter.SPEED_LIMIT_COUNTS_S, Parameter.TRAVEL_LIMIT_COUNTS
        zero = self._hanging() if config.zero is None else config.zero % _COUNTS
        asked = {
            Parameter.WATCHDOG_MS: config.watchdog_ms,
            Parameter.VOLTAGE_LIMIT_MV: config.voltage_limit_mV,
            speed: min(config.speed_limit_counts_s, built[speed]),
            travel: min(config.travel_limit_counts, built[travel]),
            Parameter.TRAVEL_ORIGIN_COUNTS: zero,
        }
        if config.slew_mV_per_ms is not None:
            asked[Parameter.SLEW_MV_PER_MS] = config.slew_mV_per_ms
        for parameter, value in asked.items():
            self._put(parameter, value)
        for parameter, value in asked.items():
            kept = self.get(parameter)
            if kept != value:
                raise open_errors.not_kept(self._name, parameter.name, value, kept)
        return zero

    def _put(self, parameter: Parameter, value: int) -> None:
        found = self._ask(ParameterSet(self._session, parameter, value))
        if found is None or found.result != ParameterResult.OK or found.value != value:
            raise open_errors.not_taken(self._name, parameter.name, value, found)

    def _hanging(self) -> int:
        """Return the count of an arm that hangs now: the middle one of three, so that a wrong one is none."""
        counts: list[int] = []
        while len(counts) < _COUNT_READINGS:
            sample = self._client.receive_sample(ANSWER_TIMEOUT_S)
            if sample is None:
                raise open_errors.no_samples(self._name, ANSWER_TIMEOUT_S, "nothing")
            counts.append(unwrap(counts[0] if counts else 0, sample.position_counts, 24))
        return sorted(counts)[_COUNT_READINGS // 2] % _COUNTS

    def _ask(self, question: ParameterGet | ParameterSet) -> ParameterValue | None:
        return self._client.request(question, ParameterValue, lambda answer: answer.id == question.id)
