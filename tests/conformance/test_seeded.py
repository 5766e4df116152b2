"""Every check finds what it is for, and finds nothing in a device that does what the page says."""

from __future__ import annotations

import importlib
import pkgutil
import struct
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.conformance import checks
from dcmp_hil.conformance.check import Verdict
from dcmp_hil.conformance.listener import StoppedError
from dcmp_hil.conformance.registry import CHECKS
from dcmp_hil.conformance.runner import run_checks
from dcmp_hil.errors import OpenError
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import Hello, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tests.conformance.seeded import SEEDS
from tests.conformance.virtual import on
from tests.contract.firmware_device import Firmware
from tests.contract.reference_device import ReferenceDevice
from tools.protocol.__main__ import PAGE

if TYPE_CHECKING:
    from collections.abc import Callable

SAMPLE = 0x040
BY_NAME = {check.name: check for check in CHECKS}


@pytest.mark.parametrize("carrier", ["cobs", "slcan", "can"])
@pytest.mark.parametrize("make", [ReferenceDevice, Firmware])
def test_a_device_as_the_page_says_passes(make: Callable[..., Any], carrier: str) -> None:
    client, arm = on(make(carrier=carrier), carrier)
    outcomes = list(run_checks(client, CHECKS, armed=True, clear=False))
    assert [one.check for one in outcomes] == list(CHECKS)
    assert {one.check.name: one.findings for one in outcomes if one.findings} == {}
    verdicts = Counter(one.verdict for one in outcomes)
    assert set(verdicts) == {Verdict.PASSED, Verdict.OTHER_CARRIER}
    assert verdicts[Verdict.PASSED] >= 44
    arm.tick()
    assert arm.log[-1] == (0, False)


@pytest.mark.parametrize("period_us", [250, 500, 2000])
def test_other_periods_pass_too(period_us: int) -> None:
    client, _ = on(ReferenceDevice(carrier="can", period_us=period_us, watchdog_ms=20), "can")
    outcomes = list(run_checks(client, CHECKS, armed=True, clear=False))
    assert {one.check.name: one.findings for one in outcomes if one.findings} == {}


@pytest.mark.sampled
@pytest.mark.parametrize("error", SEEDS, ids=str)
def test_a_seeded_error_is_found_by_its_check(error: str) -> None:
    make, carrier, name = SEEDS[error]
    client, arm = on(make(carrier=carrier), carrier)
    outcomes = list(run_checks(client, (BY_NAME[name],), armed=True, clear=False))
    assert [(one.check.name, one.verdict) for one in outcomes] == [(name, Verdict.FAILED)], outcomes
    assert all(finding and finding[-1] not in "\n " for one in outcomes for finding in one.findings)
    assert any(one.findings for one in outcomes)
    for _ in range(60):  # off by itself by now, unless wrong are its watchdog and its 0 V
        arm.tick()
    if "watchdog" not in error and "stays after" not in error:
        assert arm.log[-1] == (0, False)


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_a_counter_of_what_was_sent_is_found_after_other_checks_too(carrier: str) -> None:
    make = SEEDS["the counter counts what was sent" + (", slcan" if carrier == "slcan" else "")][0]
    client, _ = on(make(carrier=carrier), carrier)
    checks = [BY_NAME["tick-parameter"], BY_NAME["counter-goes-on"]]
    _, outcome = run_checks(client, checks, armed=False, clear=False)
    assert outcome.verdict == Verdict.FAILED


def test_every_check_has_an_error_that_it_finds() -> None:
    assert {name for _, _, name in SEEDS.values()} == set(BY_NAME)


@pytest.mark.parametrize("carrier", ["cobs", "slcan", "can"])
def test_without_arm_no_drive_arms(carrier: str, monkeypatch: pytest.MonkeyPatch) -> None:
    words: list[tuple[int, ...]] = []
    device = ReferenceDevice(carrier=carrier)
    usual = ReferenceDevice._on_drive  # noqa: SLF001 - what the device heard

    def hear(self: ReferenceDevice, content: bytes) -> None:
        words.append(struct.unpack("<hHHB", content))
        usual(self, content)

    monkeypatch.setattr(ReferenceDevice, "_on_drive", hear)
    client, arm = on(device, carrier)
    verdicts = Counter(one.verdict for one in run_checks(client, CHECKS, armed=False, clear=False))
    assert verdicts[Verdict.NEEDS_ARM] == sum(check.needs_arm for check in CHECKS)
    assert verdicts[Verdict.FAILED] == 0
    assert len(words) > 60
    assert not any(word & 1 for _, word, _, _ in words)
    assert not any(voltage_mV or enable for voltage_mV, enable in arm.log)


