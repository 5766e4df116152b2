"""What every room may use: the base of rig.toml's tables, CSV, text, files, tuples, pictures."""
