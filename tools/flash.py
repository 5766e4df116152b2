"""`python -m tools.flash`: write a board's program, and the record of what is connected to it.

By default over the chip's own serial boot loader (BOOT0 high at reset, PA9 and PA10); with `--by pyocd` over
a debug probe. The brown-out level is looked at first; a debug probe sets it.
"""

from __future__ import annotations

import argparse
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError
from tools import artefact, brown_out, manifest
from tools.boards import BOARDS_HELP, FOLDER, read_boards, released
from tools.brown_out import OptionError
from tools.record import RECORD_ADDRESS, image
from tools.rig_record import record_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tools.boards import Board

VECTORS_ADDRESS, CODE_ADDRESS = 0x0800_0000, 0x0800_C000
INSTALL = {
    "stm32flash": "apt install --no-install-recommends stm32flash",
    "pyocd": "pip install pyocd && pyocd pack install stm32f405rg",
}
_STM32FLASH_COMMAND = ["stm32flash", "-b", "115200"]  # to the boot loader


class Piece(NamedTuple):
    """Data of one piece, and its address."""

    file: Path
    address: int


def commands(by: str, pieces: Sequence[Piece], port: str) -> list[list[str]]:
    """Return what writes the pieces, the rest of the memory left alone; the last one starts the board."""
    if by == "pyocd":
        to = ["--target", "stm32f405rg", "--format", "bin", "--base-address"]
        return [["pyocd", "flash", *to, f"{piece.address:#x}", str(piece.file)] for piece in pieces]
    writes = [
        [*_STM32FLASH_COMMAND, "-w", str(piece.file), "-v", "-S", f"{piece.address:#x}", port]
        for piece in pieces
    ]
    return [*writes, [*_STM32FLASH_COMMAND, "-g", f"{VECTORS_ADDRESS:#x}", port]]


def _boards(folder: Path) -> dict[str, Board]:
    """Return the boards of a folder that can be flashed."""
    try:
        boards = read_boards(folder)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--boards: {error}") from None
    if not boards:
        raise ConfigError(f"--boards: no board is in {folder}. Give a folder that has NAME/board.h.")
    return {name: boards[name] for name in released(boards)}


