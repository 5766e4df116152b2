"""The JSON Schema of rig.toml, for editors: completion, bounds and meanings while one types."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from dcmp_hil.config.rig import KINDS, Rig


def rig_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12; what it accepts and what the loader accepts agree key by key."""
    schema = Rig.model_json_schema()
    _require_kind(schema)
    _add_plant(schema)
    _remove_null(schema)
    for name in [*KINDS, "sim"]:  # editors would paste a whole table
        schema["properties"][name].pop("default", None)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "dcmp-hil rig.toml"}


def _require_kind(schema: dict[str, Any]) -> None:
    """Leave only the default kind of a table without `kind`, or such a table would match two of them."""
    for kinds in KINDS.values():
        default, *others = dict.fromkeys(kinds.values())
        for model in others:
            required = schema["$defs"][model.__name__].setdefault("required", [])
            if model is not default and "kind" not in required:
                required.insert(0, "kind")


def _add_plant(schema: dict[str, Any]) -> None:
    """Give [sim.plant] a table of its own: its keys default to those of [model], not to numbers."""
    definitions = schema["$defs"]
    plant = deepcopy(definitions["ModelSection"])
    plant["title"] = "PlantSection"
    of_plant = definitions["SimSection"]["properties"]["plant"]
    plant["description"] = of_plant.get("description", "")
    for name, key in plant["properties"].items():
        key.pop("default", None)
        key["description"] += f" Left out: as {name} of [model]."
    definitions["PlantSection"] = plant
    of_plant.clear()
    of_plant["$ref"] = "#/$defs/PlantSection"


def _remove_null(node: Any) -> None:
    """Drop null, which TOML has no word for, as a type and as a default."""
    if isinstance(node, list):
        for inner in node:
            _remove_null(inner)
    if not isinstance(node, dict):
        return
    if "default" in node and node["default"] is None:
        del node["default"]
    others = [one for one in node.get("anyOf", []) if one != {"type": "null"}]
    if len(others) == 1:
        del node["anyOf"]
        node.update(others[0])
    for inner in node.values():
        _remove_null(inner)
