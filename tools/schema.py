"""`python -m tools.schema`: write what follows from rig.toml's tables: the JSON Schema, the page of keys."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from pydantic import BaseModel

from dcmp_hil.config.formatting import describe, toml_value
from dcmp_hil.config.rig import KINDS, Rig
from dcmp_hil.config.schema import rig_schema
from dcmp_hil.sweeping.schema import sweep_schema

_ROOT = Path(__file__).parent.parent
SCHEMA = _ROOT / "dcmp_hil/rigs/rig.schema.json"
SWEEP_SCHEMA = _ROOT / "dcmp_hil/sweeping/sweep.schema.json"
PAGE = _ROOT / "docs/rig.md"

_INTRO = """# rig.toml, every key

Made by `python -m tools.schema` from the code; a test holds it to that. Units are part of the names. Every
key may be left out, unless it says "needed"; unknown keys are refused. `dcmp-hil check FILE` shows a rig
with every key filled in, `dcmp-hil rigs --copy bench-1khz my-rig.toml` writes a commented one to start
from, with a JSON Schema beside it. A relative `reference.file` starts from the folder of the rig file.
"""


def schema_text() -> str:
    """Return the JSON Schema of rig.toml, for editors."""
    return json.dumps(rig_schema(), indent=2, ensure_ascii=False) + "\n"


def sweep_schema_text() -> str:
    """Return the JSON Schema of a sweep's file, for editors."""
    return json.dumps(sweep_schema(), indent=2, ensure_ascii=False) + "\n"


def page_text() -> str:
    """Return the page of keys, in Markdown."""
    parts = [_INTRO]
    for name, field in Rig.model_fields.items():
        if name in KINDS:
            models = {model: kind for kind, model in reversed(KINDS[name].items())}  # pd shares a table
            for model, kind in reversed(models.items()):
                shown = 'kind = "module:Class"' if kind == "custom" else f'kind = "{kind}"'
                parts.append(f"\n## `[{name}]` with `{shown}`\n\n{_table(model)}")
        elif hasattr(field.annotation, "model_fields"):
            parts.append(f"\n## `[{name}]`\n\n{_table(field.annotation)}")  # type: ignore[arg-type]
        else:
            parts.append(f"\n## Before the first table\n\n{_rows_of(Rig, [name])}")
    return "".join(parts)


def _table(model: type[BaseModel]) -> str:
    return _rows_of(model, list(model.model_fields))


def _rows_of(model: type[BaseModel], names: list[str]) -> str:
    properties = model.model_json_schema()["properties"]
    lines = ["| key | default | allowed | meaning |", "|---|---|---|---|"]
    for name in names:
        field = model.model_fields[name]
        if field.is_required():
            default = "needed"
        else:
            value = field.get_default(call_default_factory=True)
            default = (
                "by rule" if value is None else "" if isinstance(value, BaseModel) else toml_value(value)
            )
        meaning = (field.description or "").replace("\n", " ").replace("|", "\\|")
        lines.append(f"| `{name}` | {default} | {describe(properties[name])} | {meaning} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the schemas and the page."""
    for path, text in (
        (SCHEMA, schema_text()),
        (SWEEP_SCHEMA, sweep_schema_text()),
        (PAGE, page_text()),
    ):
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"wrote {path.relative_to(_ROOT)}\n")


if __name__ == "__main__":
    main()
