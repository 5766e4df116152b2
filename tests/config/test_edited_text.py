"""A rig file that is edited keeps its comments and layout, and says exactly what the overrides say."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from dcmp_hil.config.edited_text import edited_text
from dcmp_hil.config.load import shipped_rigs, shipped_text
from dcmp_hil.config.overrides import apply_overrides
from dcmp_hil.errors import ConfigError

_TEXT = """\
# Our rig.
name = "ours"

[controller]   # the gains
kind = "pd"             # or another
kp_1_s2 = 4000.0        # 1/s2
kd_1_s=130
# position = "measured"

[reference]
kind = 'sine'           # a "sine" # of course
amplitude_rad = 1.0
rate_rad_s = 0.5        # rad/s

[sim.plant]
gravity_rad_s2 = 15.0
"""


def _changed(text: str, *overrides: str) -> list[tuple[str, str]]:
    """Return the lines that are different, old and new, where none was added or removed."""
    new = edited_text(text, overrides, "ours.toml")
    pairs = zip(text.splitlines(), new.splitlines(), strict=True)
    return [(a, b) for a, b in pairs if a != b]


def test_only_the_value_changes_and_a_comment_keeps_its_column() -> None:
    assert _changed(_TEXT, "controller.kp_1_s2=5200", "controller.kd_1_s=140.5") == [
        ("kp_1_s2 = 4000.0        # 1/s2", "kp_1_s2 = 5200          # 1/s2"),
        ("kd_1_s=130", "kd_1_s=140.5"),
    ]
    assert _changed(_TEXT, 'controller.kind="pd_compensated"') == [
        ('kind = "pd"             # or another', 'kind = "pd_compensated" # or another'),
    ]


def test_new_keys_follow_the_last_one_of_their_table_and_new_tables_the_file() -> None:
    new = edited_text(_TEXT, ["controller.position=measured", "observer.mu0_rad_s=50"], "ours.toml")
    lines = new.splitlines()
    assert lines[lines.index("kd_1_s=130") + 1] == 'position = "measured"'
    assert new.endswith("gravity_rad_s2 = 15.0\n\n[observer]\nmu0_rad_s = 50\n")


def test_keys_that_the_new_kind_does_not_know_go() -> None:
    new = edited_text(_TEXT, ['reference.kind="hold"', "reference.position_rad=0.25"], "ours.toml")
    assert tomllib.loads(new)["reference"] == {"kind": "hold", "position_rad": 0.25}
    assert 'kind = "hold"           # a "sine" # of course\n' in new


@pytest.mark.parametrize("name", shipped_rigs())
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_every_shipped_rig_is_edited_as_its_overrides_say(name: str, ends: str) -> None:
    text = shipped_text(name).replace("\n", ends)
    overrides = ["controller.kp_1_s2=1234.5", "reference.rate_rad_s=0.25", "observer.mu0_rad_s=33"]
    new = edited_text(text, overrides, name)
    expected: dict[str, Any] = tomllib.loads(text)
    apply_overrides(expected, overrides)
    assert tomllib.loads(new) == expected
    assert [line.partition("#")[2] for line in new.splitlines() if "#" in line] == [
        line.partition("#")[2] for line in text.splitlines() if "#" in line
    ]
    assert new.count("\r") == (new.count("\n") if ends == "\r\n" else 0)


def test_every_line_keeps_its_own_end() -> None:
    text = _TEXT.replace("kd_1_s=130\n", "kd_1_s=130\r\n")
    assert text.count("\r") == 1
    overrides = ["controller.kp_1_s2=5200", "controller.kd_1_s=140", "controller.friction_feedforward=true"]
    new = edited_text(text, overrides, "ours.toml")
    assert set(new.split("\n")) - set(text.split("\n")) == {
        "kp_1_s2 = 5200          # 1/s2",
        "kd_1_s=140\r",
        "friction_feedforward = true\r",  # as the line before it
    }


@pytest.mark.parametrize("last", ["\r\n", ""])
def test_a_last_line_without_an_end_stays_so(last: str) -> None:
    text = f"[controller]\r\nkp_1_s2 = 4000{last}"
    new = edited_text(text, ["controller.kp_1_s2=5200"], "ours.toml")
    assert new == f"[controller]\r\nkp_1_s2 = 5200{last}"
    new = edited_text(text, ["controller.kd_1_s=140"], "ours.toml")
    assert new == f"[controller]\r\nkp_1_s2 = 4000\r\nkd_1_s = 140{last}"
    new = edited_text(text, ["observer.mu0_rad_s=33"], "ours.toml")
    assert new == "[controller]\r\nkp_1_s2 = 4000\r\n\r\n[observer]\r\nmu0_rad_s = 33\r\n"


@pytest.mark.parametrize(
    "text",
    [
        "controller = {kind = 'pd', kp_1_s2 = 4000}\n",
        "controller.kp_1_s2 = 4000\n",
        "[controller]\n'kp_1_s2' = 4000\n",
        "[ 'controller' ]\nkp_1_s2 = 4000\n",
        '[controller]\nnote = """\nkp_1_s2 = 1\n"""\nkp_1_s2 = 4000\n',
    ],
)
def test_a_layout_that_would_be_edited_wrongly_is_refused_with_the_values(text: str) -> None:
    with pytest.raises(ConfigError, match=r"cannot be edited here.*controller\.kp_1_s2=5200"):
        edited_text(text, ["controller.kp_1_s2=5200"], "ours.toml")
