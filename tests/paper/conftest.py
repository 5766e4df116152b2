"""One reproduction for the whole session: five runs of 20 s at 10 kHz are worth sharing."""

from __future__ import annotations

import pytest

from dcmp_hil.paper import Reproduction, reproduce
from dcmp_hil.session import Session
from tests.cli.conftest import cli
from tests.tracing import untraced

__all__ = ["cli"]

_run = Session.run


def _run_untraced(session: Session) -> None:
    """Run without coverage's tracer, as tests that are marked so; what judges the run stays traced."""
    with untraced():
        _run(session)


@pytest.fixture(scope="session")
def reproduction() -> Reproduction:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Session, "run", _run_untraced)
        return reproduce()
