"""The tables of backends and listeners: names in rig.toml to `module:factory`."""

BACKENDS = {
    "sim": "sim_backend.backend:SimBackend",
    "sim-board": "sim_backend.board.backend:SimBoardBackend",
    "serial": "dcmp_hil.device.links.serial:open_serial",
    "can": "dcmp_hil.device.links.can:open_can",
}
"""Backends; a factory takes (rig, clock)."""

LISTENERS = {
    "serial": "dcmp_hil.device.links.serial:listen",
    "can": "dcmp_hil.device.links.can:listen",
}
"""Links to listen on, one for every device on a wire; a factory takes (settings, clock)."""
