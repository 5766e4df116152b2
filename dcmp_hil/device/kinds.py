"""The tables of backends and links: names in rig.toml to `module:factory`."""

KINDS = {
    "sim": "sim_backend.backend:SimBackend",
    "sim-board": "sim_backend.board.backend:SimBoardBackend",
    "serial": "dcmp_hil.device.serial_link:open_serial",
    "can": "dcmp_hil.device.can_link:open_can",
}
"""Backends; a factory takes (rig, clock)."""

LINKS = {
    "serial": "dcmp_hil.device.serial_link:listen",
    "can": "dcmp_hil.device.can_link:listen",
}
"""Links to listen on, one for every device on a wire; a factory takes (settings, clock)."""
