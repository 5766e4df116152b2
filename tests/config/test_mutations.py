"""Two thousand and more damaged rig files and overrides: a rig or a ConfigError, and never a riddle."""

import json
import random
import string
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from dcmp_hil.config import Rig, load_rig
from dcmp_hil.config.formatting import dotted
from dcmp_hil.config.schema import rig_schema
from dcmp_hil.errors import ConfigError

FOLDER = Path(__file__).parents[2] / "dcmp_hil/rigs"
BASES = [tomllib.loads((FOLDER / f"{name}.toml").read_text()) for name in ("bench-1khz", "paper")]
MUTATION_COUNT = 2500
JARGON = (
    "Input should",
    "type=",
    "pydantic",
    "https://",
    "NoneType",
    "validation error",
    "Traceback",
    "dict",
)
UNITS = ("V", "mV", "s", "ms", "us", "hz", "khz", "rad", "deg", "mrad", "rad_s", "rpm", "V_s", "1_s")
WEIRD = (
    "",
    " ",
    "é",
    "名",
    "a b",
    'q"q',
    "back\\slash",
    "tab\t",
    "new\nline",
    "\x1b[31m",
    "\u202e",
    "\x00",
    "a.b",
)
VALUES: tuple[Any, ...] = (
    *(True, False, 0, -1, 1, 10**400, -(10**30), 1e300, -1e300, 5e-324, float("nan"), float("inf")),
    *("", "10 V", "200us", "1,5", "0.2 ms", "ideal", "none", "auto", "sine", "a:B", "a:", ":", *WEIRD),
    *([], [1], [[{}]], {}, {"a": 1}, {"kind": "sine"}, {"a": {"b": {"c": []}}}),
)