@pytest.mark.parametrize(("owner", "state"), [(0x4321, 1), (0, 4)])
def test_a_device_that_is_owned_or_in_fault_is_left_alone(owner: int, state: int) -> None:
    device = ReferenceDevice(carrier="can")
    client, arm = on(device, "can")
    client.listen(2)
    client.send(Hello(owner, PROTOCOL_HASH) if owner else Stop(3))
    client.listen(2)
    with pytest.raises(OpenError, match="another host" if owner else "--clear"):
        list(run_checks(client, CHECKS, armed=True, clear=False))
    assert device.state == state
    arm.tick()
    assert arm.log[-1] == (0, False)
    if not owner:
        outcomes = list(run_checks(client, CHECKS, armed=False, clear=True))
        assert all(one.verdict != Verdict.FAILED for one in outcomes)
        assert device.state == 1


@pytest.mark.parametrize("apart", [1, 77, 200])
def test_two_devices_with_one_node_are_no_findings(apart: int) -> None:
    class Two(ReferenceDevice):
        """A device, and another one on the same bus that says what it says some ticks before."""

        def transmit_frames(self) -> list[tuple[int, bytes]]:
            frames = super().transmit_frames()
            other = [pack(_earlier(unpack(frame, 0), apart), 0) for frame in frames if frame[0] == SAMPLE]
            return [*frames, *other]

    client, arm = on(Two(carrier="can"), "can")
    with pytest.raises(OpenError, match="two devices send as node 0"):
        list(run_checks(client, CHECKS, armed=True, clear=False))
    arm.tick()
    assert not any(voltage_mV or enable for voltage_mV, enable in arm.log)


def _earlier(message: Any, ticks: int) -> Any:
    return message._replace(tick=(message.tick - ticks) % 256, position_counts=5)


def test_an_end_that_is_asked_for_leaves_the_device_off() -> None:
    device = ReferenceDevice(carrier="can")
    client, arm = on(device, "can", lambda: bool(arm.log) and arm.log[-1][0] != 0)
    with pytest.raises(StoppedError):
        list(run_checks(client, CHECKS, armed=True, clear=False))
    arm.tick()
    assert (device.state, arm.log[-1]) == (1, (0, False))
    assert any(voltage_mV for voltage_mV, _ in arm.log)


def test_a_device_that_falls_silent_is_a_finding_and_the_end() -> None:
    class Silent(ReferenceDevice):
        def transmit_frames(self) -> list[tuple[int, bytes]]:
            return super().transmit_frames() if self.tick_count < 2000 else []

    client, _ = on(Silent(carrier="can"), "can")
    outcomes = list(run_checks(client, CHECKS, armed=False, clear=False))
    verdicts = [
        one.verdict for one in outcomes if one.verdict not in (Verdict.NEEDS_ARM, Verdict.OTHER_CARRIER)
    ]
    assert verdicts.count(Verdict.FAILED) == 1
    assert set(verdicts[verdicts.index(Verdict.FAILED) + 1 :]) == {Verdict.NOT_JUDGED}
    assert any("no SAMPLE" in finding for one in outcomes for finding in one.findings)


def test_a_silent_port_is_no_device() -> None:
    class Silent(ReferenceDevice):
        def transmit_frames(self) -> list[tuple[int, bytes]]:
            return []

    client, _ = on(Silent(carrier="can"), "can")
    with pytest.raises(OpenError, match="no SAMPLE of node 0"):
        list(run_checks(client, CHECKS, armed=False, clear=False))


def test_every_check_is_in_the_list_once_and_has_its_section() -> None:
    defined = [
        module.__dict__["CHECKS"]
        for found in pkgutil.iter_modules(checks.__path__)
        for module in [importlib.import_module(f"{checks.__name__}.{found.name}")]
    ]
    assert sorted(check.name for made in defined for check in made) == sorted(BY_NAME)
    assert len(BY_NAME) == len(CHECKS)
    page = PAGE.read_text("utf-8")
    for check in CHECKS:
        assert f"\n## {check.section}. " in page
        assert check.says.endswith(".")
