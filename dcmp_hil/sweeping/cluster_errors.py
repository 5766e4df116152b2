"""Failures of a cluster in words: each says what to do. The sweep adds how much it keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.errors import BackendError, OpenError

if TYPE_CHECKING:
    from dcmp_hil.sweeping.cluster_worker import Installed
    from dcmp_hil.sweeping.executor import SweepBlock

_CONSISTENT = "Scheduler, workers and this computer need the same version of Dask and of Python"


def no_scheduler(address: str, error: BaseException) -> OpenError:
    """Return that what listens at an address cannot be talked to as a scheduler."""
    return OpenError(
        f"What listens at {address} does not answer as a Dask scheduler ({_text(error)}): see that the port "
        "is the scheduler's, and that tls:// is written exactly if it uses TLS (Dask's configuration names "
        f"the certificates). {_CONSISTENT}."
    )


def no_workers(address: str, waited_s: float) -> OpenError:
    """Return that a scheduler has no worker, and got none."""
    return OpenError(
        f"The Dask cluster at {address} has no worker, and none came within {waited_s:g} s: start some with "
        f"`dask worker {address}`."
    )


def other_versions(where: str, here: Installed, there: Installed) -> BackendError:
    """Return that a worker would give other bits."""
    return BackendError(
        f"The worker {where} has {there}, and this computer {here}: the same run would differ. "
        f"Install dcmp-hil {here.version} there, or take that worker off the cluster."
    )


def unusable_worker(where: str, error: BaseException) -> BackendError:
    """Return that a worker cannot do this work, such as without dcmp-hil."""
    return BackendError(
        f"The worker {where} cannot run a sweep ({_text(error)}): install dcmp-hil there as here, "
        f"with its `cluster` extra, or take that worker off the cluster."
    )


def lost_workers(address: str, waited_s: float) -> BackendError:
    """Return that the last worker has gone."""
    return BackendError(
        f"The Dask cluster at {address} has lost its last worker, and no other came within {waited_s:g} s: "
        f"start some with `dask worker {address}`."
    )


def lost_scheduler(address: str) -> BackendError:
    """Return that the scheduler has gone."""
    return BackendError(
        f"The Dask scheduler at {address} has gone, or is not reached any more: see that it runs, and why "
        f"it ended."
    )


def silent_scheduler(address: str, waited_s: float) -> BackendError:
    """Return that the scheduler is there and does not answer."""
    return BackendError(
        f"The Dask scheduler at {address} has not answered for {waited_s:g} s: see whether it stands "
        f"still, or the network does."
    )


def failed_block(block: SweepBlock, error: BaseException) -> BackendError:
    """Return that a block cannot be run: it ends every worker that tries, or raises."""
    runs = f"runs {block.first} to {block.first + block.runs - 1}"
    if type(error).__name__ == "KilledWorker":
        tries = getattr(error, "allowed_failures", 0) + 1
        return BackendError(
            f"{tries} workers in succession died while they had block {block.number} ({runs}): their logs "
            f"say why; give each more memory, or fewer threads."
        )
    if isinstance(error, ModuleNotFoundError):
        return unusable_worker(f"that had block {block.number}", error)
    return BackendError(
        f"Block {block.number} ({runs}) failed on a worker ({_text(error)}): without --scheduler it runs "
        f"here, and shows more. {_CONSISTENT}."
    )


def _text(error: BaseException) -> str:
    """Return an error in one line of at most 200 characters."""
    if isinstance(error, TimeoutError) and not error.args:
        return "no answer in time"
    words = " ".join(str(error).split())
    name = type(error).__name__
    return (f"{name}: {words}" if words else name)[:200]
