"""Code for every package: the base of rig.toml's tables, CSV, text, files, tuples, pictures."""
