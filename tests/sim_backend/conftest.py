"""What compiles the firmware."""

import pytest

from tests.firmware.core_library import compiler


@pytest.fixture(scope="session")
def needs_compiler() -> None:
    """Skip where there is no C compiler; fail where nothing may be missing."""
    compiler()
