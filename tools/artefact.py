"""`python -m tools.artefact`: build the firmware for its boards and put what is released into a folder."""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

from dcmp_hil.errors import ConfigError
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tools import manifest
from tools.boards import BOARDS_HELP, FOLDER, read_boards, released

FIRMWARE = Path(__file__).resolve().parent.parent / "firmware"
PIECES = ("elf", "bin", "vectors.bin", "code.bin", "map")
INSTALL = "apt install --no-install-recommends cmake gcc-arm-none-eabi"
_MEMORY_USE = re.compile(r"^\s*(\w+):\s+(\d+) B\s+(\d+) (KB|MB|B)", re.MULTILINE)


def compile_boards(folder: Path, boards: Path = FOLDER) -> dict[str, dict[str, int]]:
    """Build a folder of boards in another folder; return what each board takes of each memory, bytes.

    Raises
    ------
    RuntimeError
        If a tool is missing or fails.
    """
    for tool in ("cmake", "arm-none-eabi-gcc"):
        if shutil.which(tool) is None:
            raise RuntimeError(f"no {tool} here: {INSTALL}")
    said = ""
    for command in (
        # The folder may have been configured for the boards of another folder, which CMake remembers.
        ["cmake", "--preset", "f405", "-B", str(folder), f"-DDCMP_BOARDS={boards}"],
        ["cmake", "--build", str(folder), "--clean-first"],
    ):
        done = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=False)  # noqa: S603
        said += done.stdout
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    uses = [
        {region: int(used) for region, used, *_ in _MEMORY_USE.findall(part)}
        for part in said.split("Linking")
    ]
    linked = re.findall(r"Linking C executable (\w+)\.elf", said)
    return dict(zip(linked, uses[-len(linked) :], strict=True))


def check_data(boards: Path) -> None:
    """Let CMake check every board.h in a folder of boards, as it does before it builds them.

    Raises
    ------
    ConfigError
        If one is wrong, in CMake's words.
    RuntimeError
        If CMake is missing.
    """
    if shutil.which("cmake") is None:
        raise RuntimeError(f"no cmake here, which checks the board.h: {INSTALL}")
    folders = ";".join(str(file.resolve().parent) for file in sorted(boards.glob("*/board.h")))
    command = ["cmake", f"-DFOLDERS={folders}", "-P", "cmake/boards.cmake"]
    done = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        said = " ".join(done.stderr.partition("Call Stack")[0].split())
        raise ConfigError(said.partition(" (message): ")[2] or said)


def release(
    built: Path, target: Path, sizes: dict[str, dict[str, int]], boards: Path = FOLDER
) -> dict[str, object]:
    """Copy what is released; return what is known of it, as it stands in `manifest.json`.

    Raises
    ------
    RuntimeError
        If a board.h is newer than the program that was built of it.
    """
    target.mkdir(parents=True, exist_ok=True)
    known = {}
    for board in released(read_boards(boards)):
        data = boards / board / "board.h"
        if data.stat().st_mtime_ns > (built / f"{board}.elf").stat().st_mtime_ns:
            raise RuntimeError(f"{data} was changed while it was built. Build it anew.")
        images = [target / f"{board}.{piece}" for piece in PIECES]
        for image in images:
            image.write_bytes((built / image.name).read_bytes())
        known[board] = manifest.entry(data, images, sizes[board])
    made: dict[str, object] = {"protocol_hash": f"0x{PROTOCOL_HASH:08x}", "boards": known}
    (target / manifest.NAME).write_text(json.dumps(made, indent=2) + "\n", "utf-8")
    return made


def main() -> int:
    """Build the artefact, copy it, and print its size."""
    parser = argparse.ArgumentParser(prog="python -m tools.artefact", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("dist/firmware"))
    parser.add_argument("--boards", type=Path, default=FOLDER, help=BOARDS_HELP)
    asked = parser.parse_args()
    folder, boards = asked.folder.resolve(), asked.boards.resolve()
    try:
        sizes = compile_boards(FIRMWARE / "build/f405", boards)
        release(FIRMWARE / "build/f405", folder, sizes, boards)
    except RuntimeError as error:
        sys.stderr.write(f"error: {error}\n")
        return 3
    for board, use in sizes.items():
        sys.stdout.write(
            f"{board:16}" + "".join(f"{name:>10} {used:6} B" for name, used in use.items()) + "\n"
        )
    sys.stdout.write(f"protocol 0x{PROTOCOL_HASH:08x}, in {folder}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
