"""The boards with a chip, by two compilers; how large they are."""

from __future__ import annotations

import hashlib
import json
import subprocess
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tests.target.build import build, needed
from tools import artefact
from tools.boards import FOLDER, read_boards, released

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

BOARDS = list(read_boards())
CODE, RAM, STACK = 32 * 1024, 16 * 1024, 4096  # bytes, a small part of the chip: more would be a mistake


def nm(elf: Path) -> dict[str, int]:
    said = subprocess.run([needed("arm-none-eabi-nm"), str(elf)], capture_output=True, text=True, check=True)
    found = (line.split() for line in said.stdout.splitlines())
    return {fields[-1]: int(fields[0], 16) for fields in found if len(fields) == 3}


@pytest.mark.parametrize("board", BOARDS)
def test_nothing_but_the_compilers_own_is_linked(f405: Path, board: str) -> None:
    names = nm(f405 / f"{board}.elf")
    assert names["vectors"] == 0x0800_0000
    assert names["startup_reset"] >= 0x0800_C000  # sectors 1 and 2 are the record's
    assert names["stack_start"] == 0x2000_0000  # so that an overflow faults
    assert names["stack_end"] - names["stack_start"] == STACK
    assert not {name for name in names if "malloc" in name or "printf" in name or name.startswith("_impure")}


def test_second_compiler_says_nothing(tmp_path: Path) -> None:
    folder, said = build(tmp_path, "f405-clang")
    assert "warning" not in said
    assert len(list(folder.glob("**/bench_f405_dac.dir/**/bench.c.*"))) > 0


def test_sizes_are_printed_and_small(tmp_path: Path, figure: Callable[[str], None]) -> None:
    needed("cmake")
    needed("arm-none-eabi-gcc")
    sizes = artefact.compile_boards(tmp_path / "built")
    assert set(sizes) == set(BOARDS)
    for board, use in sizes.items():
        figure(f"size of {board:16} code {use['CODE']:6} B, RAM {use['RAM']:6} B, {STACK} B of it stack")
        assert 4096 < use["CODE"] < CODE
        assert STACK < use["RAM"] < RAM
    manifest = artefact.release(tmp_path / "built", tmp_path / "released", sizes)
    assert json.loads((tmp_path / "released/manifest.json").read_text()) == manifest
    assert manifest["protocol_hash"] == f"0x{PROTOCOL_HASH:08x}"
    for board in released(read_boards()):
        image = (tmp_path / f"released/{board}.bin").read_bytes()
        vectors = (tmp_path / f"released/{board}.vectors.bin").read_bytes()
        code = (tmp_path / f"released/{board}.code.bin").read_bytes()
        assert image == vectors.ljust(0xC000, b"\xff") + code
        known = manifest["boards"][board]  # type: ignore[index]
        assert known["sha256"][f"{board}.bin"] == hashlib.sha256(image).hexdigest()
        assert (
            known["board_h_sha256"] == hashlib.sha256((FOLDER / board / "board.h").read_bytes()).hexdigest()
        )
        assert PROTOCOL_HASH.to_bytes(4, "little") in code
