"""rig.toml: read, checked, explained."""

from dcmp_hil.config.rig import Rig

__all__ = ["Rig"]