def _arguments() -> argparse.Namespace:
    folder = argparse.ArgumentParser(add_help=False)  # whose boards are the choices
    folder.add_argument("--boards", type=Path, default=FOLDER, help=BOARDS_HELP)
    boards = _boards(folder.parse_known_args()[0].boards)
    parser = argparse.ArgumentParser(prog="python -m tools.flash", description=__doc__, parents=[folder])
    parser.add_argument("board", choices=boards)
    parser.add_argument("rig", help="whose limits and link the board is to have: a name, or a rig.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="sets")
    parser.add_argument("--full-scale-V", type=float, dest="full_scale_V", help="of a DAC (default: 10)")
    parser.add_argument(
        "--supply-V", type=float, dest="supply_V", help="the motor's supply, measured; a PWM board needs it"
    )
    parser.add_argument("--zero-code", type=int, default=2048, help="of the DAC (default: 2048)")
    parser.add_argument("--by", choices=tuple(INSTALL), default="stm32flash")
    parser.add_argument("--port", default="/dev/ttyUSB0", help="of the boot loader (default: /dev/ttyUSB0)")
    parser.add_argument("--firmware", type=Path, default=Path("dist/firmware"), help="made by make firmware")
    parser.add_argument("--only", choices=("record", "program", "brown-out"), help="write one of them")
    parser.add_argument("--dry-run", action="store_true", help="show the commands")
    asked = parser.parse_args()
    asked.board = boards[asked.board]
    return asked


def _data(asked: argparse.Namespace) -> Path:
    """Return the board's board.h."""
    data: Path = asked.boards / asked.board.name / "board.h"
    return data


def _pieces(asked: argparse.Namespace, folder: Path) -> list[Piece]:
    pieces = []
    if asked.only == "record" and not manifest.built_of(_data(asked), asked.firmware):
        artefact.check_data(asked.boards)  # its number is in the record
    if asked.only in (None, "record"):
        rig = load_rig(asked.rig, asked.sets)
        kept = folder / "record.bin"
        made = record_of(
            rig,
            asked.board,
            zero_code=asked.zero_code,
            full_scale_V=asked.full_scale_V,
            supply_V=asked.supply_V,
        )
        kept.write_bytes(image(made))
        pieces.append(Piece(kept, RECORD_ADDRESS))
    if asked.only in (None, "program"):
        parts = _program(asked)
        pieces += parts  # the vectors last: an empty board that was half written does not start
    return pieces


def _program(asked: argparse.Namespace) -> list[Piece]:
    """Return the pieces of the board's program, which were built of its board.h."""
    base = asked.firmware / asked.board.name
    parts = [
        Piece(Path(f"{base}.code.bin"), CODE_ADDRESS),
        Piece(Path(f"{base}.vectors.bin"), VECTORS_ADDRESS),
    ]
    missing = [part.file for part in parts if not part.file.is_file()]
    if missing:
        raise ConfigError(f"{missing[0]}: there is no such file. Say `make firmware` first, or --firmware.")
    build = ["python", "-m", "tools.artefact", str(asked.firmware)]
    build += [] if asked.boards == FOLDER else ["--boards", str(asked.boards)]
    manifest.check_images(_data(asked), [part.file for part in parts], f"`{shlex.join(build)}`")
    return parts


def _do(command: list[str], *, dry_run: bool) -> None:
    """Show a command, and run it."""
    sys.stdout.write(" ".join(command) + "\n")
    if dry_run:
        return
    tool = command[0]
    if shutil.which(tool) is None:
        raise RuntimeError(f"no {tool} here: {INSTALL[tool]}")
    if subprocess.run(command, check=False).returncode:  # noqa: S603
        raise RuntimeError(
            f"{' '.join(command)} failed. Look whether BOOT0 is high and the board was reset, the port is "
            "right, the probe is plugged in."
        )


def _read(command: list[str], file: Path) -> int:
    """Run a command that reads a word into a file; return the word."""
    file.unlink(missing_ok=True)
    _do(command, dry_run=False)
    data = file.read_bytes() if file.is_file() else b""
    if len(data) != brown_out.WORD_BYTES:
        raise RuntimeError(
            f"{' '.join(command)}: {len(data)} bytes were read, expected {brown_out.WORD_BYTES}. Nothing was "
            "written. Look at the wires, and try again."
        )
    return int.from_bytes(data, "little")


def _check_brown_out(word: int, only: str | None) -> None:
    """Say where the brown-out level is not level 3; where it was all that was asked for, fail."""
    known = brown_out.is_open(word)
    said = f"is {brown_out.level(word)}" if known else f"is not known (the option bytes read as {word:#010x})"
    if known and brown_out.level(word) == "level 3":
        return
    sentence = (
        f"the chip's brown-out level {said}, but it writes flash memory safely from 2.7 V on only (level 3). "
        "A debug probe sets it: --by pyocd --only brown-out."
    )
    if only == "brown-out":
        raise OptionError(sentence)
    sys.stderr.write(f"warning: {sentence}\n")


def _set_brown_out(file: Path) -> None:
    """Set brown-out level 3 over a debug probe, where it is another."""
    before = _read(brown_out.read_by_probe(file), file)
    settings = brown_out.planned(before)
    if settings is None:
        sys.stdout.write("brown-out level: level 3\n")
        return
    if not _read(brown_out.hold_by_probe(file), file) & brown_out.HALTED_BIT:
        raise OptionError(
            "the processor did not halt, so that its program could disturb the write. Nothing was written. "
            "Connect the probe's reset line, and try again."
        )
    try:
        _do(brown_out.write_by_probe(settings), dry_run=False)
    except RuntimeError as error:
        raise OptionError(
            f"{error} The option word may have been written, and the processor may be halted: the motor is "
            "off then. Switch the board's supply off and on, and call this again."
        ) from None
    brown_out.check_written(settings, _read(brown_out.read_by_probe(file), file))
    sys.stdout.write(f"brown-out level: level 3 (it was {brown_out.level(before)})\n")


def _brown_out(asked: argparse.Namespace, file: Path) -> None:
    """Set the level where a probe may; look at it where only a part is flashed, or by the boot loader."""
    by_probe = asked.by == "pyocd"
    read = (
        brown_out.read_by_probe(file)
        if by_probe
        else brown_out.read_by_boot_loader(file, _STM32FLASH_COMMAND, asked.port)
    )
    if asked.dry_run:
        _do(read, dry_run=True)
    elif by_probe and asked.only in (None, "brown-out"):
        _set_brown_out(file)
    else:
        _check_brown_out(_read(read, file), asked.only)


def main() -> int:
    """Write the pieces to the board, or print them."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            asked = _arguments()
            pieces = _pieces(asked, Path(folder))
            _brown_out(asked, Path(folder) / "option.bin")
            for command in commands(asked.by, pieces, asked.port):
                _do(command, dry_run=asked.dry_run)
        except ConfigError as error:
            sys.stderr.write(f"error: {error}\n")
            return 2
        except RuntimeError as error:
            sys.stderr.write(f"error: {error}\n")
            return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
