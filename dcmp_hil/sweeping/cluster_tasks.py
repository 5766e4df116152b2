"""Tasks on a cluster: each is one block, sent to the scheduler and awaited.

A task says by name what a worker calls, so the scheduler needs no dcmp-hil.
"""

from __future__ import annotations

import importlib
import pickle
import queue
import uuid
from operator import methodcaller
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping import cluster_worker
from dcmp_hil.sweeping.cluster_errors import failed_block, lost_scheduler, other_versions
from dcmp_hil.sweeping.cluster_worker import BlockReply, installed

if TYPE_CHECKING:
    from dcmp_hil.sweeping.cluster_look import ClusterLook
    from dcmp_hil.sweeping.executor import SweepBlock

_FINISHED, _ERROR = "finished", "error"  # as `distributed.Future.status` has it


class BlockTasks:
    """The blocks of a sweep that a cluster has.

    Parameters
    ----------
    client
        Of the scheduler: a `distributed.Client`.
    address
        Of the scheduler, for messages.
    look
        Looks at the cluster while nothing is finished.
    work
        What is called with each block, pickled.
    answer_s, look_s
        See ClusterTimeouts.
    """

    def __init__(
        self, client: Any, address: str, look: ClusterLook, work: bytes, *, answer_s: float, look_s: float
    ) -> None:
        self._client, self._address, self._look, self._work = client, address, look, work
        self._answer_s, self._look_s = answer_s, look_s
        self._name = (
            f"dcmp_hil_block-{uuid.uuid4().hex}"  # Dask groups tasks by what stands before the number
        )
        self._here = installed()
        self._pending: dict[str, tuple[SweepBlock, Any]] = {}
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()

    @property
    def count(self) -> int:
        """Number of blocks that are not finished."""
        return len(self._pending)

    def start(self, block: SweepBlock) -> None:
        """Give a block to the cluster."""
        key = f"{self._name}-{block.number}"
        call = methodcaller("run_block", tuple(self._here), self._work, tuple(block))
        task = (call, (importlib.import_module, cluster_worker.__name__))
        (future,) = self._client.get({key: task}, [key], sync=False)
        self._pending[key] = block, future
        future.add_done_callback(self._done.put)

    def next(self) -> tuple[SweepBlock, Any]:
        """Wait for a block that is finished; return it with what the work returned.

        Raises
        ------
        ConfigError
            If the work does.
        BackendError
            If the block cannot be run, or the cluster is lost.
        """
        future = self._wait()
        block, _ = self._pending.pop(future.key)
        try:
            reply = BlockReply(*self._reply(block, future))
        finally:
            future.release()
        if reply.other is not None:
            raise other_versions(reply.host, self._here, reply.other)
        if reply.faults:
            raise ConfigError(*reply.faults)
        return block, pickle.loads(reply.result)  # noqa: S301 - a cluster that is not trusted is not asked

    def _wait(self) -> Any:
        """Return a future that is finished, has failed or was lost."""
        while True:
            try:
                return self._done.get(timeout=self._look_s)
            except queue.Empty:
                self._look.require_workers()

    def _reply(self, block: SweepBlock, future: Any) -> Any:
        """Return what came back; where its worker died in between, the block is run again meanwhile."""
        while future.status not in (_ERROR, "cancelled"):
            try:
                return future.result(timeout=self._answer_s)
            except TimeoutError:
                self._look.require_workers()
            except Exception as error:
                if future.status == _FINISHED:
                    raise failed_block(block, error) from error
        if future.status == _ERROR:
            cause: BaseException = future.exception(timeout=self._answer_s)
            raise failed_block(block, cause) from cause
        raise lost_scheduler(self._address)
