"""The command process's server, in this process: who is answered, and with what."""

from __future__ import annotations

import asyncio
import json
import math
import os
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config.rig import KINDS
from dcmp_hil.ipc.mailbox import APPLIED, LOWERING, MAILBOX_BYTES, Answer, Mailbox
from dcmp_hil.ipc.ring import Ring, size_of
from dcmp_hil.ipc.run_end import AT_ZERO, FORCED, LIVES, NOT_ARMED, UNCONFIRMED
from dcmp_hil.ipc.shared_memory import mapped, reserve
from dcmp_hil.live import command_server
from dcmp_hil.live.envelopes import Envelopes
from dcmp_hil.values import Estimate, Truth
from tests.helpers import bench, cycle

if TYPE_CHECKING:
    from pathlib import Path

_RING_ROWS = 16


class _Rig:
    """What a run would share with its command process, and a loop that answers as it is told to."""

    def __init__(self, *overrides: str) -> None:
        files = [reserve(self, "mailbox"), reserve(self, "ring")]
        self.mailbox = Mailbox(mapped(files[0], MAILBOX_BYTES))
        self.ring = Ring(_RING_ROWS, mapped(files[1], size_of(_RING_ROWS)))
        setup = command_server.CommandSetup(bench(*overrides), files[0], files[1])
        self.server = command_server.Server(setup, Mailbox(mapped(files[0], MAILBOX_BYTES)), os.getpid())
        self.answer: int | None = APPLIED

    async def ask(self, place: Path, *requests: Any) -> list[Any]:
        """Send lines, return the answers."""
        async with await asyncio.start_unix_server(self.server.serve, place):
            reader, writer = await asyncio.open_unix_connection(place)
            loop = asyncio.ensure_future(self._loop())
            answers = []
            try:
                for request in requests:
                    line = request if isinstance(request, bytes) else json.dumps(request).encode()
                    writer.write(line + b"\n")
                    reply = b""
                    with suppress(ConnectionError):
                        reply = await asyncio.wait_for(reader.readline(), 5.0)
                    answers.append(_strict(reply) if reply else None)
            finally:
                loop.cancel()
                writer.close()
            return answers

    async def _loop(self) -> None:
        while True:
            if self.answer is not None and self.mailbox.answer(self.mailbox.words[0]) is None:
                self.mailbox.reply(self.mailbox.words[0], Answer(self.answer, 3.25))
            await asyncio.sleep(0.001)


def _strict(line: bytes) -> Any:
    """Read a line as a browser does, which knows neither Infinity nor NaN."""
    return json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} in {line!r}"))


@pytest.fixture
def rig() -> _Rig:
    return _Rig()


def _change(*overrides: str) -> dict[str, Any]:
    return {"do": "set", "changes": list(overrides)}


def test_change_is_read_back_and_what_is_applied_is_the_new_state(rig: _Rig, tmp_path: Path) -> None:
    said, refused, state = asyncio.run(
        rig.ask(
            tmp_path / "s",
            _change("controller.kp_1_s2=5200"),
            _change("controller.kd_1_s=fast"),
            {"do": "status"},
        )
    )
    words = "controller.kp_1_s2: 4000 -> 5200, applied at 3.250 s"
    assert said == {"ok": True, "said": words, "t": 3.25, "warnings": []}
    assert refused["ok"] is False
    values = {knob["key"]: knob["value"] for knob in state["knobs"]}
    assert (values["controller.kp_1_s2"], values["controller.kd_1_s"]) == (5200.0, 130.0)


@pytest.mark.parametrize(
    ("answer", "why"), [(LOWERING, "being lowered"), (3, "events say why"), (None, "within 1 s")]
)
def test_change_that_was_not_taken_is_not_shown_as_applied(
    rig: _Rig, tmp_path: Path, answer: int | None, why: str
) -> None:
    rig.answer = answer
    said, state = asyncio.run(rig.ask(tmp_path / "s", _change("controller.kp_1_s2=5200"), {"do": "status"}))
    assert said["ok"] is False
    assert why in said["said"]
    assert {knob["key"]: knob["value"] for knob in state["knobs"]}["controller.kp_1_s2"] == 4000.0
    assert rig.mailbox.take() is None or answer is not None  # withdrawn: it is not applied later


