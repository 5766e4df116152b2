"""The traces of section 8: what is on disk is what the core does, and another device does the same."""

from __future__ import annotations

import shutil
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest

from tests.contract.firmware_device import Firmware
from tests.contract.reference_device import ReferenceDevice
from tests.contract.traces import TRACES
from tools.traces import __main__ as tool
from tools.traces.scenarios import SCENARIOS
from tools.traces.steps import differences

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def test_the_files_and_the_page_are_what_the_core_does() -> None:
    made = tool.files()
    assert set(made) == {tool.PAGE, *(tool.FOLDER / f"{name}.json" for name in SCENARIOS)}
    assert set(TRACES) == set(SCENARIOS)
    for path, text in made.items():
        assert path.read_text("utf-8") == text, f"{path}: python -m tools.traces"


@pytest.mark.parametrize("name", SCENARIOS)
def test_both_devices_follow_every_trace(name: str) -> None:
    trace = TRACES[name]
    for make in (Firmware, ReferenceDevice):
        assert differences(make(carrier="can", **trace["built"]), trace["steps"]) == []


def test_every_state_and_every_fault_of_section_8_is_in_a_trace() -> None:
    page = tool.PAGE.read_text("utf-8")
    for fault in (
        *("HOST_SILENT", "LINK_DOWN", "STOPPED", "CORRUPT_LINK", "OVER_SPEED", "OVER_TRAVEL", "ENCODER_JUMP"),
    ):
        assert f"FAULT({fault})" in page
    states = {step["state"] for trace in TRACES.values() for step in trace["steps"]}
    assert states == {"IDLE", "ARMING", "RUN", "FAULT"}


def _changes(step: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Change each thing that a step says of the device."""
    yield step | {"state": "RUN" if step["state"] != "RUN" else "IDLE"}
    yield step | {"mV": step["mV"] + 1}
    yield step | {"enable": 1 - step["enable"]}
    for at, frame in enumerate(step.get("sent", ())):
        other = frame[:-1] + ("0" if frame[-1] != "0" else "1")
        yield step | {"sent": [*step["sent"][:at], other, *step["sent"][at + 1 :]]}
        yield step | {"sent": [*step["sent"][:at], *step["sent"][at + 1 :]]}


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_changed_trace_is_noticed(name: str) -> None:
    trace = TRACES[name]
    last = len(trace["steps"]) - 1
    for number in {0, 1, last // 2, last - 1, last}:
        for changed in _changes(trace["steps"][number]):
            steps = deepcopy(trace["steps"])
            steps[number] = changed
            wrong = differences(Firmware(carrier="can", **trace["built"]), steps)
            assert [one.partition(":")[0] for one in wrong] == [f"step {number}"], changed


def test_the_check_names_what_is_stale(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["traces", "--check"])
    with pytest.raises(SystemExit) as ended:
        tool.main()
    assert (ended.value.code, capsys.readouterr().out) == (False, "")
    folder = tmp_path / "traces"
    shutil.copytree(tool.FOLDER, folder)
    path = folder / "jumps.json"
    path.write_text(path.read_text("utf-8").replace("ARMING", "RUN", 1), encoding="utf-8")
    (folder / "left-over.json").write_text("{}", encoding="utf-8")
    monkeypatch.setattr(tool, "FOLDER", folder)
    monkeypatch.setattr(tool, "_ROOT", tmp_path)
    monkeypatch.setattr(tool, "PAGE", _copy_of_page(tmp_path))
    with pytest.raises(SystemExit) as ended:
        tool.main()
    said = capsys.readouterr().out.splitlines()
    assert ended.value.code is True
    assert sorted(line.split()[0] for line in said) == ["traces/jumps.json", "traces/left-over.json"]


def _copy_of_page(folder: Path) -> Path:
    page = folder / "protocol.md"
    page.write_text(tool.PAGE.read_text("utf-8"), encoding="utf-8")
    return page
