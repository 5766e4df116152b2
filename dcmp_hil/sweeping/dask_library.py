"""Dask: imported when a sweep asks for a cluster and not before, and kept from logging on the terminal."""

from __future__ import annotations

import importlib
import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import BackendError

if TYPE_CHECKING:
    from collections.abc import Iterator

_LOGGERS = ("distributed", "tornado", "asyncio")


def import_distributed() -> Any:
    """Return the module `distributed`, which takes a second to import.

    Raises
    ------
    BackendError
        If it is not installed, or cannot be imported.
    """
    try:
        return importlib.import_module("distributed")
    except ModuleNotFoundError as error:
        raise BackendError(
            f"--scheduler needs Dask, and {error.name} is not installed: pip install 'dcmp-hil[cluster]'"
        ) from None
    except (ImportError, OSError, ValueError) as error:  # ValueError: a configuration that is no YAML
        raise BackendError(
            f"Dask is installed and cannot be imported ({error}): mend that, or leave --scheduler out."
        ) from error


@contextmanager
def silent_log() -> Iterator[None]:
    """Keep Dask from writing its log to standard error: what matters of it is raised, in one sentence."""
    loggers = [
        logging.getLogger(name)
        for name in list(logging.root.manager.loggerDict)
        if name.partition(".")[0] in _LOGGERS
    ]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
