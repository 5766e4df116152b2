"""What tools find in the C without running it: nothing that docs/misra.md does not account for."""

from __future__ import annotations

import os
import re
import subprocess
from typing import TYPE_CHECKING

import pytest

from tests.target.build import FIRMWARE, needed
from tests.target.static import (
    PROGRAMS,
    TABLE,
    Deviation,
    Finding,
    analyze,
    cppcheck,
    deviations,
    everywhere,
    judge,
    version_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

OLDEST = (2, 10)  # Debian 12's: older ones know fewer rules

BREACHES = """
#include <stdlib.h>
#include <stdint.h>
int32_t breach(int32_t kind, const int32_t *at);
int32_t breach(int32_t kind, const int32_t *at)
{
    int32_t room[2] = {0, 0};
    int32_t *more = malloc(4u);
    switch (kind) {
    case 0:
        room[0] = 1;
    default:
        break;
    }
    if (kind) goto end; /* three in a line */
    room[2] = *at;
end:
    return breach(kind - 1, at) + room[0] + *more;
}
"""
FOUND = {
    "14.4": "a condition that is no bool",
    "15.1": "goto",
    "15.6": "a body without braces",
    "16.3": "no break",
    "17.2": "recursion",
    "21.3": "malloc",
    "arrayIndexOutOfBounds": "room[2]",
}
DEFECTS = {
    "null-dereference": "int f(int *p); int f(int *p) { if (p == 0) { return *p; } return 1; }",
    "use-of-uninitialized-value": "int f(int k); int f(int k) { int x; if (k > 3) { x = 1; } return x; }",
    "use-of-pointer-in-stale-stack-frame": """
        int f(void);
        static int *g(void) { int x = 1; int *p = &x; return p; }
        int f(void) { return *g(); }
    """,
}


def _version() -> str:
    said = subprocess.run(
        [needed("cppcheck"), "--version"], capture_output=True, text=True, check=True
    ).stdout
    version = version_of(said)
    if version < OLDEST:
        reason = f"docs/misra.md is about cppcheck 2.10 and newer, here is {said.strip()}: use a newer one"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return ".".join(map(str, version))


def test_every_file_is_in_a_program() -> None:
    files = {
        path for folder in ("core", "app", "soc", "boards") for path in (FIRMWARE / folder).glob("**/*.c")
    }
    assert len(files) > 40
    checked = {path for program in PROGRAMS.values() for path in program.files()}
    assert files == {path for path in checked if path.is_relative_to(FIRMWARE)}


def test_nothing_but_what_the_page_accounts_for(tmp_path: Path, figure: Callable[[str], None]) -> None:
    version = _version()
    rows = deviations(TABLE.read_text())
    found = everywhere(
        {name: cppcheck(program, program.files(), tmp_path) for name, program in PROGRAMS.items()}
    )
    figure(
        f"cppcheck {version}, MISRA C:2012: {len(found)} findings, {len(rows)} deviations account for them"
    )
    wrong = list(judge(found, rows, version))
    assert not wrong, "\n".join(["mend it, or say in docs/misra.md why not:", *wrong])


@pytest.mark.parametrize("name", ["bench_f405_dac", "native"])
def test_seeded_breaches_are_found(tmp_path: Path, name: str) -> None:
    _version()
    seeded = tmp_path / "seeded.c"
    seeded.write_text(BREACHES)
    found = {finding.rule for finding in cppcheck(PROGRAMS[name], [seeded], tmp_path)}
    assert set(FOUND) <= found, sorted(found)


def test_cppcheck_reads_a_copy_of_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its dumps lie beside what it reads, and two runs in one tree would take each other's."""
    program = PROGRAMS["hostlib"]
    fake = tmp_path / "bin/cppcheck"
    fake.parent.mkdir()
    fake.write_text("""#!/bin/sh
for last in "$@"; do :; done
cat "$last" >/dev/null && printf '%s\\t1\\tplace\\n' "$PWD" >&2
""")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{fake.parent}:/bin:/usr/bin")
    ((rule, place, _),) = cppcheck(program, program.files(), tmp_path)
    assert (rule, place) == ("place", str(tmp_path / "firmware"))


@pytest.mark.parametrize(
    ("said", "version"),
    [
        ("Cppcheck 2.9\n", (2, 9)),
        ("Cppcheck 2.10\n", (2, 10)),
        ("Cppcheck 2.13.0\n", (2, 13)),
        ("Cppcheck 2.18 dev\n", (2, 18)),
        ("Cppcheck 3.0\n", (3, 0)),
    ],
)
def test_version_is_two_numbers(said: str, version: tuple[int, int]) -> None:
    assert version_of(said) == version
    assert (version >= OLDEST) == (said != "Cppcheck 2.9\n")


def test_page_is_held_to_its_word() -> None:
    finding = Finding("15.5", "core/a.c", 7)
    row = Deviation("15.5", "core/*.c", "said in a line that is long enough")
    assert list(judge([finding], [row])) == []
    assert list(judge([finding], [])) == ["core/a.c:7: 15.5"]
    assert list(judge([finding._replace(file="app/a.c")], [row])) == [
        "app/a.c:7: 15.5",
        "docs/misra.md: nothing in core/*.c needs 15.5",
    ]
    page = "| rule | where | why |\n|---|---|---|\n"
    page += "| 1.1, 2.2 | `a.c` `b.c` (2.17) | mistaken, and only that version is |\n"
    rows = deviations(page)
    assert [(row.rule, row.where) for row in rows] == [
        ("1.1", "a.c"),
        ("1.1", "b.c"),
        ("2.2", "a.c"),
        ("2.2", "b.c"),
    ]
    assert list(judge([], rows)) == []
    assert len(list(judge([], rows, "2.17"))) == 4
    assert list(judge([], rows, "2.13")) == []  # a version that the page does not name needs no row, but
    assert list(judge([finding], rows, "2.13")) == ["core/a.c:7: 15.5"]  # has to find nothing without one
    with pytest.raises(AssertionError, match="no reason"):
        deviations("| 15.5 | `core/*.c` | because |")
    with pytest.raises(AssertionError, match="no place"):
        deviations("| 15.5 | core | said in a line that is long enough |")


def test_unused_is_what_no_program_uses() -> None:
    unused = Finding("2.5", "soc/stm32f4/regs.h", 1)
    other = Finding("2.5", "boards/native/plant_port.h", 1)
    said = {"bench_f405_dac": [unused], "qemu_f405": [unused, other], "native": [other]}
    assert everywhere(said) == {unused, other}
    assert everywhere({**said, "bench_f405_dac": []}) == {other}
    assert everywhere({**said, "native": []}) == {unused}


@pytest.mark.parametrize("name", PROGRAMS)
def test_gcc_analyzer_finds_nothing(tmp_path: Path, name: str) -> None:
    program = PROGRAMS[name]
    said = {file.name: analyze(program, file, tmp_path / "out.o") for file in program.files()}
    assert not any(said.values()), "".join(said.values())


@pytest.mark.parametrize("name", ["bench_f405_dac", "native"])
@pytest.mark.parametrize("kind", DEFECTS)
def test_seeded_defects_are_found_by_gcc_analyzer(tmp_path: Path, name: str, kind: str) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(DEFECTS[kind])
    assert re.search(rf"\[-Wanalyzer-{kind}\]", analyze(PROGRAMS[name], seeded, tmp_path / "out.o"))
