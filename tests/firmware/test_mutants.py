"""The tool that breaks the safety C notices what it should, and complains when it must."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.firmware.core_library import CORE, HERE, compiler
from tools.mutants.__main__ import FILES, NAMES
from tools.mutants.generate import Mutant, mutants
from tools.mutants.report import complaints, names, table
from tools.mutants.trials import Verdict, verdicts

if TYPE_CHECKING:
    from pathlib import Path

TESTS = [str(HERE / "core" / f"test_{name}.py") for name in ("watchdog", "elementary")]


def made(file: str, old: str, new: str) -> Mutant:
    """Return a mutant made by hand."""
    source = (CORE / file).read_bytes()
    assert source.count(old.encode()) == 1
    return Mutant(file, "by hand", old, new, 1, 1, source.replace(old.encode(), new.encode()))


BY_HAND = {
    "> watchdog->time_us": ("dcmp_watchdog.c", "< watchdog->time_us", "tests"),
    "return now_us -": ("dcmp_watchdog.c", "for (;;) {} return now_us -", "time"),
    "bool dcmp_watchdog_expired(": ("dcmp_watchdog.c", "bool dcmp_watchdog_expired(;", "dropped"),
    "watchdog->fed_us = now_us;": ("dcmp_watchdog.c", "watchdog->fed_us = now_us + 0;", "dropped"),
    "ttl_ms < watchdog_ms": ("dcmp_watchdog.c", "ttl_ms <= watchdog_ms", "survived"),
    "n > x ? below : n": ("dcmp_elementary.h", "n >= x ? below : n", "tests"),
    "const real none = x - x;": ("dcmp_elementary.h", "const real none = (x - x);", "dropped"),
    "DCMP_PI_3 REAL(1.984187159361081e-09)": ("dcmp_real.h", "DCMP_PI_3 REAL(1e-04)", "tests"),
    ">= DCMP_LEASE_US": ("dcmp_session.c", "> DCMP_LEASE_US", "survived"),  # test_sessions.py is not asked
}


def test_broken_code_is_noticed_by_a_test_that_is_there() -> None:
    compiler()
    found = verdicts([made(file, old, new) for old, (file, new, _) in BY_HAND.items()], 1, TESTS)
    assert {each.mutant.line: each.what for each in found} == {
        old: what for old, (*_, what) in BY_HAND.items()
    }
    assert "::test_" in found[0].by
    assert [each.by for each in found[2:4]] == ["does not compile", "the same as the original"]


def test_a_named_mutant_in_other_words_is_dropped_whether_the_named_one_is_drawn_or_not() -> None:
    compiler()
    named = made("dcmp_watchdog.c", "ttl_ms < watchdog_ms", "ttl_ms <= watchdog_ms")
    same = made("dcmp_watchdog.c", "ttl_ms < watchdog_ms", "ttl_ms <= (watchdog_ms)")
    for drawn in ([same, named], [named, same], [same]):
        found = {each.mutant: each for each in verdicts(drawn, 1, TESTS, named=[named])}
        by = "the same as another mutant" if drawn[0] is named else "the same as a named mutant"
        assert (found[same].what, found[same].by) == ("dropped", by)
        assert all(found[one].what == "survived" for one in drawn if one is named)
        assert complaints({named.key: "why"}, [named, same], list(found.values())) == []


def test_tests_that_fail_without_a_mutant_say_nothing(tmp_path: Path) -> None:
    compiler()
    (tmp_path / "test_broken.py").write_text("def test_broken() -> None:\n    assert False\n", "utf-8")
    with pytest.raises(RuntimeError, match=r"without a mutant: tests by .*test_broken"):
        verdicts([], 1, [str(tmp_path)])


ALIVE, DEAD = (
    made("dcmp_watchdog.c", "ttl_ms < watchdog_ms", "true"),
    made("dcmp_watchdog.c", "1000u", "1001u"),
)
FOUND = [Verdict(ALIVE, "survived", ""), Verdict(DEAD, "tests", "test_x")]


def test_names_and_survivors_are_the_same() -> None:
    every = [ALIVE, DEAD]
    assert complaints({ALIVE.key: "why"}, every, FOUND) == []
    (unnamed,) = complaints({}, every, FOUND)
    assert "no test notices" in unnamed
    assert ALIVE.line in unnamed
    (killed,) = complaints({ALIVE.key: "why", DEAD.key: "why"}, every, FOUND)
    assert "named, but tests (test_x)" in killed
    (gone,) = complaints({ALIVE.key: "why"}, [DEAD], FOUND[1:])
    assert "no such mutant" in gone
    assert table(FOUND, {}).splitlines()[-3].split("|")[2:-1] == [f"{n:9} " for n in (2, 1, 0, 0, 0, 1)]


def test_every_name_is_of_a_mutant_and_says_why() -> None:
    every = [mutant for path in FILES for mutant in mutants(path)]
    assert len({mutant.key for mutant in every}) == len(every)
    assert complaints(names(NAMES), every, []) == []


@pytest.mark.parametrize("entry", ["file = 'a'", "file='a'\nwhere='b'\nline='c'\nbecomes='d'\nwhy=' '"])
def test_name_without_a_reason_is_refused(tmp_path: Path, entry: str) -> None:
    (tmp_path / "mutants.toml").write_text(f"[[mutant]]\n{entry}\n", "utf-8")
    with pytest.raises(RuntimeError, match="without"):
        names(tmp_path / "mutants.toml")


SMALL = """\
#define MOST 3u /* of 4 */
static const int row[] = {A, B};
int f(int a, int b)
{
    if (a < 1 && b) {
        return 0; /* not 5 */
    }
    g(a); g(a);
    while (!a) {
        a++;
    }
    return a + b;
}
"""


HEADER = """\
#ifndef SMALL_H
#define SMALL_H
#if defined(A) && A != 1
#error "no 7 here"
#endif
#ifdef SINGLE
#define MOST REAL(2.5) /* of 4.5 */
#else
#define MOST REAL(0x1p-3)
#endif
static inline real f(real x)
{
    return x * 1e-05 + REAL(0.0) > 1.0 ? -x : MOST;
}
#endif
"""


def test_mutants_of_a_header(tmp_path: Path) -> None:
    (tmp_path / "small.h").write_text(HEADER, "utf-8")
    found = [
        each
        for each in mutants(tmp_path / "small.h")
        if each.row in (3, 4, 7, 9) or "x * 1e-05 +" in each.line
    ]
    numbers = {each.becomes for each in found if each.row == 13}
    assert {each.becomes for each in found if each.row != 13} == {
        "#define MOST REAL(2.5025)",
        "#define MOST REAL(0.125125)",
    }
    assert {each.where for each in found} == {"MOST", "f"}
    for text in (
        "x * 1.001e-05 + REAL(0.0) > 1.0",
        "x * 1e-05 + REAL(1.0) > 1.0",
        "REAL(0.0) > 2.0",
        "REAL(0.0) > 0.0",
    ):
        assert any(text in number for number in numbers), text


def test_mutants_of_every_kind(tmp_path: Path) -> None:
    (tmp_path / "small.c").write_text(SMALL, "utf-8")
    found = mutants(tmp_path / "small.c")
    lines = [line.split("/*")[0].strip() for line in SMALL.splitlines()]
    assert {(each.row, each.becomes) for each in found} == {
        (1, "#define MOST 4u"),
        (2, "static const int row[] = {B, B};"),
        (2, "static const int row[] = {A, A};"),
        *((5, f"if ({text}) {{") for text in ("true", "false", "!(a < 1 && b)", "a < 1 || b", "true && b")),
        *((5, f"if ({text} && b) {{") for text in ("a <= 1", "a >= 1", "a < 2", "a < 0")),
        (5, "if (a < 1 && true) {"),
        (6, "return 1;"),
        (6, ";"),
        (8, "; g(a);"),
        (8, "g(a); ;"),
        *((9, f"while ({text}) {{") for text in ("false", "!(!a)", "a")),
        (10, "a--;"),
        (10, ";"),
        (12, "return a - b;"),
    }
    assert {each.where for each in found} == {"MOST", "row", "f"}
    assert all(each.line == lines[each.row - 1] for each in found)