def test_state_is_the_newest_period_in_numbers_and_words(rig: _Rig, tmp_path: Path) -> None:
    (empty,) = asyncio.run(rig.ask(tmp_path / "s", {"do": "status"}))
    assert (empty["t_s"], empty["phase"], empty["fault"]) == (None, "arming", "")
    for k in range(3):
        rig.ring.push(cycle(0.001 * k, position=0.5, applied=2.0), Truth(0.0, 0.0, 0.0))
    rig.mailbox.tell_phase(4)
    (state,) = asyncio.run(rig.ask(tmp_path / "t", {"do": "status"}))
    assert (state["t_s"], state["position_rad"], state["voltage_V"]) == (0.002, 0.5, 2.0)
    assert state["phase"] == "running"


def test_another_user_is_not_answered(rig: _Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_server, "peer_of", lambda _: (1, os.getuid() + 1))
    assert asyncio.run(rig.ask(tmp_path / "s", {"do": "status"})) == [None]


@pytest.mark.parametrize("line", [b"nonsense", b"\xff\xfe", b"[" * 5000])
def test_what_is_no_request_ends_the_connection(rig: _Rig, tmp_path: Path, line: bytes) -> None:
    assert asyncio.run(rig.ask(tmp_path / "s", line)) == [None]


@pytest.mark.parametrize("changes", [None, "a=1", [1], {"a": 1}])
def test_change_that_is_no_list_of_texts_is_refused(rig: _Rig, tmp_path: Path, changes: object) -> None:
    (said,) = asyncio.run(rig.ask(tmp_path / "s", {"do": "set", "changes": changes}))
    assert said == {"ok": False, "said": "A change is a list of KEY=VALUE."}


@pytest.mark.parametrize(
    ("end", "at_zero"),
    [(AT_ZERO, True), (UNCONFIRMED, False), (NOT_ARMED, False), (FORCED, False), (LIVES, False)],
)
def test_watchers_are_told_of_0_V_only_where_it_was_confirmed(
    rig: _Rig, tmp_path: Path, end: int, at_zero: bool
) -> None:
    if end == FORCED:
        rig.mailbox.tell_forced()
    elif end != LIVES:  # as where the run's process died
        rig.mailbox.tell_end("It ended.", end)
    last = asyncio.run(_last_line(rig, tmp_path / "s"))
    assert last["at_zero"] is at_zero
    assert last["ended"]


async def _last_line(rig: _Rig, place: Path) -> dict[str, Any]:
    async with await asyncio.start_unix_server(rig.server.serve, place):
        reader, writer = await asyncio.open_unix_connection(place)
        writer.write(b'{"do": "watch"}\n')
        await reader.readline()
        await rig.server.say_goodbye()
        lines = []
        with suppress(TimeoutError):
            while line := await asyncio.wait_for(reader.readline(), 0.5):
                lines.append(line)
        writer.close()
        last: dict[str, Any] = _strict(lines[-1])
        return last


def test_watchers_get_what_was_before_them_and_the_last_cycle(rig: _Rig, tmp_path: Path) -> None:
    for k in range(12):
        rig.ring.push(cycle(0.01 * k, position=float(k)), Truth(0.0, 0.0, 0.0))
    rig.server.look()
    lines = asyncio.run(_watched(rig, tmp_path / "s"))
    buckets = [bucket for line in lines for bucket in line["buckets"]]
    assert [bucket[2:4] for bucket in buckets] == [[0.0, 3.0], [4.0, 7.0], [8.0, 11.0], [99.0, 99.0]]
    assert lines[0]["columns"][0] == "position_rad"
    assert (lines[0]["late"], lines[0]["missed"]) == (0, 0)
    assert lines[-1]["last_phase"] == "running"


