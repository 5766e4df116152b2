"""The connection to a Dask scheduler, made within a time limit: a client by itself waits for ever."""

from __future__ import annotations

import asyncio
import queue
import threading
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from dcmp_hil.sweeping.cluster_address import require_listener
from dcmp_hil.sweeping.cluster_errors import no_scheduler
from dcmp_hil.sweeping.dask_library import silent_log

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_CLOSE_S = 2.0
_SCHEDULER = "Scheduler"


@contextmanager
def connected(distributed: Any, address: str, limit_s: float) -> Iterator[Any]:
    """Give a client of a scheduler; in the end the scheduler forgets which of its blocks have not begun.

    Parameters
    ----------
    distributed
        The module.
    address
        Of the scheduler.
    limit_s
        Longest wait for each of its answers, s.

    Raises
    ------
    OpenError
        If no scheduler answers there.
    """
    require_listener(address, limit_s)
    with silent_log():
        client = _client(distributed, address, limit_s)
        try:
            yield client
        finally:
            with suppress(OSError, RuntimeError, AssertionError):  # the scheduler may have gone before
                client.close(timeout=_CLOSE_S)


def _client(distributed: Any, address: str, limit_s: float) -> Any:
    """Return a client, once a scheduler has said that it is one."""
    try:
        kind = _on_thread(lambda: asyncio.run(_kind(distributed, address, limit_s)), limit_s)
        if kind != _SCHEDULER:
            raise no_scheduler(address, TypeError(f"it is a {kind}"))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
            return _on_thread(
                lambda: distributed.Client(address, timeout=limit_s, set_as_default=False), limit_s
            )
    except (OSError, RuntimeError, TypeError, ValueError, ImportError) as error:
        raise no_scheduler(address, error) from error


async def _kind(distributed: Any, address: str, limit_s: float) -> str:
    """Return the kind of server that answers at an address."""
    security = distributed.Security().get_connection_args("client")
    remote = distributed.rpc(address, timeout=limit_s, connection_args=security)
    try:
        answer = await asyncio.wait_for(remote.identity(), limit_s)
        return str(answer["type"])
    finally:
        await remote.close_rpc()


def _on_thread(call: Callable[[], Any], limit_s: float) -> Any:
    """Return what a call returns that runs on a thread of its own: this one may have an event loop.

    Raises
    ------
    TimeoutError
        If it does not return in time.
    """
    answers = queue.SimpleQueue[tuple[Any, Exception | None]]()

    def run() -> None:
        try:
            answers.put((call(), None))
        except Exception as error:  # noqa: BLE001 - raised where it is awaited
            answers.put((None, error))

    threading.Thread(target=run, daemon=True).start()
    try:
        answer, error = answers.get(timeout=limit_s + _CLOSE_S)
    except queue.Empty:
        raise TimeoutError(f"no answer within {limit_s:g} s") from None
    if error is not None:
        raise error
    return answer
