"""Facts of the computer: what is read from the kernel's own texts, and that nothing missing stops a run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dcmp_hil.platform import host_info
from dcmp_hil.platform.host_info import capabilities, host_facts, in_words, preemption, read_fact


@pytest.mark.parametrize(
    ("version", "model", "name"),
    [
        ("#1 SMP PREEMPT_DYNAMIC Debian 6.1.55-1 (2023-09-29)", None, "PREEMPT_DYNAMIC"),
        ("#1 SMP PREEMPT_DYNAMIC @0", "none voluntary (full)", "PREEMPT_DYNAMIC (full)"),
        ("#1 SMP PREEMPT_RT Debian 6.12.9-1", None, "PREEMPT_RT"),
        ("#1 SMP PREEMPT Thu Jan 1", None, "PREEMPT"),
        ("#1 SMP Debian 5.10.1", None, "none"),
    ],
)
def test_preemption_model_is_named_from_the_kernels_words(version: str, model: str | None, name: str) -> None:
    assert preemption(version, model) == name


def test_capabilities_are_read_from_the_process_status() -> None:
    assert capabilities("Name:\tx\nCapPrm:\t0\nCapEff:\t0000000000804000\n") == 1 << 23 | 1 << 14
    assert capabilities("Name:\tx\n") == 0


def test_facts_are_json_and_complete() -> None:
    facts = host_facts()
    assert json.loads(json.dumps(facts)) == facts
    names = {"system", "kernel", "preemption", "cpus", "governor", "rt_runtime_us", "privileges", "python"}
    assert set(facts) == names
    assert facts["cpus"] >= 1
    assert all(name in in_words(facts) for name in names)


def test_facts_are_unknown_when_the_kernel_tells_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert read_fact(str(tmp_path / "nothing")) is None
    monkeypatch.setattr(host_info, "read_fact", lambda _: None)
    facts = host_facts()
    assert facts["governor"] is None
    assert facts["rt_runtime_us"] is None
    assert facts["privileges"]["cap_sys_nice"] is False
    assert "governor unknown" in in_words(facts)
