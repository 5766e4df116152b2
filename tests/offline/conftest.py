"""The command line, for what it does with recordings."""

from tests.cli.conftest import cli

__all__ = ["cli"]
