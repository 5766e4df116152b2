"""Looks at a cluster: how many workers it has, for how long none, and whether the scheduler answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.sweeping.cluster_errors import lost_scheduler, lost_workers, no_workers, silent_scheduler

if TYPE_CHECKING:
    from collections.abc import Mapping

_POLL_S = 0.1  # while the first worker is awaited


class ClusterTimeouts(NamedTuple):
    """Longest waits on a cluster, and the time between two looks."""

    connect_s: float = 10.0
    """For the connection to the scheduler."""
    answer_s: float = 30.0
    """For an answer of the scheduler, and for the result of a block that is finished."""
    first_worker_s: float = 10.0
    """For a worker, before the first block."""
    new_worker_s: float = 60.0
    """For a new worker, after the last one has gone."""
    look_s: float = 2.0
    """Between two looks at a cluster that finishes no block."""


class ClusterLook:
    """Asks a scheduler for its workers.

    Parameters
    ----------
    client
        Of the scheduler: a `distributed.Client`.
    address
        Of the scheduler, for messages.
    timeouts
        Longest waits.

    Attributes
    ----------
    threads
        Number of blocks that the workers run at the same time, as of the last look.
    """

    def __init__(self, client: Any, address: str, timeouts: ClusterTimeouts) -> None:
        self._client, self._address, self._timeouts = client, address, timeouts
        self._clock = MonotonicClock()
        self._since_ns = self._clock.now_ns()  # the last instant at which there was a worker
        self.threads = 0

    def wait_for_workers(self) -> Mapping[str, int]:
        """Return the threads of each worker by its address, once there is one.

        Raises
        ------
        BackendError
            If none comes in time, or the scheduler does not answer.
        """
        while not (workers := self._ask()):
            if self._without_s() > self._timeouts.first_worker_s:
                raise no_workers(self._address, self._timeouts.first_worker_s)
            pause(_POLL_S)
        return workers

    def require_workers(self) -> None:
        """Count the workers again.

        Raises
        ------
        BackendError
            If there has been none for too long, or the scheduler is lost.
        """
        if not self._ask() and self._without_s() > self._timeouts.new_worker_s:
            raise lost_workers(self._address, self._timeouts.new_worker_s)

    def _ask(self) -> Mapping[str, int]:
        try:
            workers: Mapping[str, int] = self._client.sync(
                self._client.scheduler.ncores, callback_timeout=self._timeouts.answer_s
            )
        except TimeoutError:
            raise silent_scheduler(self._address, self._timeouts.answer_s) from None
        except (OSError, AttributeError, RuntimeError):  # the last two: of a client that has given up
            raise lost_scheduler(self._address) from None
        self.threads = sum(workers.values())
        if workers:
            self._since_ns = self._clock.now_ns()
        return workers

    def _without_s(self) -> float:
        """Return for how long no worker has been seen, s."""
        return (self._clock.now_ns() - self._since_ns) * 1e-9
