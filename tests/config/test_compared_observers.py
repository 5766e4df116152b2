"""Lists of observers: what they name, and what is said of names that are none."""

from __future__ import annotations

import pytest

from dcmp_hil.config import change_rig
from dcmp_hil.config.compared_observers import column_name, compared_sections, observer_kinds
from dcmp_hil.errors import ConfigError
from tests.helpers import bench


def test_kinds_are_read_from_lists_in_their_order() -> None:
    assert observer_kinds(["kalman, Friction-Kalman", "my_lab.rig:Mine"]) == (
        "kalman",
        "friction_kalman",
        "my_lab.rig:Mine",
    )


@pytest.mark.parametrize(
    ("texts", "parts"),
    [
        (["friction_kallman"], ['--compare: got "friction_kallman"', 'Did you mean "friction_kalman"?']),
        (["kalman,kalman"], ["--compare: kalman is given twice. Leave one out."]),
        (["kalman", "Kalman"], ["kalman is given twice"]),
        (["a.b:C", "a:b_C"], ["a.b:C is given twice", "a:b_C is given twice"]),  # one name of a column
        (["kalman,"], ['got ""', "expected one of"]),
        (["observer.kind=kalman"], ['got "observer.kind=kalman"', "KEY=VALUE is for `dcmp-hil replay`"]),
        (["custom"], ['got "custom"', 'or "module:Class" of your own']),
        (["a:b:c"], ['got "a:b:c"']),
        ([",".join(f"a:B{k}" for k in range(9))], ["9 observers at once; at most 8"]),
        (["nonsense", "kalman", "rubbish"], ['got "nonsense"', 'got "rubbish"']),
    ],
)
def test_what_is_no_list_is_refused_with_every_fault(texts: list[str], parts: list[str]) -> None:
    with pytest.raises(ConfigError) as refused:
        observer_kinds(texts)
    for part in parts:
        assert part in str(refused.value)


def test_names_of_columns_are_lower_case_and_of_one_word() -> None:
    assert column_name("friction_kalman") == "friction_kalman"
    assert column_name("My_Lab.rig:Mine2") == "own_my_lab_rig_mine2"


def test_those_beside_the_loop_are_as_another_kind_makes_them() -> None:
    rig = bench("observer.mu0_rad_s=70", "observer.L1_1_s=6")
    found = compared_sections(rig, ["super_twisting", "kalman", "paper"])
    assert list(found) == ["kalman", "paper"]
    for kind, section in found.items():
        assert section == change_rig(rig, [f"observer.kind={kind}"]).observer
    assert found["paper"].model_dump()["L1_1_s"] == 6.0


def test_every_observer_that_does_not_fit_the_rig_is_named() -> None:
    with pytest.raises(ConfigError) as refused:
        compared_sections(bench("encoder.counts_per_rev=ideal"), ["kalman", "friction_kalman", "derivative"])
    assert [fault.partition(":")[0] for fault in refused.value.faults] == [
        "--compare kalman",
        "--compare friction_kalman",
    ]


def test_a_list_that_is_far_too_long_is_refused_in_one_sentence() -> None:
    with pytest.raises(ConfigError) as refused:
        observer_kinds([",".join(f"k{k}" for k in range(1000))])
    assert refused.value.faults == ("--compare: 1000 observers at once; at most 8. Leave some out.",)
