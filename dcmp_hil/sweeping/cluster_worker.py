"""Worker's side of a sweep on a cluster: it says which versions it has, and runs blocks.

Both functions are found there by name. What travels are the pickled work and the block, and the result.
"""

from __future__ import annotations

import pickle
import socket
import threading
from typing import TYPE_CHECKING, Any, NamedTuple

import dcmp_hil
from dcmp_hil.control.elementary import NUMERICS
from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping.executor import SweepBlock

if TYPE_CHECKING:
    from collections.abc import Callable


class Installed(NamedTuple):
    """Versions that decide over the bits of a run: computers on which they are the same give the same."""

    version: str
    """Of dcmp-hil."""
    numerics: int
    """Version of the arithmetic."""

    def __str__(self) -> str:
        """Return it in words."""
        return f"dcmp-hil {self.version} with numerics {self.numerics}"


class BlockReply(NamedTuple):
    """Answer to a block: its result, or why there is none."""

    result: bytes = b""
    """Return value of the work, pickled."""
    other: Installed | None = None
    """Versions of that computer, where they differ: the block did not run."""
    host: str = ""
    """Name of that computer."""
    faults: tuple[str, ...] = ()
    """Faults of the ConfigError that the work raised."""


class _Latest(threading.local):
    """The work that this thread did last: an engine is used by one thread at a time."""

    data: bytes = b""
    call: Callable[[SweepBlock], Any] | None = None


_latest = _Latest()


def installed() -> Installed:
    """Return the versions of this computer."""
    return Installed(dcmp_hil.__version__, NUMERICS)


def run_block(wanted: tuple[str, int], work: bytes, block: tuple[int, int, int]) -> tuple[Any, ...]:
    """Run a block of a sweep.

    Parameters
    ----------
    wanted
        The fields of `Installed` where the sweep was started.
    work
        What is called with the block, pickled there.
    block
        The fields of a SweepBlock.

    Returns
    -------
    tuple
        The fields of a BlockReply.
    """
    here = installed()
    if here != tuple(wanted):
        return BlockReply(other=here, host=socket.gethostname())
    if _latest.call is None or _latest.data != work:
        _latest.call, _latest.data = pickle.loads(work), work  # noqa: S301 - Dask runs what a client sends anyway
    try:
        result = _latest.call(SweepBlock(*block))
    except ConfigError as error:
        return BlockReply(faults=error.faults, host=socket.gethostname())
    return BlockReply(pickle.dumps(result))
