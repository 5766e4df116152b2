"""A note in any letters is kept as it was typed, in a locale that knows ASCII alone too."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from dcmp_hil.common.printable_text import readable
from dcmp_hil.recording.reader import read_run

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

NOTE = "µ → ≤ Prüfling 3"
PLAIN_C = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


def test_surrogates_become_what_was_typed() -> None:
    assert readable(NOTE.encode().decode("ascii", "surrogateescape")) == NOTE
    assert readable(NOTE) == NOTE
    assert readable(b"\xb0".decode("ascii", "surrogateescape")) == "\N{REPLACEMENT CHARACTER}"


def test_note_is_kept_in_an_ascii_locale(script: Callable[..., Finished], tmp_path: Path) -> None:
    done = script("run", "--fast", "--duration", "1", "--viewer", "none", "--note", NOTE, env=PLAIN_C)
    assert done.code == 0, done.err
    (folder,) = (tmp_path / "runs").iterdir()
    assert json.loads((folder / "summary.json").read_text("utf-8"))["note"] == NOTE
    assert read_run(folder / "run.mcap").run["note"] == NOTE
