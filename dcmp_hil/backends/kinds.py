"""The table of backends: name in rig.toml to `module:factory`; a factory takes (rig, clock)."""

KINDS = {"sim": "sim_backend.backend:SimBackend"}
