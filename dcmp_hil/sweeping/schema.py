"""The JSON Schema of a sweep's file, for editors."""

from __future__ import annotations

from typing import Any

from dcmp_hil.sweeping.spec import SweepSpec

_KEY_TABLES = ("set", "grid", "draw")


def sweep_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12; keys of the rig may be dotted in quotes, or tables in tables."""
    schema = SweepSpec.model_json_schema(by_alias=True)
    for name in _KEY_TABLES:
        value = schema["properties"][name]["additionalProperties"]
        nested = f"{name.capitalize()}Keys"
        inner = {"anyOf": [value, {"$ref": f"#/$defs/{nested}"}]}
        schema["$defs"][nested] = {"type": "object", "minProperties": 1, "additionalProperties": inner}
        schema["properties"][name]["additionalProperties"] = inner
    _remove_null(schema)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "dcmp-hil sweep"}


def _remove_null(schema: dict[str, Any]) -> None:
    """Drop null, which TOML has no word for."""
    for key in schema["$defs"]["DrawRule"]["properties"].values():
        key.pop("default", None)
        (one,) = (branch for branch in key.pop("anyOf") if branch != {"type": "null"})
        key.update(one)
