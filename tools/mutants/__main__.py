"""Try the mutants of the safety C; fail if one lives that tests/firmware/mutants.toml does not name."""

from __future__ import annotations

import argparse
import os
import random
import sys
import time
from pathlib import Path

import pytest

from tests.firmware.core_library import APP, CORE, HERE, ROOT, law_headers
from tools.mutants.generate import mutants
from tools.mutants.report import complaints, names, page, table
from tools.mutants.trials import verdicts

_CORE = ("watchdog", "supervisor", "guard", "amplifier", "session", "health", "device", "encoder", "receive")
_APP = ("life", "app", "record", "boot_count", "fault_log", "ring")
FILES = [CORE / f"dcmp_{name}.c" for name in (*_CORE, "history", "parameters")]
FILES += [APP / f"{name}.c" for name in _APP]
FILES += [CORE / "dcmp_real.h", *law_headers()]
NAMES = HERE / "mutants.toml"


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("files", nargs="*", help="only these, by name (dcmp_guard.c)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--sample", type=int, help="try so many, drawn by --seed")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--markdown", type=Path, default=ROOT / "reports" / "mutants.md")
    return parser.parse_args()


def main() -> int:
    """Try, print the table, write the report."""
    asked = _asked()
    began = time.monotonic()
    every = [mutant for path in FILES for mutant in mutants(path)]
    chosen = [mutant for mutant in every if not asked.files or mutant.file in asked.files]
    if asked.sample is not None and asked.sample < len(chosen):
        drawn = random.Random(asked.seed).sample(range(len(chosen)), asked.sample)  # noqa: S311
        chosen = [chosen[i] for i in sorted(drawn)]
    try:
        named = names(NAMES)
        found = verdicts(chosen, asked.jobs, named=[mutant for mutant in every if mutant.key in named])
    except (
        RuntimeError,
        pytest.skip.Exception,
        pytest.fail.Exception,
    ) as error:  # no compiler: the tests' words
        sys.stderr.write(f"error: {error}\n")
        return 3
    wrong = complaints(named, every, found)
    took_s = time.monotonic() - began
    asked.markdown.parent.mkdir(parents=True, exist_ok=True)
    asked.markdown.write_text(page(found, named, wrong, took_s), "utf-8")
    sys.stdout.write(f"{table(found, named)}{took_s:.0f} s; {asked.markdown}\n")
    sys.stderr.write("".join(f"\n{each}\n" for each in wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
