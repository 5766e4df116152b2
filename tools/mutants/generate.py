"""Mutants of a C file: every one is the file with one small thing wrong."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import tree_sitter_c
from tree_sitter import Language, Node, Parser

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

OPERATORS: dict[str, tuple[str, ...]] = {
    "<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "==": ("!=",), "!=": ("==",),
    "+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "%": ("*",),
    "&": ("|",), "|": ("&",), "<<": (">>",), ">>": ("<<",),
    "&&": ("||",), "||": ("&&",),
    "+=": ("-=", "="), "-=": ("+=", "="), "++": ("--",), "--": ("++",),
}  # fmt: skip
_FRACTION = r"0[xX][0-9a-fA-F.]+p[+-]?\d+|\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+"
_NUMBER = re.compile(rf"(?<![\w.])(?:({_FRACTION})|(0[xX][0-9a-fA-F]+|\d+)([uUlL]*))(?![\w.])")
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


class Change(NamedTuple):
    """Bytes `start` to `end` of a file become `text`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True)
class Mutant:
    """One change of one file; its name is what stands in the line, which outlives an edit elsewhere.

    Parameters
    ----------
    file : str
        Name of the file.
    where : str
        The function, or the `#define` or table.
    line : str
        The lines as they are, blanks and remarks made one blank.
    becomes : str
        The same lines in the mutant.
    number : int
        Which of those in `where` that read the same, from 1.
    row : int
        Number of the line, for people.
    source : bytes
        The whole file, mutated.
    """

    file: str
    where: str
    line: str
    becomes: str
    number: int
    row: int
    source: bytes

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        """Return what a name in `mutants.toml` has to say."""
        return self.file, self.where, self.line, self.becomes, self.number


def text_of(node: Node) -> str:
    """Return the source text of a node."""
    return (node.text or b"").decode()


def walk(node: Node) -> Iterator[Node]:
    """Yield a piece of the source and all in it."""
    yield node
    for child in node.children:
        yield from walk(child)


def _replace(node: Node, *texts: str) -> Iterator[Change]:
    for text in texts:
        yield Change(node.start_byte, node.end_byte, text)


def _operator(node: Node) -> Iterator[Change]:
    operator = node.child_by_field_name("operator")
    if operator is not None:
        yield from _replace(operator, *OPERATORS.get(text_of(operator), ()))
    if node.type == "unary_expression" and operator is not None and text_of(operator) in ("!", "-"):
        yield from _replace(operator, "")


def _operands(node: Node) -> Iterator[Change]:
    """Leave out either side of && and ||."""
    left, right = node.child_by_field_name("left"), node.child_by_field_name("right")
    operator = node.child_by_field_name("operator")
    if left and right and operator and text_of(operator) in ("&&", "||"):
        neutral = "true" if text_of(operator) == "&&" else "false"
        yield from _replace(left, neutral)
        yield from _replace(right, neutral)


def _condition(node: Node) -> Iterator[Change]:
    """Negate a condition, and make it always and never so."""
    condition = node.child_by_field_name("condition")
    if condition is None:
        return
    inner = condition.named_children[0] if condition.type == "parenthesized_expression" else condition
    plain = text_of(inner)
    yield from _replace(inner, f"!({plain})", "false")
    if node.type not in ("while_statement", "for_statement"):
        yield from _replace(inner, "true")


def _numbers(node: Node) -> Iterator[Change]:
    """Put other numbers for each number."""
    remarks_blank = _COMMENT.sub(lambda remark: " " * len(remark[0]), text_of(node))
    for found in _NUMBER.finditer(remarks_blank):
        fraction, digits, suffix = found.groups()
        start, end = node.start_byte + found.start(), node.start_byte + found.end()
        others = _other_fractions(fraction) if fraction else _other_wholes(digits, suffix)
        yield from (Change(start, end, other) for other in others)


def _other_wholes(digits: str, suffix: str) -> list[str]:
    """Return one more, and 0 for 1."""
    value = int(digits, 0)
    more = f"{value + 1:#x}" if digits[:2] in ("0x", "0X") else str(value + 1)
    return [other + suffix for other in ([more, "0"] if value == 1 else [more])]


