"""Fixtures for every test, and the figures that tests measure, at the end of what is printed."""

import os
import subprocess
from collections.abc import Callable, Generator, Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import settings

from tests import tracing
from tests.firmware.core_library import compiler
from tests.installed import Finished, environment, install
from tests.live.processes import own_folder
from tests.sampling import MARKER, chosen, file_is_drawn
from tools import screenshot

FIGURE = "figure"
_LONG = ("tests/stateful/", "tests/socketcan/", "tests/target/", "tests/firmware/test_")  # minutes, alone
_SLOW = (
    *_LONG,
    *(f"tests/{name}/" for name in ("attacks", "conformance", "faults", "install", "panel", "walk")),
    "tests/sweeping/test_cluster",
)

# An example that a busy computer is slow at is no fault.
settings.register_profile("dcmp-hil", settings(), deadline=None)
settings.load_profile("dcmp-hil")

# Between the look for a free port and its use another worker could take it.
screenshot.FIRST_PORT += 100 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])


@pytest.fixture
def figure(record_property: Callable[[str, object], None]) -> Callable[[str], None]:
    """Give a way to have a line printed at the end: a size, a count, what CI's output is to keep track of."""
    return lambda line: record_property(FIGURE, line)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Say how much of what is marked `sampled` is run."""
    parser.addoption("--sample", type=int, default=1, metavar="N", help=f"of tests marked {MARKER}, one in N")
    parser.addoption("--sample-files", type=int, default=1, metavar="N", help="of a folder's files, one in N")
    parser.addoption("--sample-of", default="", metavar="TEXT", help="what draws them, such as a commit")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the files of tests that are not drawn, before they are imported."""
    if not collection_path.match("test_*.py"):
        return None
    drawn = file_is_drawn(
        collection_path, config.getoption("--sample-files"), config.getoption("--sample-of")
    )
    return None if drawn else True


@pytest.hookimpl(tryfirst=True)  # before -m selects by markers
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with what takes longest: begun last, it would leave the other workers without work."""
    one_in, text = config.getoption("--sample"), config.getoption("--sample-of")
    cases: dict[str, list[str]] = {}
    for item in items:
        if item.get_closest_marker(MARKER):
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item.nodeid)
    left_out = {name for names in cases.values() for name in names if name not in chosen(names, one_in, text)}
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in left_out])
    items[:] = [item for item in items if item.nodeid not in left_out]
    for item in items:
        if item.nodeid.startswith(_SLOW):
            item.add_marker("slow")
    items.sort(key=lambda item: not item.nodeid.startswith(_LONG))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the figures of the tests that passed, from every worker."""
    passed = terminalreporter.stats.get("passed", [])
    lines = sorted(str(line) for report in passed for name, line in report.user_properties if name == FIGURE)
    if lines:
        terminalreporter.section("figures")
        for line in lines:
            terminalreporter.line(line)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Run long tests without coverage's tracer, and the fixtures that are made for them."""
    long = item.nodeid.startswith(tracing.FOLDERS) or item.get_closest_marker(tracing.MARKER)
    with tracing.untraced() if long else nullcontext():
        return (yield)


@pytest.fixture(scope="session")
def needs_compiler() -> None:
    """Skip where there is no C compiler; fail where nothing may be missing."""
    compiler()


@pytest.fixture
def own_run_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Keep the sockets of a test's runs where no other run's are."""
    with own_folder(monkeypatch) as folder:
        yield folder


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the script `dcmp-hil` of an installed wheel."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return install(shared / "installed")


@pytest.fixture
def script(installed: Path, tmp_path: Path) -> Callable[..., Finished]:
    """Run `dcmp-hil` of an installed wheel as a process, in an empty folder unless told otherwise."""

    def run(
        *arguments: str,
        cwd: Path = tmp_path,
        env: dict[str, str | None] | None = None,
        timeout: float = 120.0,
        encoding: str = "utf-8",
    ) -> Finished:
        done = subprocess.run(
            [str(installed), *arguments],
            cwd=cwd,
            env=environment(**(env or {})),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding=encoding,
            timeout=timeout,
            check=False,
        )
        return Finished(done.returncode, done.stdout, done.stderr)

    return run
