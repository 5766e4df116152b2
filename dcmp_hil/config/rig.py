"""A whole rig.toml: its tables, and the rules that span more than one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self, get_args

from pydantic import Discriminator, ValidationInfo, model_validator

from dcmp_hil.config.rules import OPEN_LOOP_RULES, RULES
from dcmp_hil.config.tables import RigTables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from dcmp_hil.common.section import Section


RULES_CONTEXT = "rules"
"""Key of the validation's context that replaces RULES, where the others are checked for many rigs at once."""


class Rig(RigTables):
    """Settings of one rig and of its run."""

    @model_validator(mode="after")
    def _check_rules(self, info: ValidationInfo) -> Self:
        given = info.context or {}
        _check(self, given.get(RULES_CONTEXT, RULES))
        return self


class OpenLoopTables(RigTables):
    """Settings of one rig for a computation that closes no loop, such as an observer over a recording."""

    @model_validator(mode="after")
    def _check_rules(self) -> Self:
        _check(self, OPEN_LOOP_RULES)
        return self


def _check(tables: RigTables, rules: Iterable[Callable[[RigTables], str]]) -> None:
    """Raise ValueError with the faults that the rules find; ArithmeticError if one cannot be computed."""
    faults: list[str] = []
    failed: Exception | None = None
    for rule in rules:
        try:
            fault = rule(tables)
        except (ArithmeticError, ValueError) as error:  # numpy's LinAlgError is a ValueError
            failed = error  # most likely because of a number that another rule refuses
            continue
        if fault:
            faults.append(fault)
    if faults:
        raise ValueError("\n".join(faults))
    if failed is not None:
        raise ArithmeticError(str(failed)) from failed


def _kinds(union: Any) -> dict[str, type[Section]]:
    """Return the members of a union of tagged tables by their tags, in its order."""
    tagged = map(get_args, get_args(union))
    return {tag.tag: table for table, tag in tagged}


KINDS: dict[str, dict[str, type[Section]]] = {
    name: _kinds(field.annotation)
    for name, field in Rig.model_fields.items()
    if any(isinstance(one, Discriminator) for one in field.metadata)
}
"""Tables that come in kinds, and what each kind has; the first is the default."""
