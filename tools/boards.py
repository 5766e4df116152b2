"""`python -m tools.boards`: write what pages say of the boards: folders of firmware/boards with a board.h.

CMake checks the data of a board (firmware/cmake/boards.cmake); here they are only read.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_ROOT = Path(__file__).resolve().parent.parent
FOLDER = _ROOT / "firmware/boards"
BOARDS_HELP = "a folder with a folder for each board (default: firmware/boards)"
PROTOCOL, README = _ROOT / "docs/protocol.md", _ROOT / "firmware/README.md"
ON_A_PC = {1: "simulated (in process)", 2: "native process"}
"""The numbers of the devices without a chip."""
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_LINE = re.compile(r"^#define BOARD_([A-Z_]+) +(\w+)", re.MULTILINE)
PIN_MEANINGS = {
    "ENABLE": "ENABLE, high; **with a resistor to ground at the amplifier**: after a reset no pin drives it",
    "ENCODER_A": "encoder A (TIM2; pulled up, for open collectors)",
    "ENCODER_B": "encoder B",
    "DAC": "amplifier's input, by DAC: an outer stage makes it bipolar, 0 V near code 2048",
    "PWM": "duty cycle at 20 kHz (TIM1)",
    "DIRECTION": "direction",
    "BREAK": "the bridge's failure line, low",
    "SERIAL_TX": "host on a UART: transmit; 8N1, 1 Mbaud unless the record says otherwise",
    "SERIAL_RX": "host on a UART: receive",
    "CAN_RX": "host on CAN: receive, from a transceiver; 1 Mbit/s",
    "CAN_TX": "host on CAN: transmit",
}
"""What is at a pin, by the key of board.h."""


class Board(NamedTuple):
    """The data of a board."""

    name: str
    number: int  # the parameter BOARD
    package_pins: int
    crystal_Hz: int  # noqa: N815
    flash_KiB: int  # noqa: N815
    ram_KiB: int  # noqa: N815
    pins: Mapping[str, str]  # "ENABLE": "PB15"

    @property
    def amplifier(self) -> str | None:
        """`dac` or `pwm`; None for a board that drives no amplifier, and is not released."""
        return "dac" if "DAC" in self.pins else "pwm" if "PWM" in self.pins else None


def read_boards(folder: Path = FOLDER) -> dict[str, Board]:
    """Return the boards of a folder by name, in the order of their numbers.

    Raises
    ------
    ValueError
        If a board.h lacks a number, or has a word in its place.
    """
    boards = [_read(file) for file in folder.glob("*/board.h")]
    return {board.name: board for board in sorted(boards, key=lambda board: board.number)}


def _read(file: Path) -> Board:
    values = dict(_LINE.findall(_COMMENT.sub(" ", file.read_text("utf-8"))))
    keys = ("NUMBER", "PACKAGE_PINS", "CRYSTAL_HZ", "FLASH_KIB", "RAM_KIB")
    try:
        number, package, crystal, flash, ram = (int(values[key].removesuffix("u")) for key in keys)
    except (KeyError, ValueError) as error:
        raise ValueError(f"{file}: {error}. Build the firmware: CMake says what is missing.") from None
    pins = {key: pin for key, pin in values.items() if re.fullmatch(r"P[A-G]\d+", pin)}
    return Board(file.parent.name, number, package, crystal, flash, ram, pins)


def released(boards: Mapping[str, Board]) -> list[str]:
    """Return the names of the boards that `make firmware` builds for people."""
    return [name for name, board in boards.items() if board.amplifier is not None]


def _numbers(boards: Iterable[Board]) -> str:
    named = ON_A_PC | {board.number: board.name for board in boards}
    rows = [f"| {number} | {name} |" for number, name in sorted(named.items())]
    return "\n".join(["| BOARD | device |", "|---|---|", *rows]) + "\n"


def _pins(boards: Iterable[Board]) -> str:
    shown = [board for board in boards if board.amplifier is not None]
    rows = [
        f"| {what} | {' | '.join(board.pins.get(key, '') for board in shown)} |"
        for key, what in PIN_MEANINGS.items()
    ]
    data = {
        "chip's package, pins": [str(board.package_pins) for board in shown],
        "crystal, MHz": [f"{board.crystal_Hz / 1e6:g}" for board in shown],
        "flash, RAM, KiB": [f"{board.flash_KiB}, {board.ram_KiB}" for board in shown],
        "parameter BOARD": [str(board.number) for board in shown],
    }
    rows += [f"| {what} | {' | '.join(values)} |" for what, values in data.items()]
    head = f"| | {' | '.join(f'`{board.name}`' for board in shown)} |"
    return "\n".join([head, "|---" * (len(shown) + 1) + "|", *rows]) + "\n"


def files(folder: Path = FOLDER) -> dict[Path, str]:
    """Return the pages with their lists of boards."""
    boards = read_boards(folder).values()
    made = {}
    for page, name, part in ((PROTOCOL, "boards", _numbers(boards)), (README, "pins", _pins(boards))):
        before, mark, rest = page.read_text("utf-8").partition(
            f"<!-- {name}: written by tools/boards.py -->\n"
        )
        _, end, after = rest.partition(f"<!-- /{name} -->")
        if not mark or not end:
            raise ValueError(f"{page.name} has no place for {name}, marked by <!-- {name}: ... -->")
        made[page] = f"{before}{mark}\n{part}\n{end}{after}"
    return made


def main() -> None:
    """Write the pages, or with --check say which are not as they should be."""
    stale = {path: text for path, text in files().items() if path.read_text("utf-8") != text}
    if "--check" in sys.argv[1:]:
        for path in stale:
            sys.stdout.write(
                f"{path.relative_to(_ROOT)} is not what the boards say: python -m tools.boards\n"
            )
        sys.exit(bool(stale))
    for path, text in stale.items():
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"wrote {path.relative_to(_ROOT)}\n")


if __name__ == "__main__":
    main()
