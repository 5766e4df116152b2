"""The table of backends: name in rig.toml to `module:factory`; a factory takes (rig, clock)."""

KINDS = {
    "sim": "sim_backend.backend:SimBackend",
    "sim-board": "sim_backend.board.backend:SimBoardBackend",
    "serial": "dcmp_hil.backends.serial_link:open_serial",
    "can": "dcmp_hil.backends.can_link:open_can",
}
