"""The two streams: figures and tables on standard output, everything about the run on standard error."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

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


def complain(error: DcmpError) -> None:
    """Print an error to standard error, a line for each of its faults and notes."""
    for line in (*str(error).splitlines(), *getattr(error, "__notes__", ())):
        err.print(Text.assemble(("error: ", "bold red"), line))


def warn(sentence: str) -> None:
    """Print a warning."""
    err.print(Text.assemble(("warning: ", "bold yellow"), sentence))


def note(sentence: str) -> None:
    """Print something worth knowing."""
    err.print(Text(sentence, style="dim"))


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
