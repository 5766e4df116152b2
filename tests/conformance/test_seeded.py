"""Every check finds what it is for, and finds nothing in a device that does what the page says."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.conformance.check import Verdict
from dcmp_hil.conformance.registry import CHECKS
from dcmp_hil.conformance.runner import run_checks
from tests.conformance.seeded import SEEDS
from tests.conformance.virtual import on
from tests.contract.firmware_device import Firmware
from tests.contract.stranger import Stranger

if TYPE_CHECKING:
    from collections.abc import Callable

BY_NAME = {check.name: check for check in CHECKS}


@pytest.mark.parametrize("carrier", ["cobs", "slcan", "can"])
@pytest.mark.parametrize("make", [Stranger, Firmware])
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
    client, _ = on(Stranger(carrier="can", period_us=period_us, watchdog_ms=20), "can")
    outcomes = list(run_checks(client, CHECKS, armed=True, clear=False))
    assert {one.check.name: one.findings for one in outcomes if one.findings} == {}


@pytest.mark.parametrize("error", SEEDS, ids=str)
def test_a_seeded_error_is_found_by_its_check(error: str) -> None:
    make, carrier, name = SEEDS[error]
    client, arm = on(make(carrier=carrier), carrier)
    outcomes = list(run_checks(client, (BY_NAME[name],), armed=True, clear=False))
    assert [(one.check.name, one.verdict) for one in outcomes] == [(name, Verdict.FAILED)], outcomes
    assert all(finding and finding[-1] not in "\n " for one in outcomes for finding in one.findings)
    assert any(one.findings for one in outcomes)
    for _ in range(60):  # whatever is wrong with it, but for its watchdog and its 0 V
        arm.tick()
    if "watchdog" not in error and "stays after" not in error:
        assert arm.log[-1] == (0, False)


def test_every_check_has_an_error_that_it_finds() -> None:
    assert {name for _, _, name in SEEDS.values()} == set(BY_NAME)
