"""Links by themselves, for whoever only listens: from the same settings as a run's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.backends import Can, Serial
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from dcmp_hil.backends.link import Link
    from dcmp_hil.clock import Clock
    from dcmp_hil.section import Section


def make_link(settings: Section, clock: Clock) -> Link:
    """Make the link that `[backend]` describes, not yet open; by itself it writes nothing to a serial port.

    Raises
    ------
    ConfigError
        If that kind has no link that one could listen to.
    """
    if isinstance(settings, Serial):
        from dcmp_hil.backends.serial_link import SerialLink

        return SerialLink(settings.port, settings.baud, listen_only=True)
    if isinstance(settings, Can):
        from dcmp_hil.backends.can_link import CanLink

        return CanLink(settings, clock, listen_only=True)
    raise ConfigError(
        f'backend.kind: got "{getattr(settings, "kind", "")}", which has no wire to listen to. Use "serial" '
        'or "can", such as --set backend.kind=serial --set backend.port=/dev/ttyACM0.'
    )
