"""The address behind `--scheduler`: its form, and whether something listens there."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

from dcmp_hil.errors import ConfigError, OpenError

SCHEMES = ("tcp", "tls")
"""Of Dask's protocols those that go from one computer to another, and need nothing else installed."""
_FORM = "Write tcp://HOST:PORT, or tls://HOST:PORT, as `dask scheduler` prints it when it starts."


def host_and_port(address: str) -> tuple[str, int]:
    """Return host and port of an address of a scheduler, such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ConfigError
        If it is none.
    """
    try:
        parts = urlsplit(address)
        host, port = parts.hostname or "", parts.port or 0
    except ValueError:  # such as port 99999, or a bracket that nothing closes
        raise ConfigError(f"--scheduler {address!r} has no valid host and port. {_FORM}") from None
    if parts.scheme not in SCHEMES or "://" not in address:
        raise ConfigError(f"--scheduler {address!r} is no address of a Dask scheduler. {_FORM}")
    if not host or not port:
        raise ConfigError(f"--scheduler {address!r} names no {'port' if host else 'host'}. {_FORM}")
    if parts.path.strip("/") or parts.query or parts.fragment or parts.username is not None:
        raise ConfigError(f"--scheduler {address!r} has more than a host and a port. {_FORM}")
    return host, port


def require_listener(address: str, timeout_s: float) -> None:
    """Look whether something listens at a scheduler's address: Dask itself tries for as long as it may.

    Raises
    ------
    ConfigError
        If it is no such address.
    OpenError
        If nothing answers within so many seconds.
    """
    try:
        socket.create_connection(host_and_port(address), timeout_s).close()
    except UnicodeError:  # a name that cannot be one, such as "a..b"
        raise ConfigError(f"--scheduler {address!r} has no valid host. {_FORM}") from None
    except OSError as error:
        seen = f"no answer within {timeout_s:g} s" if isinstance(error, TimeoutError) else error.strerror
        raise OpenError(
            f"No Dask scheduler can be reached at {address} ({seen}): compare the address with what "
            "`dask scheduler` printed, and see that it runs."
        ) from error
