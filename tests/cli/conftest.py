"""The command line, called in this process: what it printed and how it left."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from dcmp_hil.cli import main


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture
def cli(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Callable[..., Outcome]:
    """Call `dcmp-hil` with arguments, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    # Threads that other tests left stuck are none of this process's business.
    monkeypatch.setattr("dcmp_hil.cli.leave", lambda _: None)

    def call(*arguments: str) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["dcmp-hil", *arguments])
        code = 0
        try:
            main()
        except SystemExit as leaving:
            code = leaving.code if isinstance(leaving.code, int) else 0 if leaving.code is None else 1
        captured = capfd.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call
