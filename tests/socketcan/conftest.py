"""These tests are run in a machine whose kernel has CAN; here they are only reported.

In the machine, as root, pytest runs them as it runs any other; every report is written down as it comes.
On this side, the process that needs the first of them starts the machine for all, and passes on what was
written.
"""

from __future__ import annotations

import fcntl
import functools
import json
import os
import sys
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from dcmp_hil.errors import OpenError
from sim_backend.board.build import program
from tools.vcan_machine.debian import UnavailableError
from tools.vcan_machine.machine import missing, run

if TYPE_CHECKING:
    from collections.abc import Generator

HERE = Path(__file__).parent
IN_MACHINE = "DCMP_IN_VCAN_MACHINE"
SHARE, REPORTS, TESTS, OUTCOME = "socketcan", "reports.jsonl", "tests.txt", "outcome.json"
_THIS_RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID") or uuid.uuid4().hex
_PYTEST = ("-m", "pytest", "-p", "no:cacheprovider", "--color=no", "--verbose")

_reports: dict[str, list[dict[str, Any]]] = {}


class Outcome(NamedTuple):
    """Result of the machine's run."""

    run: str  # of pytest, whose processes share it
    problem: str = ""
    unavailable: bool = False  # the problem is this computer's


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Report what the test came to in the machine; where it came to nothing, its setup says why."""
    if IN_MACHINE in os.environ or outcome(item.session).unavailable:
        return None
    found = _reports.get(item.nodeid)
    if found is None:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for data in found:
        report = item.config.hook.pytest_report_from_serializable(config=item.config, data=data)
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip where there is no machine, or fail where nothing may be missing."""
    if IN_MACHINE in os.environ:
        return
    _, problem, unavailable = outcome(item.session)
    if unavailable and os.environ.get("CI") != "true":
        pytest.skip(problem)
    pytest.fail(problem or "the machine did not get as far as this test", pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """In the machine: write every report down."""
    report = yield
    if IN_MACHINE in os.environ:
        data = item.config.hook.pytest_report_to_serializable(config=item.config, report=report)
        with Path(os.environ[IN_MACHINE]).open("a") as file:
            file.write(json.dumps(data) + "\n")
    return report


@functools.cache
def outcome(session: pytest.Session) -> Outcome:
    """Read the reports; where no other process of this run has started the machine, start it."""
    lacking = missing()
    if lacking:
        return Outcome(_THIS_RUN, lacking, unavailable=True)
    share = session.config.rootpath / "reports" / SHARE
    share.mkdir(parents=True, exist_ok=True)
    with (share / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = _of_this_run(share)
        if found is None:
            found = _start_machine(session, share)
            (share / OUTCOME).write_text(json.dumps(found))
    for line in (share / REPORTS).read_text().splitlines():
        data = json.loads(line)
        _reports.setdefault(data["nodeid"], []).append(data)
    return found


def _of_this_run(share: Path) -> Outcome | None:
    try:
        found = Outcome(*json.loads((share / OUTCOME).read_text()))
    except (FileNotFoundError, ValueError):
        return None
    return found if found.run == _THIS_RUN else None


def _start_machine(session: pytest.Session, share: Path) -> Outcome:
    (share / REPORTS).write_text("")
    ours = [item.nodeid for item in session.items if item.path.is_relative_to(HERE)]
    (share / TESTS).write_text("".join(f"{name}\n" for name in ours))
    command = [sys.executable, *_PYTEST, f"@/mnt/{TESTS}"]
    settings = {IN_MACHINE: f"/mnt/{REPORTS}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    try:
        program()  # is compiled here, where that takes no time
        run(command, share, folder=session.config.rootpath, settings=settings)
    except (UnavailableError, OpenError) as error:
        return Outcome(_THIS_RUN, str(error), unavailable=True)
    except RuntimeError as error:
        return Outcome(_THIS_RUN, str(error))
    return Outcome(_THIS_RUN)
