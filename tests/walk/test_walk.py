"""The walk: no traceback, the documented exit code and lines, every file kept; on every kind of output.

In CI every two values of two options meet, and every value and every class of outputs; each output comes
with each command. Of `paper`, which takes long, every value comes once. `make walk` calls every combination,
of the options with the most values where there are more than 2,000.
"""

from __future__ import annotations

import os
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.telemetry.rerun.viewer import answers
from tests.walk.expected import check
from tests.walk.selections import combinations, each_once, with_members
from tests.walk.streams import CLASSES, STREAMS, call
from tests.walk.surface import surface
from tests.walk.values import STREAM, VALUES, Value, factors

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.walk.world import World

_EVERY = 2_000 if os.environ.get("DCMP_WALK") == "all" else 0
_LONG = ("paper",)
_OUTPUTS: list[list[Value]] = [[(stream,) for stream in alike] for alike in CLASSES]


def _rows() -> list[tuple[str, dict[str, Value]]]:
    rows = []
    for command, options in surface().items():
        all_of_it = factors(command, options)
        if _EVERY:
            chosen = combinations(all_of_it, _EVERY)
        else:
            chosen = each_once(all_of_it) if command in _LONG else with_members(all_of_it, STREAM, _OUTPUTS)
        rows += [(command, row) for row in chosen]
    return rows


def _name(row: tuple[str, dict[str, Value]]) -> str:
    command, chosen = row
    return " ".join([command, *(word for words in chosen.values() for word in words)])


@pytest.mark.parametrize("row", _rows(), ids=_name)
def test_every_command_in_every_mode(
    row: tuple[str, dict[str, Value]], installed: Path, world: World, tmp_path: Path
) -> None:
    command, chosen = row
    words = tuple(word for name, value in chosen.items() if name != STREAM for word in value)
    with ExitStack() as stack:
        names = world.names(words, tmp_path)
        env = world.env
        if command == "stop":  # a run of its own, and alone: it ends
            alone = stack.enter_context(world.alone())
            names["pid"], env = str(stack.enter_context(alone.run())), alone.env
        elif command in {"set", "status"}:
            assert world.pid
        filled = {name: tuple(word.format(**names) for word in value) for name, value in chosen.items()}
        given = [word for name, value in filled.items() if name != STREAM for word in value]
        (stream,) = chosen[STREAM]
        called = call([str(installed), command, *given], stream, tmp_path, env, _until(command, filled))
    check(command, filled, called, tmp_path)


def _until(command: str, chosen: dict[str, Value]) -> Callable[[int], bool] | None:
    """Return what tells that a command which goes on by itself is at work, and may be ended by Ctrl-C."""
    if command == "device":
        return _has_a_terminal
    if command == "panel":
        return lambda _: answers(int(chosen["--port"][1]), 0.5)
    if command == "view" and chosen["--web"]:
        return _has_a_child
    return None


def _has_a_terminal(pid: int) -> bool:
    """Tell whether a process, or a child of it, has made a pseudo terminal."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    with suppress(OSError):  # a descriptor, or a child, that is gone by now
        descriptors = [path for one in (pid, *children) for path in Path(f"/proc/{one}/fd").iterdir()]
        return any(path.readlink().name == "ptmx" for path in descriptors if path.is_symlink())
    return False


def _has_a_child(pid: int) -> bool:
    """Tell whether a process serves pages by a child."""
    return bool(Path(f"/proc/{pid}/task/{pid}/children").read_text().split())


def test_every_option_of_every_command_is_walked() -> None:
    for command, options in surface().items():
        assert len(factors(command, options)) == len(options) + 1


def test_no_row_is_left_of_an_option_that_is_gone() -> None:
    there = {command: {option.name for option in options} for command, options in surface().items()}
    gone = [
        (command, name) for command, rows in VALUES.items() for name in rows if name not in there[command]
    ]
    assert not gone


def test_an_option_without_a_row_is_named() -> None:
    (option, *_) = surface()["run"]
    with pytest.raises(KeyError, match="`new RIG`: say what it is tried with"):
        factors("new", (option,))


def test_every_two_values_of_two_options_meet() -> None:
    alike = {stream: members[0] for members in _OUTPUTS for stream in members}
    for command, options in surface().items():
        all_of_it = factors(command, options)
        rows = with_members(all_of_it, STREAM, _OUTPUTS)
        assert {row[STREAM] for row in rows} == {(stream,) for stream in STREAMS}
        by_class = [{**row, STREAM: alike[row[STREAM]]} for row in rows]
        of_class = {**all_of_it, STREAM: tuple(members[0] for members in _OUTPUTS)}
        for a, of_a in of_class.items():
            for b, of_b in of_class.items():
                if a < b:
                    met = {(row[a], row[b]) for row in by_class}
                    assert met == {(one, other) for one in of_a for other in of_b}, (command, a, b)
