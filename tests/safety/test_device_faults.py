"""Faults of a device in words."""

from __future__ import annotations

import pytest

from dcmp_hil.safety.device_faults import meaning_of
from dcmp_hil.values import Fault


@pytest.mark.parametrize("fault", [fault for fault in Fault if fault not in {Fault.NONE, Fault.UNKNOWN}])
def test_every_fault_has_a_sentence_and_a_remedy_of_its_own(fault: Fault) -> None:
    meaning = meaning_of(fault)
    assert "does not know" not in meaning.sentence
    assert meaning.remedy.endswith(".")
    assert [meaning_of(other) for other in Fault].count(meaning) == 1


@pytest.mark.parametrize("code", [42, 200, 255])
def test_a_code_of_another_version_keeps_its_number(code: int) -> None:
    assert str(code) in meaning_of(code).sentence
