"""Linux's own CAN interfaces, which an administrator brings up and which may go down during a run."""

from __future__ import annotations

import errno
import socket
from typing import TYPE_CHECKING

from dcmp_hil.errors import LinkError, OpenError

if TYPE_CHECKING:
    from dcmp_hil.config.backends import Can

_WITHOUT_BITRATE = ("vcan", "vxcan", "slcan")  # virtual, or told by slcand


def check_there(settings: Can) -> None:
    """Raise if the interface does not exist; python-can would log that, and leave a socket open.

    Raises
    ------
    OpenError
        If there is none of that name.
    """
    try:
        socket.if_nametoindex(str(settings.channel))
    except OSError as error:
        raise OpenError(
            f"socketcan {settings.channel}: there is no such interface. `ip link` lists those that are. "
            f"Check backend.channel and the adapter, then bring it up: {_up(settings)}."
        ) from error


def is_down(error: BaseException) -> bool:
    """Whether that is what python-can raised an error for."""
    return getattr(error, "error_code", None) == errno.ENETDOWN


def was_down(settings: Can) -> OpenError:
    """Return the error for an interface that has not been brought up."""
    return OpenError(f"socketcan {settings.channel}: the interface is down. Bring it up: {_up(settings)}.")


def went_down(settings: Can) -> LinkError:
    """Return the error for an interface that went down during a run."""
    return LinkError(
        f"socketcan {settings.channel}: the interface went down. The device goes to 0 V by itself. Bring it "
        f"up again: {_up(settings)}. If it was not taken down on purpose, look at the adapter."
    )


def _up(settings: Can) -> str:
    channel = str(settings.channel)
    kind = "" if channel.startswith(_WITHOUT_BITRATE) else f" type can bitrate {settings.bitrate}"
    return f"sudo ip link set {channel} up{kind}"
