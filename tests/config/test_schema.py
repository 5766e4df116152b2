"""The JSON Schema that editors use: up to date, and of one mind with the loader."""

import json
import tomllib
from typing import Any

import jsonschema
import pytest

from dcmp_hil.config import Rig, shipped_rigs
from dcmp_hil.config.load import shipped_text
from dcmp_hil.config.schema import rig_schema
from tools.schema import PAGE, SCHEMA, page_text, schema_text

VALIDATOR = jsonschema.Draft202012Validator(rig_schema())


def test_shipped_schema_and_page_are_what_the_code_says() -> None:
    assert SCHEMA.read_text(encoding="utf-8") == schema_text(), "run: python -m tools.schema"
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run: python -m tools.schema"


def test_schema_is_sound_by_its_own_draft() -> None:
    jsonschema.Draft202012Validator.check_schema(rig_schema())
    assert json.loads(schema_text()) == rig_schema()


@pytest.mark.parametrize("name", shipped_rigs())
def test_schema_accepts_shipped_rig_and_refuses_typos(name: str) -> None:
    table = tomllib.loads(shipped_text(name))
    VALIDATOR.validate(table)
    for section in (table, *[inner for inner in table.values() if isinstance(inner, dict)]):
        section["typo"] = 1
        assert not VALIDATOR.is_valid(table)
        del section["typo"]
    VALIDATOR.validate(table)


TABLES: list[dict[str, Any]] = [
    {},
    {"observer": {}},
    {"observer": {"mu0_rad_s": 30.0}},
    {"observer": {"kind": "paper", "start": "zero"}},
    {"observer": {"kind": "lab:Mine", "options": {"a": 1}}},
    {"controller": {"kp_1_s2": 1.0}},
    {"controller": {"kind": "pd"}},
    {"controller": {"kind": "lab:Mine", "position": "measured"}},
    {"reference": {"amplitude_rad": 0.5}},
    *({"reference": {"kind": kind}} for kind in ("sine", "chirp", "hold", "step", "trapezoid")),
    {"sim": {"plant": {"ku_rad_s2_V": 6.0}}},
    {"amplifier": {"voltage_limit_V": "none", "slew_V_s": 450}},
]


@pytest.mark.parametrize("table", TABLES, ids=json.dumps)
def test_schema_and_loader_accept_the_same_table_when_it_is_sound(table: dict[str, Any]) -> None:
    Rig.model_validate(table)
    VALIDATOR.validate(table)


@pytest.mark.parametrize(
    "table",
    [
        {"observer": {"kind": "super_twisting", "start": "zero"}},
        {"observer": {"start": "zero"}},
        {"observer": {"kind": "supertwisting"}},
        {"reference": {"from_hz": 1.0}},
        {"reference": {"kind": "csv"}},
        {"reference": {"kind": "hold", "amplitude_rad": 1.0}},
        {"controller": {"kind": "lab:Mine", "kp_1_s2": 1.0}},
        {"sim": {"plant": {"ku": 6.0}}},
        {"sim": {"step_us": 0.0002}},
        {"loop": {"rate_hz": 0.001}},
        {"loop": 3},
        {"name": ".."},
    ],
    ids=json.dumps,
)
def test_schema_and_loader_refuse_the_same_table_when_it_is_wrong(table: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="error"):
        Rig.model_validate(table)
    assert not VALIDATOR.is_valid(table)


def test_schema_says_what_every_key_means() -> None:
    schema = rig_schema()
    for name, definition in schema["$defs"].items():
        assert definition["additionalProperties"] is False, name
        assert definition["description"], name
        for key, of_key in definition["properties"].items():
            assert key in {"kind", "plant"} or of_key["description"], (name, key)


def test_schema_has_nothing_that_toml_cannot_write() -> None:
    assert "null" not in json.dumps(rig_schema())


def test_schema_gives_plant_no_default_but_the_models() -> None:
    definitions = rig_schema()["$defs"]
    plant, model = definitions["PlantSection"]["properties"], definitions["ModelSection"]["properties"]
    assert list(plant) == list(model)
    assert definitions["SimSection"]["properties"]["plant"] == {"$ref": "#/$defs/PlantSection"}
    for name, key in plant.items():
        assert "default" not in key
        assert key["description"].endswith(f"Left out: as {name} of [model].")
