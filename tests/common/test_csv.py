"""Reading CSV columns: what any caller may rely on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.common.csv import read_columns
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path


def test_columns_are_read_by_name_in_any_order(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(" b ,time_s,note\n1,0,x\n\n2,0.5,y\n", encoding="utf-8")
    columns = read_columns(path, ("time_s", "b"))
    assert {name: values.tolist() for name, values in columns.items()} == {"time_s": [0, 0.5], "b": [1, 2]}


def test_missing_column_is_named_with_what_there_is(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,b\n0,1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"no column time_s; the header has: t, b"):
        read_columns(path, ("time_s", "b"))


def test_five_faults_are_named_and_the_rest_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,b\n" + "".join(f"{k},{'x' * 200}\n" for k in range(9)), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_columns(path, ("t", "b"))
    assert len(caught.value.faults) == 7
    assert "row 1 (line 2), column b" in caught.value.faults[0]
    assert "4 more" in caught.value.faults[5]
    assert "left out" in caught.value.faults[6]
    assert max(map(len, caught.value.faults)) < 60 + 50 + len(str(path))


def test_line_is_that_of_the_file_when_comments_and_blanks_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for header in ("# note\n\n# t,b\n", "# note\n\nt,b\n"):
        path.write_text(f"{header}0,1\n\n# a comment\n1,oops\n", encoding="utf-8")
        with pytest.raises(ConfigError, match=r"row 2 \(line 7\), column b: 'oops'"):
            read_columns(path, ("t", "b"))