def _other_fractions(text: str) -> list[str]:
    """Return 1 for 0, 0 and 2 for 1, of other numbers with a fraction one part in 1000 more."""
    value = float.fromhex(text) if text[:2] in ("0x", "0X") else float(text)
    if value == 0.0:
        return ["1.0"]
    return ["0.0", "2.0"] if value == 1.0 else [f"{1.001 * value:.6g}"]


def _truth(node: Node) -> Iterator[Change]:
    yield from _replace(node, "false" if node.type == "true" else "true")


def _deleted(node: Node) -> Iterator[Change]:
    """Leave out a statement, but not what a function returns at its end: without, it has no meaning."""
    block = node.parent
    last = block is not None and block.parent is not None and block.parent.type == "function_definition"
    if node.type == "return_statement" and last and node.named_children:
        return
    yield from _replace(node, ";")


def _entries(node: Node) -> Iterator[Change]:
    """Put another name of the row for each name in a row of a table."""
    names = [child for child in node.named_children if child.type == "identifier"]
    for entry in names:
        others = sorted({text_of(name) for name in names} - {text_of(entry)})
        yield from _replace(entry, *others[:1])


CHANGES: dict[str, tuple[Callable[[Node], Iterator[Change]], ...]] = {
    "binary_expression": (_operator, _operands),
    **dict.fromkeys(("unary_expression", "assignment_expression", "update_expression"), (_operator,)),
    **dict.fromkeys(("if_statement", "while_statement", "for_statement"), (_condition,)),
    "conditional_expression": (_condition,),
    **dict.fromkeys(("number_literal", "preproc_arg"), (_numbers,)),
    **dict.fromkeys(("true", "false"), (_truth,)),
    "initializer_list": (_entries,),
    **dict.fromkeys(("expression_statement", "return_statement"), (_deleted,)),
    **dict.fromkeys(("break_statement", "continue_statement"), (_deleted,)),
}
"""What may be done to a piece of the source, by its kind."""


_AROUND = ("translation_unit", "preproc_ifdef", "preproc_if", "preproc_else", "preproc_elif")
"""Of these, what is inside has the name."""


def _of_the_compiler(node: Node) -> bool:
    """Return whether a piece is a condition or an error of the preprocessor."""
    parent = node.parent
    return parent is not None and (
        parent.type == "preproc_call"
        or (parent.type in _AROUND and parent.child_by_field_name("condition") == node)
        or _of_the_compiler(parent)
    )


def _place(node: Node) -> str:
    """Return the name of the outermost thing that a piece of the source stands in."""
    outer, name = node, None
    while outer.parent is not None and outer.parent.type not in _AROUND:
        outer = outer.parent
    name = outer.child_by_field_name("declarator") or outer.child_by_field_name("name")
    while name is not None and name.type != "identifier":
        name = name.child_by_field_name("declarator")
    return text_of(name) if name is not None else ""


def _plain(text: bytes) -> str:
    return " ".join(_COMMENT.sub(" ", text.decode()).split())


def mutants(path: Path) -> list[Mutant]:
    """Return every mutant of a C file, in the file's order."""
    source = path.read_bytes()
    tree = Parser(Language(tree_sitter_c.language())).parse(source)
    found: dict[Change, str] = {}
    for node in walk(tree.root_node):
        if _of_the_compiler(node):
            continue
        for change in (made for make in CHANGES.get(node.type, ()) for made in make(node)):
            if source[change.start : change.end] != change.text.encode():
                found.setdefault(change, _place(node))
    seen: Counter[tuple[str, str, str]] = Counter()
    made = []
    for change, where in sorted(found.items()):
        start = source.rfind(b"\n", 0, change.start) + 1
        end = source.find(b"\n", change.end)
        changed = source[: change.start] + change.text.encode() + source[change.end :]
        line, becomes = _plain(source[start:end]), _plain(changed[start : end + len(changed) - len(source)])
        seen[where, line, becomes] += 1
        row = source.count(b"\n", 0, change.start) + 1
        made.append(Mutant(path.name, where, line, becomes, seen[where, line, becomes], row, changed))
    return made
