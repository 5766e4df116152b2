"""The executor of `--scheduler`: blocks of a sweep on a Dask cluster that is there already.

This side opens connections, and listens nowhere.
"""

from __future__ import annotations

import asyncio
import pickle
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from dcmp_hil.sweeping import cluster_worker
from dcmp_hil.sweeping.cluster_address import host_and_port
from dcmp_hil.sweeping.cluster_connection import connected
from dcmp_hil.sweeping.cluster_errors import other_versions, unusable_worker
from dcmp_hil.sweeping.cluster_look import ClusterLook, ClusterTimeouts
from dcmp_hil.sweeping.cluster_tasks import BlockTasks
from dcmp_hil.sweeping.cluster_worker import Installed, installed
from dcmp_hil.sweeping.dask_library import import_distributed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from contextlib import AbstractContextManager

    from dcmp_hil.sweeping.executor import SweepBlock

T = TypeVar("T")

_BLOCKS_PER_THREAD = 2  # one that runs, and one that waits beside it
_TIMEOUTS = ClusterTimeouts()


class DaskCluster:
    """Runs the blocks of a sweep on the workers of a Dask scheduler.

    The constructor looks at the cluster once: whether it is there, and which versions its workers have.

    Parameters
    ----------
    address
        Of the scheduler, such as ``tcp://127.0.0.1:8786``. For ``tls://`` Dask's own configuration names
        the certificates.
    timeouts
        Longest waits.

    Raises
    ------
    ConfigError
        If that is no address.
    BackendError
        If Dask is not installed, no scheduler or no worker is there, or a worker would give other bits.
    """

    def __init__(self, address: str, timeouts: ClusterTimeouts = _TIMEOUTS) -> None:
        host_and_port(address)
        self._address, self._timeouts = address, timeouts
        self._distributed = import_distributed()
        with self._connected() as client:
            self._threads = ClusterLook(client, address, timeouts).wait_for_workers()
            for where, answer in _ask_each(client, self._threads, timeouts.answer_s):
                _require_same(where, answer)

    @property
    def words(self) -> str:
        """Place where the blocks run."""
        count, threads = len(self._threads), self.workers
        return (
            f"{threads} thread{'s' * (threads != 1)} of {count} worker{'s' * (count != 1)} "
            f"of Dask at {self._address}"
        )

    @property
    def workers(self) -> int:
        """Number of blocks that run at the same time, as of the first look."""
        return sum(self._threads.values())

    def run(
        self, work: Callable[[SweepBlock], T], blocks: Iterable[SweepBlock]
    ) -> Iterator[tuple[SweepBlock, T]]:
        """Yield each block with what `work` returned for it, in the order in which they are finished."""
        times = self._timeouts
        with self._connected() as client:
            look = ClusterLook(client, self._address, times)
            look.wait_for_workers()
            tasks = BlockTasks(
                client, self._address, look, pickle.dumps(work), answer_s=times.answer_s, look_s=times.look_s
            )
            for block in blocks:
                while tasks.count >= _BLOCKS_PER_THREAD * max(look.threads, 1):
                    yield tasks.next()
                tasks.start(block)
            while tasks.count:
                yield tasks.next()

    def _connected(self) -> AbstractContextManager[Any]:
        return connected(self._distributed, self._address, self._timeouts.connect_s)


def _ask_each(client: Any, workers: Iterable[str], answer_s: float) -> list[tuple[str, Any]]:
    """Return which versions each worker has, or why it cannot say; one that is slow to answer is left out."""

    async def ask(worker: str) -> tuple[str, Any] | None:
        with suppress(TimeoutError):
            answers = await asyncio.wait_for(
                client.run(cluster_worker.installed, workers=[worker], on_error="return"), answer_s
            )
            return next(iter(answers.items()), None)
        return None

    async def ask_all() -> list[tuple[str, Any] | None]:
        return await asyncio.gather(*map(ask, workers))

    return [found for found in client.sync(ask_all) if found is not None]


def _require_same(where: str, answer: Any) -> None:
    """Raise if a worker has other versions, or cannot say which."""
    if isinstance(answer, BaseException):
        raise unusable_worker(where, answer)
    if Installed(*answer) != installed():
        raise other_versions(where, installed(), Installed(*answer))