def toml(value: Any) -> str:
    """Return a value in TOML, with inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return repr(value)


def document(table: dict[str, Any]) -> str:
    return "".join(f"{json.dumps(key)} = {toml(value)}\n" for key, value in table.items())


def key_like(rng: random.Random, key: str) -> str:
    """A key with a letter lost, doubled, swapped, in capitals, or with another unit."""
    place = rng.randrange(len(key)) if key else 0
    return rng.choice(
        [
            key[:place] + key[place + 1 :],
            key[:place] + key[place : place + 1] * 2 + key[place + 1 :],
            key[:place] + rng.choice(string.ascii_lowercase) + key[place + 1 :],
            key.upper(),
            f"{key.rpartition('_')[0]}_{rng.choice(UNITS)}",
            f"{key}_{rng.choice(UNITS)}",
            rng.choice(WEIRD),
        ]
    )


def mutate(rng: random.Random) -> dict[str, Any]:
    table: dict[str, Any] = {
        name: dict(value) if isinstance(value, dict) else value for name, value in rng.choice(BASES).items()
    }
    for _ in range(rng.randint(1, 4)):
        tables = [value for value in table.values() if isinstance(value, dict)]
        home = rng.choice([table, *tables])
        key = rng.choice([*home, rng.choice(WEIRD)])
        action = rng.randrange(5)
        if action == 0:
            home[key] = rng.choice(VALUES)
        elif action == 1:
            home[key_like(rng, key)] = home.pop(key, 1)
        elif action == 2:
            home.pop(key, None)
        elif action == 3:
            home[key_like(rng, key)] = rng.choice(VALUES)
        else:
            other = rng.choice([table, *tables])
            if home.get(key) is not other and not isinstance(home.get(key), dict):
                other[key] = home.pop(key, 1)
    return table


def keys_of(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from keys_of(inner)


def faults_of(source: Path | str, *overrides: str) -> tuple[str, ...]:
    try:
        rig = load_rig(source, overrides)
    except ConfigError as error:
        return error.faults or ("an error that says nothing",)
    assert isinstance(rig, Rig)
    return ()


def hold_to_promises(faults: tuple[str, ...], keys: set[str]) -> None:
    for fault in faults:
        assert all(char.isprintable() for char in fault), fault
        assert not any(word in fault for word in JARGON), fault
        assert len(fault) < 600
        assert any(dotted([key]) in fault for key in keys), (fault, keys)


@pytest.mark.parametrize("part", range(4))
def test_load_gives_rig_or_faults_that_name_a_key_when_file_is_mutated(tmp_path: Path, part: int) -> None:
    rng, path, loaded = random.Random(part), tmp_path / "mutated.toml", 0
    for _ in range(MUTATION_COUNT // 4):
        table = mutate(rng)
        path.write_text(document(table))
        faults = faults_of(path)
        hold_to_promises(faults, {*keys_of(table), "file"})  # a csv reference misses its file
        loaded += not faults
    assert 0.02 < loaded / (MUTATION_COUNT // 4) < 0.6  # both outcomes are exercised


def test_load_gives_rig_or_faults_that_name_a_key_when_overrides_are_mutated() -> None:
    rng, loaded = random.Random(7), 0
    for _ in range(MUTATION_COUNT):
        table = rng.choice([name for name, value in BASES[0].items() if isinstance(value, dict)])
        key = rng.choice([*BASES[0][table], "kind"])
        value = BASES[0][table].get(key, 0) if rng.random() < 0.3 else rng.choice(VALUES)
        key = key if rng.random() < 0.5 else key_like(rng, key).replace("=", "")
        text = value if isinstance(value, str) and rng.random() < 0.5 else toml(value)
        faults = faults_of("bench-1khz", f"{table}.{key}={text}")
        parts = [part.strip() for part in key.split(".")]
        hold_to_promises(faults, {table} if "" in parts else {*parts, "file"})
        assert all(fault.startswith("--set ") for fault in faults), faults
        loaded += not faults
    assert 0.02 < loaded / MUTATION_COUNT < 0.6


def test_schema_accepts_every_mutated_file_that_loads(tmp_path: Path) -> None:
    validator = jsonschema.Draft202012Validator(rig_schema())
    rng, path, loaded = random.Random(11), tmp_path / "mutated.toml", 0
    for _ in range(MUTATION_COUNT // 4):
        table = mutate(rng)
        path.write_text(document(table))
        if not faults_of(path):
            loaded += 1
            validator.validate(table)
    assert loaded > 20


@pytest.mark.parametrize("seed", range(20))
def test_load_gives_rig_or_config_error_when_bytes_are_flipped(tmp_path: Path, seed: int) -> None:
    rng, path = random.Random(seed), tmp_path / "flipped.toml"
    whole = (FOLDER / "bench-1khz.toml").read_bytes()
    for _ in range(20):
        raw = bytearray(whole)
        for _ in range(rng.randint(1, 5)):
            raw[rng.randrange(len(raw))] = rng.randrange(256)
        path.write_bytes(raw)
        assert all(path.name in fault for fault in faults_of(path))


@pytest.mark.parametrize("seed", range(5))
def test_override_equals_file_edit_when_values_are_sound(tmp_path: Path, seed: int) -> None:
    rng, path = random.Random(seed), tmp_path / "bench-1khz.toml"
    changes: list[tuple[str, str, Any]] = [
        ("loop", "rate_hz", rng.choice([500, 2000.0])),
        ("amplifier", "voltage_limit_V", rng.choice([5.0, 24, "none"])),
        ("controller", "kp_1_s2", rng.uniform(100, 5000)),
        ("observer", "mu0_rad_s", rng.uniform(10, 100)),
        ("sim", "plant", {"ku_rad_s2_V": rng.uniform(4, 7)}),
        ("run", "end", rng.choice(["release", "lower"])),
    ]
    table = {name: dict(value) if isinstance(value, dict) else value for name, value in BASES[0].items()}
    for name, key, value in changes:
        table[name][key] = value
    path.write_text(document(table))
    overridden = load_rig("bench-1khz", [f"{name}.{key}={toml(value)}" for name, key, value in changes])
    assert load_rig(path).model_dump() == overridden.model_dump()
