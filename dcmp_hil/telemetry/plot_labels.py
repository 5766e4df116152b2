"""From an entity's path to the title of its plot."""

_UNITS = {
    "_rad_s2": "rad/s²",
    "_rad_s": "rad/s",
    "_mrad_s": "mrad/s",
    "_mrad": "mrad",
    "_rad": "rad",
    "_N_m": "N·m",
    "_V": "V",
    "_A": "A",
    "_us": "µs",
}  # the longer ending before the shorter


def title(path: str) -> str:
    """Return a title with unit, such as ``Velocity [rad/s]`` for ``joint/velocity_rad_s``."""
    name = path.rpartition("/")[2]
    for ending, unit in _UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ').capitalize()} [{unit}]"
    return name.replace("_", " ").capitalize()
