"""Links that only listen, from the same settings as a run's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.device.links.registry import LISTENERS
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.named_class import find_named

if TYPE_CHECKING:
    from dcmp_hil.common.section import Section
    from dcmp_hil.device.links.base import Link
    from dcmp_hil.platform.clock import Clock


def make_listening_link(settings: Section, clock: Clock) -> Link:
    """Make the link that `[backend]` describes, not yet open; by itself it writes nothing to a serial port.

    Raises
    ------
    ConfigError
        If that kind has no link that one could listen to.
    """
    kind = getattr(settings, "kind", "")
    if kind not in LISTENERS:
        raise ConfigError(
            f'backend.kind: got "{kind}", which has no wire to listen to. Use "serial" '
            'or "can", such as --set backend.kind=serial --set backend.port=/dev/ttyACM0.'
        )
    link: Link = find_named(LISTENERS[kind], "backend.kind")(settings, clock)
    return link
