"""What is documented of a command: its exit codes, its lines on standard error, the files that it keeps."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

from tests.walk.streams import TAKES_NOTHING, TERMINAL
from tests.walk.values import STREAM

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from tests.walk.streams import Called

_AT = r" *\d+\.\d{3} s  "  # the device time of an event
_RUN_SAYS = (
    r"kept in runs/\S+/",
    r"no viewer was open; to see the run: \S*rerun \S+",
    r"or look at runs/\S+/run\.png",
    r"to watch: dcmp-hil view, or rerun --connect rerun\+http://127\.0\.0\.1:\d+/proxy",
    r"web viewer: http://127\.0\.0\.1:\d+\?url=\S+",
    r"warning: No viewer window: there is no display .* To watch in a browser: --viewer web\.",
    r"warning: backend\.kind = sim has no wire, .*: this run has backend\.kind=sim-board\.",
    _AT + r"No viewer answers on 127\.0\.0\.1:9876; the run goes on without one\. Start it first with: .*",
    _AT + r"voltage limited: .*",
    _AT + r"The motor's gain .*",
)
_SAYS: Mapping[str, tuple[str, ...]] = {
    "run": _RUN_SAYS,
    "replay": (
        *(r"wrote \S+", r"warning: .*", r"note: .*"),
        *(r'(?:[^:"]+: )?(?:time|position|velocity|torque|voltage): column ".*" in .* \(.*\)', r"mu0 = .*\."),
        r"Counts per revolution: \d+ \(.*\)\. --counts-per-rev overrides it\.",
        *(r"Evenly sampled, .*\.", r"The rows are not evenly sampled: .*\.", r"The stamps are .*\."),
        r".+: The disturbance is judged by a reference with the model of this variant, .*",
        r".+: \d+ changes? of .+ in the run (?:is|are) not repeated here, because .*",
    ),
    "export": (r"wrote \S+",),
    "check": (r"wrote \S+", r"\S+ says so already"),
    "rigs": (r"wrote \S+", r".*copy.*"),
    "paper": (r"wrote \S+", r"no picture: .*"),
    "sweep": (
        *(r"engine: .*", r"\d+ of \d+ runs.*", r"wrote \S+sweep\.png: .*", r"results in .*"),
        r"looking at the rig, and timing .*",
    ),
    "view": (r"web viewer: http://127\.0\.0\.1:\d+\?url=\S+",),
    "device": (r"dcmp-hil run .*",),
    "panel": (r"Ctrl-C ends the page; .*", r"warning: No web viewer .*"),
    "monitor": (r".*",),
}
_REFUSED_EXIT_CODE = 2


def check(command: str, chosen: Mapping[str, tuple[str, ...]], called: Called, folder: Path) -> None:
    """Compare the result of a call with the documentation.

    Raises
    ------
    AssertionError
        With everything that the command printed.
    """
    (stream,) = chosen[STREAM]
    told = f"{called.code}\n{called.out}\n{called.err}"
    assert "Traceback" not in told, told
    assert called.code in _codes(command, chosen), told
    if stream not in {*TAKES_NOTHING[-1:], TERMINAL}:
        _check_lines(command, called)
    if called.code != _REFUSED_EXIT_CODE:
        _check_files(command, chosen, folder, called)


def _codes(command: str, chosen: Mapping[str, tuple[str, ...]]) -> set[int]:
    if command == "run":
        return {4} if "shove" in "".join(chosen["--fault"]) else {0}
    if command in {"check", "export", "view"}:
        return {0 if _complete(command, chosen) else _REFUSED_EXIT_CODE}
    if command == "replay" or (command == "panel" and chosen["--web"]):
        return {0, _REFUSED_EXIT_CODE}
    if command == "conform":
        return {0} if chosen["--list"] or chosen["--link"] == () else {0, _REFUSED_EXIT_CODE, 3}
    return {0}


def _complete(command: str, chosen: Mapping[str, tuple[str, ...]]) -> bool:
    """Return whether the options say all that the command needs."""
    if command == "export":
        return any(chosen[name] for name in ("--csv", "--parquet", "--rrd"))
    if command == "view":
        return bool(chosen["--web"])
    return not chosen["--write"] or bool(chosen["--set"] and chosen["RIG"] != ("bench-1khz",))


def _check_lines(command: str, called: Called) -> None:
    lines = [line for line in called.err.splitlines() if line]
    errors = [line for line in lines if line.startswith("error: ")]
    assert bool(errors) == bool(called.code), called.err
    assert len(errors) <= 1 or called.code == _REFUSED_EXIT_CODE, called.err
    known = re.compile("|".join(("error: .*", *_SAYS.get(command, ()))))
    unknown = [line for line in lines if not known.fullmatch(line)]
    assert not unknown, f"not documented: {unknown}"


def _check_files(command: str, chosen: Mapping[str, tuple[str, ...]], folder: Path, called: Called) -> None:
    if chosen.get("--list"):  # ends before any check
        return
    for option, words in chosen.items():
        nothing = chosen.get("--no-figures") or chosen.get("--dry-run")
        if option == "--out" and nothing:  # a folder for nothing is not made
            continue
        for word in words[1:]:
            if str(folder) in word and command != "device":
                _check_file(folder, word, called)
    if command == "run":
        _check_run(chosen, folder, called)


def _check_file(folder: Path, word: str, called: Called) -> None:
    path = folder / word.removeprefix(f"{folder}/")
    assert path.is_dir() or path.stat().st_size, f"{path}\n{called.err}"
    if path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))


def _check_run(chosen: Mapping[str, tuple[str, ...]], folder: Path, called: Called) -> None:
    runs = list((folder / "runs").iterdir()) if (folder / "runs").exists() else []
    if chosen["--no-record"]:
        assert not runs
        return
    (run,) = runs
    expected = {"summary.json", "run.mcap"}
    if not chosen["--record"]:
        expected.add("run.rrd")
    if called.code:
        expected.add("black_box.csv")
    if chosen["--viewer"][1:] in {(), ("spawn",), ("none",)}:
        expected.add("run.png")
    assert {path.name for path in run.iterdir()} - {"process.log"} == expected
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert summary["periods"] > 0
    assert (summary["ended_by"] == "duration") == (called.code == 0), summary["ended_by"]