@pytest.mark.parametrize("estimate", [math.inf, -math.inf, math.nan])
def test_watchers_get_the_last_words_of_a_run_whose_estimate_is_no_number(
    rig: _Rig, tmp_path: Path, estimate: float
) -> None:
    row = cycle(0.1)._replace(estimate=Estimate(estimate, estimate, estimate))
    rig.ring.push(row, Truth(0.0, 0.0, 0.0))
    rig.server.look()
    first, *_, last = asyncio.run(_watched(rig, tmp_path / "s"))
    names = ("velocity_rad_s", "disturbance_rad_s2", "gravity_rad_s2", "rest_rad_s2")
    assert [first[name] for name in names] == [None] * 4
    assert (first["t_s"], last["ended"]) == (0.1, "it died; the device goes to 0 V by itself.")


@pytest.mark.parametrize("kind", [kind for kind in KINDS["observer"] if kind != "custom"])
def test_state_of_every_observer_is_json_for_a_browser(tmp_path: Path, kind: str) -> None:
    rig = _Rig(f"observer.kind={kind}")
    (state,) = asyncio.run(rig.ask(tmp_path / "s", {"do": "status"}))
    assert f'observer.kind="{kind}"' in state["values"]
    for knob in state["knobs"]:
        if "slider" in knob:
            start, end = knob["slider"]
            low, high = knob["low"], knob["high"]
            assert low is None or low <= start, knob
            assert start <= knob["value"] <= end, knob
            assert high is None or end <= high, knob


async def _watched(rig: _Rig, place: Path) -> list[dict[str, Any]]:
    """Watch from now to the end; one more cycle comes in between."""
    async with await asyncio.start_unix_server(rig.server.serve, place):
        reader, writer = await asyncio.open_unix_connection(place)
        writer.write(b'{"do": "watch"}\n')
        lines = [await reader.readline()]
        rig.mailbox.tell_phase(4)
        rig.ring.push(cycle(0.13, position=99.0), Truth(0.0, 0.0, 0.0))
        await rig.server.say_goodbye()
        while b'"ended"' not in lines[-1]:
            assert lines[-1], "the command process left its watcher"
            lines.append(await asyncio.wait_for(reader.readline(), 5.0))
        writer.close()
        return [_strict(line) for line in lines]


def test_the_state_names_changes_and_the_way_back(rig: _Rig, tmp_path: Path) -> None:
    kp = "controller.kp_1_s2"
    _, state, _, back = asyncio.run(
        rig.ask(
            tmp_path / "s", _change(f"{kp}=5200"), {"do": "status"}, _change(f"{kp}=4000"), {"do": "status"}
        )
    )
    assert state["marks"] == [[3.25, f"{kp}: 4000 -> 5200"]]
    assert state["back"] == [f"{kp}=4000"]
    assert f"{kp}=5200" in state["values"]
    assert 'controller.kind="pd_compensated"' in state["values"]
    assert (back["back"], back["kept"], len(back["marks"])) == ([], [], 2)


def test_the_state_names_what_no_way_leads_back_to(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time_s,position_rad\n0,0\n1,0.5\n")
    rig = _Rig("reference.kind=csv", f"reference.file={file}")
    start, _, state = asyncio.run(
        rig.ask(
            tmp_path / "s",
            {"do": "status"},
            _change("reference.kind=sine", "controller.kp_1_s2=5200"),
            {"do": "status"},
        )
    )
    assert (start["kept"], start["back"]) == ([], [])
    assert (state["kept"], state["back"]) == (['reference.kind="csv"'], ["controller.kp_1_s2=4000"])


def test_a_picture_that_fails_ends_no_command_process(rig: _Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Envelopes, "add", lambda *_: 1 / 0)
    rig.ring.push(cycle(0.5), Truth(0.0, 0.0, 0.0))
    rig.server.look()
    assert (rig.server.state()["t_s"], len(rig.ring)) == (0.5, 1)
