"""The two streams: figures and tables on standard output, everything about the run on standard error."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from dcmp_hil.errors import DcmpError

out = Console(soft_wrap=True)
err = Console(stderr=True, soft_wrap=True)


def complain(error: DcmpError) -> None:
    """Print an error, one line a fault."""
    for line in (*str(error).splitlines(), *getattr(error, "__notes__", ())):
        err.print(Text.assemble(("error: ", "bold red"), line))


def warn(sentence: str) -> None:
    """Print a warning."""
    err.print(Text.assemble(("warning: ", "bold yellow"), sentence))


def note(sentence: str) -> None:
    """Print something worth knowing."""
    err.print(Text(sentence, style="dim"))


def write_json(target: str, figures: Any) -> None:
    """Write figures as JSON to a file, or to standard output for `-`; NaN and infinity become null.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    text = json.dumps(_plain(figures), indent=2, allow_nan=False)
    if target == "-":
        out.file.write(text + "\n")
        out.file.flush()
        return
    try:
        Path(target).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"--json {target}: {error.strerror or error}. Choose a file you may write."
        ) from None


def make_folder(folder: Path) -> None:
    """Make a folder that may be there already.

    Raises
    ------
    ConfigError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{folder}: {error.strerror or error}. Choose a folder you may write in.") from None


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
