"""A run whose command process is gone, or too slow: what the page is told, up to the run's end."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.ipc.mailbox import Mailbox
from dcmp_hil.ipc.run_end import AT_ZERO, UNCONFIRMED
from dcmp_hil.panel import run_follower
from dcmp_hil.panel.run_follower import Watcher

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_RUN = 4_000_000  # no process has that number
_POLLS_MAX = 30_000


class _Run:
    """A run that is found once, and whose command process then does not listen any more.

    `looks` are the runs that the next looks find to listen; none behind them.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, place: Path) -> None:
        self.mailbox: Mailbox | None = Mailbox()
        self.alive, self.looks = True, [[_RUN]]
        self.watcher = Watcher(None)
        monkeypatch.setattr(run_follower, "_SEARCH_PERIOD_S", 0.001)
        monkeypatch.setattr(run_follower, "running", self._running)
        monkeypatch.setattr(run_follower, "mailbox_of", lambda _: self.mailbox)
        monkeypatch.setattr(run_follower, "is_alive", lambda _: self.alive)
        monkeypatch.setattr(run_follower, "socket_of", lambda _: place)

    def _running(self) -> list[int]:
        return self.looks.pop(0) if self.looks else []

    async def until(self, connection: str) -> None:
        await _until(lambda: self.watcher.state["connection"] == connection)


async def _until(done: Callable[[], bool]) -> None:
    for _ in range(_POLLS_MAX):
        if done():
            return
        await asyncio.sleep(0.001)
    pytest.fail("never")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> _Run:
    return _Run(monkeypatch, tmp_path / "none")


@pytest.mark.parametrize("looks", [1, 2, 5])  # a process that is killed may listen for a moment longer
def test_a_run_without_its_command_process_is_kept_for_stop_up_to_its_own_last_words(
    run: _Run, looks: int
) -> None:
    run.looks = [[_RUN]] * looks

    async def scenario() -> None:
        watching = asyncio.ensure_future(run.watcher.watch())
        await run.until("unseen")
        assert run.watcher.run == _RUN  # for STOP
        assert run.watcher.state["pid"] == _RUN
        assert run.mailbox is not None
        run.mailbox.tell_end("Amplifier at 0 V.", AT_ZERO)
        await run.until("ended")
        await _until(lambda: run.watcher.run is None)
        watching.cancel()

    asyncio.run(scenario())
    assert (run.watcher.state["ended"], run.watcher.state["at_zero"]) == ("Amplifier at 0 V.", True)


@pytest.mark.parametrize(
    ("end", "mailbox", "words"),
    [
        (None, Mailbox(), "it died; the device goes to 0 V by itself."),
        (UNCONFIRMED, Mailbox(), "0 V was not confirmed."),
        (None, None, "it left without a word; how is not known here."),
    ],
)
def test_0_V_is_not_claimed_of_a_run_that_did_not_say_so(
    run: _Run, end: int | None, mailbox: Mailbox | None, words: str
) -> None:
    if mailbox is not None and end is not None:
        mailbox.tell_end(words, end)
    run.mailbox, run.alive = mailbox, False

    async def scenario() -> None:
        watching = asyncio.ensure_future(run.watcher.watch())
        await run.until("ended")
        watching.cancel()

    asyncio.run(scenario())
    assert (run.watcher.state["ended"], run.watcher.state["at_zero"]) == (words, False)


def test_a_command_process_that_hangs_up_and_listens_is_asked_again(run: _Run, tmp_path: Path) -> None:
    asked = []
    run.looks = [[_RUN], [_RUN]]

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        asked.append(await reader.readline())
        if len(asked) > 1:
            writer.write(b'{"pid": %d, "t_s": 1.0, "knobs": [{"high": Infinity}]}\n' % _RUN)
            await reader.read()  # to the end
        writer.close()

    async def scenario() -> None:
        async with await asyncio.start_unix_server(serve, tmp_path / "none"):
            watching = asyncio.ensure_future(run.watcher.watch())
            await run.until("live")
            watching.cancel()
            await asyncio.wait({watching})

    asyncio.run(scenario())
    assert run.watcher.run == _RUN
    assert run.watcher.state["knobs"] == [{"high": None}]  # of a run of an older version
