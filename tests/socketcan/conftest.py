"""These tests are run in a machine whose kernel has CAN; here they are only reported.

In the machine, as root, pytest runs them as it runs any other; every report is written down as it comes.
On this side, whichever process needs the first of them starts the machine for all, and hands on what was
written.
"""

from __future__ import annotations

import fcntl
import json
import os
import sys
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tools.vcan_machine.machine import missing, run

if TYPE_CHECKING:
    from collections.abc import Generator

HERE = Path(__file__).parent
IN_MACHINE = "DCMP_IN_VCAN_MACHINE"
SHARE, REPORTS, TESTS, OF_RUN = "socketcan", "reports.jsonl", "tests.txt", "of-run"
_THIS_RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID") or uuid.uuid4().hex
_PYTEST = ("-m", "pytest", "-p", "no:cacheprovider", "--color=no", "--verbose")

_reports: dict[str, list[dict[str, Any]]] = {}
_problem: list[str] = []


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Report what the test came to in the machine; where it came to nothing, its setup says why."""
    if IN_MACHINE in os.environ or missing():
        return None
    if not _reports and not _problem:
        _take_reports(item.session)
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
def pytest_runtest_setup() -> None:
    """Skip where there is no machine, or fail where nothing may be missing."""
    if IN_MACHINE in os.environ:
        return
    lacking = missing()
    if not lacking:
        pytest.fail(" ".join(_problem) or "the machine did not get that far", pytrace=False)
    if os.environ.get("CI") == "true":
        pytest.fail(lacking)
    pytest.skip(lacking)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """In the machine: write every report down."""
    report = yield
    if IN_MACHINE in os.environ:
        data = item.config.hook.pytest_report_to_serializable(config=item.config, report=report)
        with Path(os.environ[IN_MACHINE]).open("a") as file:
            file.write(json.dumps(data) + "\n")
    return report


def _take_reports(session: pytest.Session) -> None:
    """Read them; where no other process of this run has started the machine, start it."""
    share = session.config.rootpath / "reports" / SHARE
    share.mkdir(parents=True, exist_ok=True)
    with (share / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _is_of_this_run(share):
            _start_machine(session, share)
    for line in (share / REPORTS).read_text().splitlines():
        data = json.loads(line)
        _reports.setdefault(data["nodeid"], []).append(data)


def _is_of_this_run(share: Path) -> bool:
    try:
        return (share / OF_RUN).read_text() == _THIS_RUN
    except FileNotFoundError:
        return False


def _start_machine(session: pytest.Session, share: Path) -> None:
    from sim_backend.firmware import program

    (share / REPORTS).write_text("")
    ours = [item.nodeid for item in session.items if item.path.is_relative_to(HERE)]
    (share / TESTS).write_text("".join(f"{name}\n" for name in ours))
    command = [sys.executable, *_PYTEST, f"@/mnt/{TESTS}"]
    settings = {IN_MACHINE: f"/mnt/{REPORTS}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    program()  # is compiled here, where that takes no time
    try:
        run(command, share, folder=session.config.rootpath, settings=settings)
    except RuntimeError as error:
        _problem.append(str(error))
    (share / OF_RUN).write_text(_THIS_RUN)
