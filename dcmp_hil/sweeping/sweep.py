"""A sweep from its spec to its table: what is missing is run, block by block, and kept."""

from __future__ import annotations

import errno
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.control.elementary import NUMERICS
from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.disk_space import room_for
from dcmp_hil.sweeping.executor import SweepBlock
from dcmp_hil.sweeping.manifest import (
    FILE_NAME,
    Manifest,
    about,
    locked,
    read_manifest,
    require_same,
    write_manifest,
)
from dcmp_hil.sweeping.parts import load_pyarrow, read_part, table_of, write_part

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from dcmp_hil.sweeping.block_work import RunRow
    from dcmp_hil.sweeping.executor import Executor
    from dcmp_hil.sweeping.preparation import PreparedSweep


class Progress(NamedTuple):
    """State of a sweep: runs that are finished."""

    runs: int
    """Runs that are finished."""
    found: int
    """Of these, runs that were there before."""


class SweepRun:
    """The blocks of a sweep, run and kept.

    Parameters
    ----------
    prepared
        Of `prepare`.
    executor
        What runs the blocks.
    folder
        Where the parts are; None keeps them in memory.
    together
        Whether blocks have a second of work even where some workers then have none.

    Raises
    ------
    ConfigError
        If the folder is of another sweep, cannot be used, or its disk has too little room.
    """

    def __init__(
        self,
        prepared: PreparedSweep,
        executor: Executor,
        folder: Path | None,
        *,
        together: bool = False,
    ) -> None:
        self._prepared, self._executor, self._folder = prepared, executor, folder
        total, work = prepared.design.total, prepared.work
        wanted = about(work.spec, work.base, NUMERICS)
        runs = prepared.runs_per_part(executor.workers, together=together)
        self._manifest = Manifest(wanted, runs)
        known = None if folder is None else read_manifest(folder)
        if folder is not None and known is not None:
            require_same(folder, known, wanted)
            self._manifest = known
        runs = self._manifest.runs_per_part
        self.blocks = [
            SweepBlock(number, first, min(runs, total - first))
            for number, first in enumerate(range(0, total, runs))
        ]
        self._tables: dict[int, Any] = {}
        self.damaged = 0

    def __iter__(self) -> Iterator[Progress]:
        """Run what is missing; yield the progress at the start, and whenever a block is finished.

        Raises
        ------
        ConfigError
            If a part cannot be written; those that are there stay.
        """
        with ExitStack() as stack:
            missing = self.blocks
            if self._folder is not None:
                missing = self._open(self._folder, stack)
            total = self._prepared.design.total
            done = found = total - sum(block.runs for block in missing)
            yield Progress(done, found)
            finished = self._executor.run(self._prepared.work, missing)
            stack.callback(getattr(finished, "close", int))
            for block, rows in finished:
                self._keep(block, rows)
                done += block.runs
                yield Progress(done, found)

    def table(self) -> Any:
        """Return the rows of all runs as a table of Arrow."""
        tables = [self._tables[block.number] for block in self.blocks]
        return load_pyarrow().concat_tables(tables)

    def _open(self, folder: Path, stack: ExitStack) -> list[SweepBlock]:
        """Make the folder, look at what is in it, and return what is missing."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not (folder / FILE_NAME).exists() and any(folder.glob("part-*.parquet")):
                raise ConfigError(f"{folder}: parts without a manifest. Choose another --out.")
            stack.enter_context(locked(folder))
            known = {block.number: read_part(folder, block, self._prepared.schema) for block in self.blocks}
            self._tables = {number: table for number, table in known.items() if table is not None}
            missing = [block for block in self.blocks if block.number not in self._tables]
            self.require_room(missing)
            write_manifest(folder, self._manifest)
        except OSError as error:
            raise ConfigError(f"{folder}: {error.strerror}. Choose another --out.") from None
        return missing

    @property
    def bytes_to_write(self) -> float:
        """Bytes of all results, at most."""
        return self._bytes_of(self.blocks)

    def require_room(self, missing: Sequence[SweepBlock] | None = None) -> None:
        """Raise ConfigError if the results of blocks, by default of all, have too little room on the disk."""
        if self._folder is None:
            return
        needed = self._bytes_of(self.blocks if missing is None else missing)
        room = room_for(_first_there(self._folder) / FILE_NAME)
        if needed > room:
            raise ConfigError(
                f"{self._folder}: the results take up to {1e-6 * needed:,.1f} MB, and {1e-6 * room:,.1f} MB "
                "are free there. Free some, choose another --out, or write fewer runs."
            )

    def _bytes_of(self, blocks: Sequence[SweepBlock]) -> float:
        runs = sum(block.runs for block in blocks)
        return self._prepared.bytes_of(runs, self._manifest.runs_per_part)

    def _keep(self, block: SweepBlock, rows: list[RunRow]) -> None:
        if self._folder is not None:
            try:
                write_part(self._folder, block, rows, self._prepared.schema)
            except OSError as error:
                full = error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
                remedy = "Free some space" if full else "Mend that"
                raise ConfigError(
                    f"{self._folder}: {error.strerror}. What is finished is kept. {remedy}, and the same "
                    "command continues."
                ) from None
        self._tables[block.number] = table_of(rows, self._prepared.schema)


def _first_there(folder: Path) -> Path:
    """Return a folder, or the nearest one around it that exists."""
    return next((one for one in (folder, *folder.absolute().parents) if one.exists()), folder)
