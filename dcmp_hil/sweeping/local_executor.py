"""Executors on this computer: in this process, and in processes of its own, one for each core."""

from __future__ import annotations

import os
import pickle
import select
import signal
from collections import deque
from typing import TYPE_CHECKING, Any, TypeVar

from dcmp_hil.errors import BackendError
from dcmp_hil.ipc.child_process import ChildProcess, how_it_ended
from dcmp_hil.sweeping.worker_process import HEADER, receive_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from dcmp_hil.sweeping.executor import SweepBlock

T = TypeVar("T")

_WORKER_MODULE = "dcmp_hil.sweeping.worker_process"
_TRIALS = 3  # of a block whose worker dies


class InProcess:
    """Runs the blocks one after another in this process."""

    words = "this process"
    workers = 1

    @staticmethod
    def run(work: Callable[[SweepBlock], T], blocks: Iterable[SweepBlock]) -> Iterator[tuple[SweepBlock, T]]:
        """Yield each block with what `work` returned for it."""
        for block in blocks:
            yield block, work(block)


class Processes:
    """Runs the blocks in processes, which end with this one.

    Parameters
    ----------
    workers
        Number of processes; None for one a core that this process may use.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or cores()

    @property
    def words(self) -> str:
        """Place where the blocks run."""
        return f"{self.workers} process{'es' * (self.workers != 1)}"

    def run(
        self, work: Callable[[SweepBlock], T], blocks: Iterable[SweepBlock]
    ) -> Iterator[tuple[SweepBlock, T]]:
        """Yield each block with what `work` returned for it, in the order in which they are finished.

        Raises
        ------
        BackendError
            If no process can be started, or the processes of one block die again and again.
        """
        waiting = deque((block, 1) for block in blocks)
        busy: dict[int, _Worker] = {}
        try:
            while waiting or busy:
                while waiting and len(busy) < self.workers:
                    self._give(_Worker(work), *waiting.popleft(), busy)
                for descriptor in select.select(list(busy), [], [])[0]:
                    worker = busy.pop(descriptor)
                    answer = worker.answer()
                    if answer is None:
                        waiting.appendleft((worker.block, _again(worker)))
                        continue
                    if waiting:
                        self._give(worker, *waiting.popleft(), busy)
                    else:
                        worker.end()
                    yield worker.answered, _result(answer)
        finally:
            for worker in busy.values():
                worker.end()

    def started(self, pid: int, block: SweepBlock, trial: int) -> None:
        """Do nothing: a process has been given a block, for the first time or again."""

    def _give(self, worker: _Worker, block: SweepBlock, trial: int, busy: dict[int, _Worker]) -> None:
        busy[worker.descriptor] = worker
        worker.start(block, trial)
        self.started(worker.pid, block, trial)


class _Worker:
    """One process, and the block that it runs."""

    block: SweepBlock
    answered: SweepBlock
    trial: int

    def __init__(self, work: object) -> None:
        try:
            self._child = ChildProcess(_WORKER_MODULE, work, blocked=[signal.SIGINT])
        except OSError as error:
            raise BackendError(
                f"No process could be started for the sweep ({error.strerror}). End other programs, or take "
                "--workers 1."
            ) from None
        self.descriptor, self.pid = self._child.channel.fileno(), self._child.pid

    def start(self, block: SweepBlock, trial: int) -> None:
        """Send a block to the process."""
        self.block, self.trial = block, trial
        data = pickle.dumps(tuple(block))
        self._child.channel.settimeout(None)
        try:
            self._child.channel.sendall(HEADER.pack(len(data)) + data)
        except OSError:  # it has died: `answer` says so
            return

    def answer(self) -> tuple[bool, Any] | None:
        """Return what the process answers; None if it has died."""
        self.answered = self.block
        data = receive_bytes(self._child.channel)
        if data is None:
            return None
        return pickle.loads(data)  # type: ignore[no-any-return] # noqa: S301 - written by our own child

    def end(self) -> int:
        """End the process at once."""
        self._child.hang_up()
        return self._child.end(0.0)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _again(worker: _Worker) -> int:
    """Return the number of the next trial of a block whose worker has died."""
    ended = how_it_ended(worker.end())
    if worker.trial >= _TRIALS:
        first, last = worker.block.first, worker.block.first + worker.block.runs - 1
        raise BackendError(
            f"The process of runs {first} to {last} of the sweep {ended}, {_TRIALS} times. What is "
            "finished is kept, and the same command continues. Look for a lack of memory, or run one alone."
        )
    return worker.trial + 1


def _result(answer: tuple[bool, Any]) -> Any:
    good, found = answer
    if not good:
        raise found
    return found
