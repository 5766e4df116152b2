"""The data of a board: what the chip or the build cannot do is refused, with a remedy."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from tests.target.board_files import PWM_PINS, check, said_by, write_board, write_pwm_board
from tests.target.build import FIRMWARE
from tools.boards import FOLDER

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        (
            "BOARD_CAN_RX PB8",
            "BOARD_CAN_RX PC4",
            "BOARD_CAN_RX is PC4, which has no such function. Choose one of PA11, PB8.",
        ),
        (
            "BOARD_ENABLE PB15",
            "BOARD_ENABLE PB8",
            "BOARD_ENABLE and BOARD_CAN_RX are both PB8. Choose another pin for one of them",
        ),
        (
            "BOARD_ENABLE PB15",
            "BOARD_ENABLE PA13",
            "BOARD_ENABLE is PA13, a pin of the debug probe. Choose another pin",
        ),
        *(
            (
                "BOARD_ENABLE PB15",
                f"BOARD_ENABLE {pin}",
                f"BOARD_ENABLE is {pin}, which may be high in a reset or while firmware is loaded",
            )
            for pin in ("PA15", "PB4", "PB10")
        ),
        ("BOARD_ENABLE PB15", "BOARD_ENABLE PB16", "BOARD_ENABLE is PB16. Write a pin from PA0 to PG15"),
        ("BOARD_ENABLE PB15", "BOARD_ENABLE", "BOARD_ENABLE is . Write a pin from PA0 to PG15"),
        (
            "BOARD_CRYSTAL_HZ 8000000u",
            "BOARD_CRYSTAL_HZ 48000000u",
            "BOARD_CRYSTAL_HZ is 48000000. Write a number from 4000000 to 26000000",
        ),
        (
            "BOARD_CRYSTAL_HZ 8000000u",
            "BOARD_CRYSTAL_HZ 11059200u",
            "The PLL needs a multiple of 2000000: another crystal",
        ),
        (
            "BOARD_FLASH_KIB 1024u",
            "BOARD_FLASH_KIB 2048u",
            "BOARD_FLASH_KIB is 2048. Write a number from 128 to 1024",
        ),
        ("BOARD_RAM_KIB 128u", "BOARD_RAM_KIB 192u", "BOARD_RAM_KIB is 192. Write a number from 16 to 128"),
        *(
            (
                "BOARD_NUMBER 199",
                f"BOARD_NUMBER {number}",
                f"BOARD_NUMBER is {number}. Write a number from 128 to 2147483647. Those before are",
            )
            for number in ("0", "6", "127", "0x63", "2147483648")
        ),
        *(
            (
                "BOARD_PACKAGE_PINS 64u",
                f"BOARD_PACKAGE_PINS {pins}",
                f"BOARD_PACKAGE_PINS is {pins}. Write the number of pins that the chip on the board has",
            )
            for pins in ("65", "LQFP64")
        ),
        (
            "BOARD_CAN_RX PB8",
            "BOARD_CAN_RX PD0",
            "the package with 64 pins does not bond. Choose another pin, one of PA11, PB8, or correct BOAR",
        ),
        (
            "BOARD_ENABLE PB15",
            "BOARD_ENABLE PE3",
            "BOARD_ENABLE is PE3, which the package with 64 pins does not bond. Choose another pin, or corr",
        ),
        ("#define BOARD_CAN_TX PB9\n", "", "there is no BOARD_CAN_TX. Write `#define BOARD_CAN_TX ...`"),
        (
            "#define BOARD_DAC PA4\n",
            "",
            "the amplifier is not known. Write either BOARD_DAC, or BOARD_PWM with",
        ),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n#define BOARD_PWM PA8\n", "the amplifier is not known"),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC PA4\n#define BOARD_LED PC13\n",
            "BOARD_LED has no meaning on this board. Remove it",
        ),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC PA4\n#define BOARD_DAC PA4\n",
            "BOARD_DAC is there twice. Leave one of them",
        ),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC (PA4)\n",
            "Write `#define BOARD_KEY VALUE`, a number or a pin such as PB15",
        ),
    ],
)
def test_wrong_data_are_refused_with_a_remedy(tmp_path: Path, line: str, other: str, said: str) -> None:
    done = check(FOLDER / "bench_f405_pwm", write_board(tmp_path, {line: other}))
    assert said in said_by(done)
    assert "other/board.h" in done.stderr.replace("\n", "").replace(" ", "")


@pytest.mark.parametrize(
    ("package", "bonded", "missing"),
    [
        (64, ["PB11", "PC13", "PD2"], ["PD0", "PD3", "PE15", "PF0", "PG15"]),
        (90, ["PC6", "PD12", "PD14", "PE7", "PE15"], ["PC1", "PC4", "PC5", "PD3", "PD13", "PE6", "PF0"]),
        (100, ["PD15", "PE0", "PE15"], ["PF0", "PG15"]),
        (144, ["PF0", "PG15"], []),
    ],
)
def test_every_package_bonds_its_pins_and_no_others(
    tmp_path: Path, package: int, bonded: list[str], missing: list[str]
) -> None:
    for pin in (*bonded, *missing):
        changes = {"BOARD_PACKAGE_PINS 64u": f"BOARD_PACKAGE_PINS {package}u"}
        key = "DIRECTION" if pin == "PB11" else "ENABLE"  # where a pull-up does not matter
        folder = write_pwm_board(tmp_path, {**changes, PWM_PINS[key]: f"BOARD_{key} {pin}"}, f"with_{pin}")
        done = check(folder)
        if pin in bonded:
            assert done.returncode == 0, done.stderr
        else:
            assert f"{pin}, which the package with {package} pins does not bond" in said_by(done)


def test_break_that_the_package_does_not_bond_is_refused(tmp_path: Path) -> None:
    changes = {PWM_PINS["BREAK"]: "BOARD_BREAK PE15"}
    said = said_by(check(write_pwm_board(tmp_path, changes, "small")))
    assert "PE15, which the package with 64 pins does not bond. Choose another pin, one of PA6, PB12," in said
    assert check(write_pwm_board(tmp_path, {**changes, "PINS 64u": "PINS 100u"}, "large")).returncode == 0


# ----------------------------------------------------------------------------------- numbers and names


def test_number_is_of_one_board_only(tmp_path: Path) -> None:
    done = check(*(write_board(tmp_path, {}, name) for name in ("one", "two")))
    assert "two/board.h: BOARD_NUMBER 199 is another board's. The numbers 1, 2, 199 are taken" in said_by(
        done
    )


@pytest.mark.parametrize(
    ("number", "said"),
    [
        ("6", ""),
        ("127", ""),
        ("2", "BOARD_NUMBER 2 is another board's"),
        ("5", "BOARD_NUMBER 5 is another board's. The numbers 1, 2, 5 are taken: choose one that is free"),
        ("128", "BOARD_NUMBER is 128. Write a number from 1 to 127. Those behind are for boards outside of"),
    ],
)
def test_boards_of_the_repository_have_its_numbers(tmp_path: Path, number: str, said: str) -> None:
    """The same files elsewhere are a repository of their own."""
    for part in ("cmake", "soc", "boards/bench_f405_pwm"):
        shutil.copytree(FIRMWARE / part, tmp_path / part)
    new = write_board(tmp_path / "boards", {"BOARD_NUMBER 199": f"BOARD_NUMBER {number}"})
    done = check(tmp_path / "boards/bench_f405_pwm", new, firmware=tmp_path)
    if said:
        assert said in said_by(done)
    else:
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", ["left-hand", "2nd", "left.hand", "left hand"])
def test_name_that_cannot_be_a_programs_is_refused(tmp_path: Path, name: str) -> None:
    said = said_by(check(write_board(tmp_path, {}, name)))
    assert f"{name} cannot be a board's name. Rename the folder: a letter first, then letters, digits" in said


# -------------------------------------------------------------------------------- what is in a board.h


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n#undef BOARD_DAC\n", "`#undef BOARD_DAC` is not data. Remove it"),
        (
            "#define BOARD_DAC PA4\n",
            "#if 1\n#define BOARD_DAC PA4\n#endif\n",
            "`#if 1` is not data. Remove it",
        ),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n#define PB15 PC4\n", "`#define PB15 PC4` is not data"),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n#include <stdint.h>\n", "`#include <stdint.h>` is not data"),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n // and more\n", "` // and more` is not data"),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n# undef BOARD_DAC\n", "`# undef BOARD_DAC` is not data"),
        ("BOARD_DAC PA4\n", "BOARD_DAC \\\nPA4\n", "Write each #define in one line"),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4;\n", "there is a semicolon in it. Remove it"),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4 /* by DAC\n", "a comment has no end. Write */ behind it"),
        ("#ifndef BOARD_H\n", "", "there is no include guard. Begin with `#ifndef BOARD_H`"),
        ("#ifndef BOARD_H\n#define BOARD_H\n", "#pragma once\n", "there is no include guard"),
        ("\n#endif\n", "\n#endif\n#define BOARD_LED PC13\n", "there is no include guard"),
        (
            "#define BOARD_DAC PA4\n",
            "/* not here:\n#define BOARD_DAC PA4\n*/\n",
            "the amplifier is not known. Write either BOARD_DAC",
        ),
    ],
)
def test_board_h_is_data_and_no_program(tmp_path: Path, line: str, other: str, said: str) -> None:
    assert said in said_by(check(write_board(tmp_path, {line: other})))


@pytest.mark.parametrize("other", ["BOARD_DAC  PA4 /* pin 20\n#if */\n\n", "BOARD_DAC PA4 \r\n"])
def test_comments_and_blanks_change_nothing(tmp_path: Path, other: str) -> None:
    done = check(write_board(tmp_path, {"BOARD_DAC PA4\n": other}))
    assert done.stdout == "-- other: 199, dac\n", done.stderr
