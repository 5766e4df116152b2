"""The machine can fail: errors sown into host and firmware, each found within a budget."""

from __future__ import annotations

import math
import shutil
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis.stateful import run_state_machine_as_test

from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.device.disarm import DisarmSequence
from dcmp_hil.safety.limiter import Limiter
from dcmp_hil.safety.monitors import FiniteMonitor
from dcmp_hil.safety.supervisor import TRANSITIONS, Phase, PhaseEvent, Supervisor
from dcmp_hil.values import Fault
from sim_backend.board import hostlib
from sim_backend.compiling.build import sources
from tests.stateful.machine import Machine
from tests.stateful.test_machine import budget

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from dcmp_hil.values import Estimate, Sample

EXAMPLE_COUNT, RULES_PER_RUN = 1000, 100
"""It ends with the first find, within 170 for every error and each of eight seeds: Hypothesis draws by what
else is imported, so no smaller number holds in every order of the tests."""
Patch = pytest.MonkeyPatch

pytestmark = pytest.mark.untraced


def _table(phase: Phase, event: PhaseEvent, following: Phase) -> Callable[[Patch], None]:
    changed = {here: dict(events) for here, events in TRANSITIONS.items()}
    changed[phase][event] = following
    return lambda patch: patch.setattr("dcmp_hil.safety.supervisor.TRANSITIONS", changed)


def _method(kind: type, name: str, other: Any) -> Callable[[Patch], None]:
    return lambda patch: patch.setattr(kind, name, other)


_safe_voltage = Supervisor.safe_voltage


def _safe_voltage_nan(supervisor: Supervisor, sample: Sample, estimate: Estimate, demand: float) -> float:
    return demand if math.isnan(demand) else _safe_voltage(supervisor, sample, estimate, demand)


IN_HOST = {
    "a device's fault is overlooked": _method(FiniteMonitor, "check", lambda *_: None),
    "a trip is not for good": _table(Phase.TRIPPED, PhaseEvent.FAULT, Phase.SETTLING),
    "a fault goes back to settling": _table(Phase.RUNNING, PhaseEvent.FAULT, Phase.SETTLING),
    "an orderly end that never ends": _table(Phase.STOPPING, PhaseEvent.STOPPED, Phase.STOPPING),
    "an orderly end with full authority": _table(Phase.STOPPING, PhaseEvent.STOPPED, Phase.RUNNING),
    "no ramp": _method(Supervisor, "_partial_voltage", lambda _, __, demand: demand),
    "no clamp": _method(Limiter, "limit_voltage", lambda _, __, demand, ___: demand),
    "NaN is let through": _method(Supervisor, "safe_voltage", _safe_voltage_nan),
    "a fault of the device is not seen": _method(DeviceBackend, "_fault_in", lambda *_: Fault.NONE),
    "no disarm at the end": _method(DisarmSequence, "run", lambda *_, **__: True),
}

IN_FIRMWARE = {
    "ENABLE stays high in a fault": (
        "boards/hostlib/hostlib.c", "view->enable = output.enable;",
        "view->enable = output.enable || view->state == 4;",
    ),
    "no watchdog": ("core/dcmp_watchdog.c", "> watchdog->time_us", "> 40u * watchdog->time_us"),
    "the watchdog is a little late": (
        "core/dcmp_watchdog.c", "> watchdog->time_us", "> watchdog->time_us + 6000u",
    ),
    "a refused command feeds the watchdog": (
        "core/dcmp_receive.c", "case DCMP_GAP:",
        "case DCMP_GAP: dcmp_watchdog_feed(&device->watchdog, now_us, 20, 20);",
    ),
    "old commands are accepted": ("core/dcmp_session.c", "if (age > oldest) {", "if (age > oldest + 4u) {"),
    "every session may drive": (
        "core/dcmp_session.c", "candidate != 0u && candidate == session->owner", "candidate != 0u",
    ),
    "the fault is left without its edge": (
        "core/dcmp_supervisor.c", "{BOOT, IDLE,   IDLE,   IDLE,  FAULT},\n    [DCMP_EVENT_CLEAR]",
        "{BOOT, IDLE,   IDLE,   IDLE,  IDLE},\n    [DCMP_EVENT_CLEAR]",
    ),
    "the voltage stays after RUN": ("core/dcmp_guard.c", "dcmp_amplifier_cut(&device->amplifier);", ""),
    "STOP is not obeyed in RUN": (
        "core/dcmp_supervisor.c", "{BOOT, FAULT,  FAULT,  FAULT, FAULT}",
        "{BOOT, FAULT,  FAULT,  RUN, FAULT}",
    ),
    "the limit is forgotten": (
        "core/dcmp_amplifier.c", "clamp(amplifier->target_mV, -limit_mV, limit_mV)",
        "clamp(amplifier->target_mV, -2 * limit_mV, 2 * limit_mV)",
    ),
    "a session never lapses": ("core/dcmp_session.h", "500000u", "500000000u"),
}  # fmt: skip


def found() -> str:
    """Return the violations that the machine finds."""
    with pytest.raises(AssertionError) as caught:
        run_state_machine_as_test(Machine, settings=budget(EXAMPLE_COUNT, RULES_PER_RUN))
    return str(caught.value)


@pytest.mark.sampled
@pytest.mark.parametrize("error", IN_HOST, ids=str)
def test_machine_finds_an_error_in_the_host(error: str, monkeypatch: Patch) -> None:
    IN_HOST[error](monkeypatch)
    assert "tick" in found()


@pytest.fixture
def sown(tmp_path: Path, monkeypatch: Patch) -> Iterator[Callable[[str, str, str], None]]:
    """Give a way to change the firmware's sources, for this test."""
    root = tmp_path / "firmware"
    shutil.copytree(sources(), root)

    def sow(file: str, old: str, new: str) -> None:
        path = root / file
        text = path.read_text()
        assert text.count(old) == 1, file
        path.write_text(text.replace(old, new))
        hostlib.load.cache_clear()

    monkeypatch.setattr("sim_backend.compiling.build._SOURCE_FOLDERS", (root,))
    monkeypatch.setattr("sim_backend.compiling.build._COMPILER_FLAGS", ("-std=c11", "-O1"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    yield sow
    hostlib.load.cache_clear()


@pytest.mark.sampled
@pytest.mark.parametrize("error", IN_FIRMWARE, ids=str)
def test_machine_finds_an_error_in_the_firmware(error: str, sown: Callable[[str, str, str], None]) -> None:
    sown(*IN_FIRMWARE[error])
    assert "tick" in found()
