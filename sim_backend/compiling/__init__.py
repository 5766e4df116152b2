"""C sources compiled for this computer once, and kept in a cache of the user."""
