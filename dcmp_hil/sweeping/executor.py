"""Executors of a sweep: what runs its blocks, on one core, on all, or on a cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

T = TypeVar("T")


CLUSTER = "dcmp_hil.sweeping.cluster:DaskCluster"
"""`module:Class` of the executor of `--scheduler`, made as Class(address)."""


class SweepBlock(NamedTuple):
    """Consecutive runs of a sweep, which one worker runs: at least a second of work where there is as much.

    Parameters
    ----------
    number
        Of the block, from 0; a part of the results has the same number.
    first
        Number of its first run in the sweep.
    runs
        Number of runs.
    """

    number: int
    first: int
    runs: int


class Executor(Protocol):
    """Runs blocks of a sweep.

    Attributes
    ----------
    words
        Place where the blocks run, such as "2 processes".
    workers
        Number of blocks that run at the same time.
    """

    @property
    def words(self) -> str:
        """Place where the blocks run."""
        ...

    @property
    def workers(self) -> int:
        """Number of blocks that run at the same time."""
        ...

    def run(
        self, work: Callable[[SweepBlock], T], blocks: Iterable[SweepBlock]
    ) -> Iterator[tuple[SweepBlock, T]]:
        """Yield each block with what `work` returned for it, in the order in which they are finished.

        Closing the iterator ends what runs and waits for nothing. A worker that dies changes nothing: its
        block is run again.

        Parameters
        ----------
        work
            Can be pickled (some kilobytes), and is sent to a worker once; the same block always gives the
            same. It may raise ConfigError, which ends the sweep.
        blocks
            What is to be run.

        Raises
        ------
        ConfigError
            If `work` does, or no worker can be had.
        BackendError
            If workers die again and again, or the scheduler is lost.
        """
        ...
