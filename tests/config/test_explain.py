"""What a rig comes to, and what in it is questionable; schema and page."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from dcmp_hil.config import load_rig, shipped_rigs
from dcmp_hil.config.explain import explain, warnings
from tools.schema import PAGE, SCHEMA, page_text, schema_text


def test_explain_lists_every_key_with_value_and_meaning() -> None:
    rows = {key: (value, meaning) for key, value, meaning in explain(load_rig("bench-1khz"))}
    assert rows["loop.rate_hz"] == ("1000", "Samples a second, Hz.")
    assert rows["observer.mu0_rad_s"][0] == "40 (by rule)"
    assert rows["observer.M_rad_s3"][0] == "15 (by rule)"
    assert all(meaning for key, (_, meaning) in rows.items() if not key.endswith(".kind"))


def test_shipped_rigs_have_no_warnings() -> None:
    assert [warnings(load_rig(name)) for name in shipped_rigs()] == [[], []]


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["observer.kind=paper"], "super_twisting"),
        (["observer.mu0_rad_s=0"], "runs away"),
        (["observer.mu0_rad_s=5"], "far from the rule's 40 rad/s"),
        (["controller.kd_1_s=10"], "will ring"),
        (["reference.soft_start_s=0"], "first command"),
        (["reference.amplitude_rad=7"], "will trip"),
    ],
)
def test_warnings_name_what_is_seldom_meant(overrides: list[str], words: str) -> None:
    (sentence,) = warnings(load_rig("bench-1khz", overrides))
    assert words in sentence


def test_schema_and_page_are_what_the_code_says() -> None:
    assert SCHEMA.read_text() == schema_text(), "run: python -m tools.schema"
    assert PAGE.read_text() == page_text(), "run: python -m tools.schema"


@pytest.mark.parametrize("name", shipped_rigs())
def test_schema_accepts_shipped_rigs_and_refuses_typos(name: str) -> None:
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text()))
    table = tomllib.loads((Path(SCHEMA).parent / f"{name}.toml").read_text())
    validator.validate(table)
    table["observer"]["typo"] = 1
    assert not validator.is_valid(table)
