"""What follows from dcmp.dbc is on disk as it should be."""

import hashlib
import re
import sys
from pathlib import Path

import pytest

from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tools.protocol import __main__ as protocol
from tools.protocol.__main__ import PAGE, files
from tools.protocol.dbc import DBC, ROOT, protocol_hash
from tools.protocol.layout import MARK

TEXT = DBC.read_text("utf-8")
MEANT = re.compile(r"\s*(BO_|SG_|VAL_) ")


def _main(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.setattr(sys, "argv", ["protocol", "--check"])
    with pytest.raises(SystemExit) as end:
        protocol.main()
    return end.value.code


def test_every_file_is_what_the_dbc_says() -> None:
    made = files()
    assert PAGE in made
    for path, text in made.items():
        assert path.read_text("utf-8") == text, f"{path}: make generate"


def test_the_folder_of_the_call_and_its_settings_do_not_matter(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    right = files()
    (tmp_path / "ruff.toml").write_text("line-length = 40\nindent-width = 2\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    assert files() == right


def test_every_generated_file_says_so_and_no_other_does() -> None:
    marked = {
        path
        for folder in ("dcmp_hil", "sim_backend", "firmware")
        for path in (ROOT / folder).rglob("*.[pch]*")
        if path.suffix in {".py", ".c", ".h"} and MARK in path.read_text("utf-8").partition("\n")[0]
    }
    assert marked == set(files()) - {PAGE}


def test_the_check_says_so(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert not _main(monkeypatch)
    assert capsys.readouterr().out == ""
    header = ROOT / "firmware/core/dcmp_protocol_hash.h"
    monkeypatch.setattr(protocol, "files", lambda: files() | {header: "another\n"})
    assert _main(monkeypatch)
    assert capsys.readouterr().out.startswith("firmware/core/dcmp_protocol_hash.h is not what dcmp.dbc says")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("| STOP | 1 | 0x010 |", "| STOP | 1 | 0x011 |"),
        ("`seq` 19, u13", "`seq` 16, u13"),
        ("DRIVE.`ttl_ms`: May", "DRIVE.`ttl_ms`: Must"),
        ("3 RUN", "3 GO"),
        (f"`0x{PROTOCOL_HASH:08x}`", "`0x00000000`"),
        ("`t01020307`", "`t01020308`"),
    ],
)
def test_a_stale_page_is_noticed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, old: str, new: str) -> None:
    page = tmp_path / "protocol.md"
    right = PAGE.read_text("utf-8")
    assert right.count(old) == 1
    page.write_text(right.replace(old, new), "utf-8")
    monkeypatch.setattr(protocol, "PAGE", page)
    assert files()[page] == right


def test_the_hash_is_what_the_page_says() -> None:
    lines = [line.strip() for line in TEXT.splitlines() if MEANT.match(line)]
    digest = hashlib.sha256("".join(line + "\n" for line in lines).encode()).hexdigest()
    assert int(digest[:8], 16) == protocol_hash(TEXT) == PROTOCOL_HASH
    assert len(lines) > 70


def test_the_hash_ignores_comments_and_blank_lines() -> None:
    bare = [line for line in TEXT.splitlines() if line.strip() and not line.startswith("CM_")]
    assert len(bare) < len(TEXT.splitlines())
    assert protocol_hash("\n".join(bare)) == PROTOCOL_HASH
    assert protocol_hash("\n \n".join(bare) + "\n\n") == PROTOCOL_HASH
    assert protocol_hash(TEXT.replace("\n", "\r\n")) == PROTOCOL_HASH
    assert protocol_hash(TEXT + 'CM_ SG_ 16 reason "Another word.";\n') == PROTOCOL_HASH
    assert protocol_hash(re.sub(r'(?m)^(CM_ .*) ".*";$', r'\1 "";', TEXT)) == PROTOCOL_HASH


def test_the_hash_notices_every_other_change() -> None:
    lines = TEXT.splitlines()
    changed = []
    for at, line in enumerate(lines):
        if not MEANT.match(line):
            continue
        others = [
            *(line[:place] + "~" + line[place + 1 :] for place, letter in enumerate(line) if letter != " "),
            *(
                line[: found.start()] + str(int(found[0]) + 1) + line[found.end() :]
                for found in re.finditer(r"\d+", line)
            ),
            f"{line}\n{line}",
            "",
        ]
        changed += ["\n".join([*lines[:at], other, *lines[at + 1 :]]) for other in others]
        if at + 1 < len(lines) and MEANT.match(lines[at + 1]):
            changed.append("\n".join([*lines[:at], lines[at + 1], line, *lines[at + 2 :]]))
    hashes = {protocol_hash(text) for text in changed}
    assert PROTOCOL_HASH not in hashes
    assert len(changed) > 3000
