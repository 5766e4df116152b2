"""rig.toml: read, checked, explained."""

from dcmp_hil.config.load import change_rig, copy_rig, load_rig, load_table, load_tables, shipped_rigs
from dcmp_hil.config.rig import Rig

__all__ = ["Rig", "change_rig", "copy_rig", "load_rig", "load_table", "load_tables", "shipped_rigs"]
