"""The core's tests, collected once and run in a fork for every mutant: to import them takes long.

`python -m tools.mutants.trial TASK RESULT [TEST ...]`, as `tools.mutants.trials` starts it.
"""

from __future__ import annotations

import gc
import json
import mmap
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.firmware.core_library import PREBUILT, interface

if TYPE_CHECKING:
    from collections.abc import Sequence

SURVIVED, KILLED, BROKEN = 0, 101, 102
"""How a child ends."""
TIME_LIMIT_S = 1.5
"""Of the processor, for one test: far more than the slowest needs."""
WALL_LIMIT_S = 60
"""By the clock, should one wait for something."""
PLAIN = ["-q", "-s", "-p", "no:cacheprovider", "-p", "no:faulthandler", "-p", "no:xdist", "-p", "no:cov"]
PLAIN += ["-p", "no:hypothesispytest"]


class Trials:
    """Takes the place of pytest's loop over the tests.

    Parameters
    ----------
    task : dict
        `original`, the library without a fault, and `mutants`, a list of number, file and library.
    """

    def __init__(self, task: dict[str, Any]) -> None:
        self.task = task
        self.found: list[tuple[int, str, str]] = []
        self.running = mmap.mmap(-1, 4)

    def pytest_configure(self) -> None:
        """Make Hypothesis use the same examples each time; here, since pytest must import it first."""
        from hypothesis import Phase, settings

        phases = [Phase.explicit, Phase.generate]
        settings.register_profile("mutants", derandomize=True, database=None, deadline=None, phases=phases)
        settings.load_profile("mutants")

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Try every mutant; the tests that found one in a file are the first to look at the file's next."""
        interface()
        gc.freeze()
        tests = session.items
        verdict, test = self._forked(tests, self.task["original"])
        if verdict != "survived":
            raise pytest.UsageError(f"without a mutant: {verdict} by {test and test.nodeid}")
        orders: dict[str, list[pytest.Item]] = {}
        for number, file, library in self.task["mutants"]:
            order = orders.setdefault(file, by_name(tests, file))
            verdict, test = self._forked(order, library)
            if test is not None:
                order.remove(test)
                order.insert(0, test)
            self.found.append((number, verdict, test.nodeid if test else ""))
        return True

    def _forked(self, tests: Sequence[pytest.Item], library: str) -> tuple[str, pytest.Item | None]:
        child = os.fork()
        if not child:
            self._run(tests, library)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status) and os.WEXITSTATUS(status) == SURVIVED:
            return "survived", None
        if os.WIFEXITED(status) and os.WEXITSTATUS(status) != KILLED:
            raise pytest.UsageError(f"a trial of {library} broke")
        slow = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGPROF, signal.SIGALRM)
        return "time" if slow else "tests", tests[int.from_bytes(self.running[:4], "little")]

    def _run(self, tests: Sequence[pytest.Item], library: str) -> None:
        """Run the tests until one fails; this process ends here."""
        os.environ[PREBUILT] = library
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        try:
            for number, test in enumerate(tests):
                self.running[:4] = number.to_bytes(4, "little")
                signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT_S)
                signal.alarm(WALL_LIMIT_S)
                following = tests[number + 1] if number + 1 < len(tests) else None
                test.config.hook.pytest_runtest_protocol(item=test, nextitem=following)
        except BaseException:  # noqa: BLE001  # after any exception, a child must not go on as the parent
            os._exit(BROKEN)
        os._exit(SURVIVED)

    def pytest_runtest_makereport(self, call: pytest.CallInfo[None]) -> None:
        """End with the first failure, before pytest takes the time to describe it."""
        if call.excinfo is not None and not call.excinfo.errisinstance(pytest.skip.Exception):
            os._exit(KILLED)


def by_name(tests: Sequence[pytest.Item], file: str) -> list[pytest.Item]:
    """Put the tests first whose file is called as the source is."""
    stem = Path(file).stem.removeprefix("dcmp_").rstrip("s")
    stem = "elementary" if stem == "real" else stem  # which its numbers are for
    return sorted(tests, key=lambda test: stem not in test.path.name)


def main(task: str, result: str, *tests: str) -> int:
    """Try the mutants of a task; leave what became of them."""
    trials = Trials(json.loads(Path(task).read_text("utf-8")))
    ended = pytest.main([*PLAIN, *tests], plugins=[trials])
    Path(result).write_text(json.dumps(trials.found), "utf-8")
    return int(ended)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
