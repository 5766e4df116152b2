"""rig.toml: read, checked, explained."""

from dcmp_hil.config.load import copy_rig, load_rig, load_table, shipped_rigs
from dcmp_hil.config.rig import Rig

__all__ = ["Rig", "copy_rig", "load_rig", "load_table", "shipped_rigs"]
