"""The two streams: figures and tables on standard output, everything about the run on standard error."""

from __future__ import annotations

import json
import math
import os
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from dcmp_hil.common.atomic_file import write_text
from dcmp_hil.common.printable_text import printable
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.console import ConsoleOptions, RenderableType
    from rich.segment import Segment

    from dcmp_hil.errors import DcmpError


class SafeConsole(Console):
    """A console that prints no control character of a text: what a file or a device says is only shown."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield what is printed; the console's own colours are no part of it yet."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


out = SafeConsole(soft_wrap=True)
err = SafeConsole(stderr=True, soft_wrap=True)


def take_width(console: Console) -> None:
    """Let a console know the width of the terminal that it prints on, which a user may change at any time.

    The console itself measures the standard streams of its process, which are no terminal in telemetry.
    """
    with suppress(OSError, ValueError):  # no file descriptor, or no terminal
        columns = os.get_terminal_size(console.file.fileno()).columns
        if columns:
            console.width = columns


def print_sentence(console: Console, text: Text, indent: int = 0) -> None:
    """Print one line; on a terminal it is broken between words, and a word that is too long is left whole.

    Parameters
    ----------
    console
        Where to.
    text
        The line.
    indent
        Columns by which the second and every later line is moved to the right.
    """
    if console.is_terminal:
        take_width(console)
        lines = text.divide(_breaks(text.plain, console.width, indent))
        for line in lines:
            line.rstrip()
        text = Text(f"\n{' ' * indent}").join(lines)
    console.print(text, soft_wrap=True)


def _breaks(text: str, columns: int, indent: int) -> list[int]:
    """Return where the second and every later line begins."""
    breaks, used = [], 0
    for word in re.finditer(r"\s*\S+\s*", text):
        if used > indent and used + cell_len(word[0].rstrip()) > columns:
            breaks.append(word.start())
            used = indent
        used += cell_len(word[0])
    return breaks


def complain(error: DcmpError) -> None:
    """Print an error to standard error, a line for each of its faults and notes."""
    for line in (*str(error).splitlines(), *getattr(error, "__notes__", ())):
        print_sentence(err, Text.assemble(("error: ", "bold red"), line))


def warn(sentence: str) -> None:
    """Print a warning."""
    print_sentence(err, Text.assemble(("warning: ", "bold yellow"), sentence))


def note(sentence: str, command: str = "") -> None:
    """Print something worth knowing.

    Parameters
    ----------
    sentence
        The words.
    command
        A command line that follows; on a narrow terminal it has a line of its own, to be copied whole.
    """
    whole = f"{sentence} {command}".strip()
    take_width(err)
    if command and err.is_terminal and cell_len(whole) > err.width:
        if sentence:
            print_sentence(err, Text(sentence, style="dim"))
        err.print(Text(command, style="dim"), soft_wrap=True)
    else:
        print_sentence(err, Text(whole, style="dim"))


def as_json(figures: Any) -> str:
    """Return figures as a JSON document; NaN and infinity become null."""
    return json.dumps(_plain(figures), indent=2, allow_nan=False) + "\n"


def write_json(target: str, figures: Any) -> None:
    """Write figures as JSON to a file, or to standard output for `-`.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    text = as_json(figures)
    if target == "-":
        out.file.write(text)
        out.file.flush()
        return
    try:
        write_text(Path(target), text)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"--json {target}: {reason}. Choose a file you may write.") from None


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
