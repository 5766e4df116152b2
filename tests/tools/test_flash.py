"""What is written into a board, and by what; no programmer is at hand, so the commands are looked at."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError
from tests.tools.board_images import DAC, write_images, write_own_board
from tools import flash
from tools.boards import FOLDER, read_boards, released
from tools.flash import CODE_ADDRESS, VECTORS_ADDRESS, Piece, commands
from tools.record import RECORD_ADDRESS, SECTOR_BYTES, RecordLink, image, record
from tools.rig_record import record_of

if TYPE_CHECKING:
    from pathlib import Path

PWM = "bench_f405_pwm"
BOARDS = read_boards()
LINK_AT, BAUD_AT, ZERO_AT, FULL_AT = 44, 48, 52, 56


def word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 4], "little")


@pytest.fixture
def built(tmp_path: Path) -> Path:
    write_images(tmp_path)
    return tmp_path


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["flash", *arguments])
    return flash.main()


@pytest.mark.parametrize(
    ("rig", "sets", "link", "baud"),
    [
        ("bench-serial", ["backend.baud=500000"], RecordLink.cobs, 500_000),
        ("bench-can", [], RecordLink.can, 1_000_000),
        ("bench-can", ["backend.interface=slcan", "backend.channel=/dev/x"], RecordLink.slcan, 1_000_000),
    ],
)
def test_record_is_that_of_the_rig(rig: str, sets: list[str], link: RecordLink, baud: int) -> None:
    made = record_of(load_rig(rig, sets), BOARDS[DAC], zero_code=2050, full_scale_V=12.0)
    assert (word(made, LINK_AT), word(made, BAUD_AT)) == (link, baud)
    assert (word(made, ZERO_AT), word(made, FULL_AT)) == (2050, 12_000)


def test_record_refuses_what_the_board_cannot_put_out() -> None:
    with pytest.raises(ConfigError, match=r"got 10; expected 5 V or less.*--full-scale-V"):
        record_of(load_rig("bench-serial"), BOARDS[DAC], zero_code=2048, full_scale_V=5.0)


def test_record_refuses_a_rig_without_a_device() -> None:
    with pytest.raises(ConfigError, match="a board is at serial or can"):
        record_of(load_rig("bench-1khz"), BOARDS[DAC], zero_code=2048, full_scale_V=10.0)


def test_pwm_board_is_given_the_supply_that_was_said_and_that_the_rig_has() -> None:
    rig = load_rig("bench-serial", ["amplifier.supply_V=24"])
    assert word(record_of(rig, BOARDS[PWM], supply_V=24.0), FULL_AT) == 24_000


@pytest.mark.parametrize(
    ("board", "rig", "said", "words"),
    [
        (PWM, [], {}, r"--supply-V: got None; .*Measure the supply.*--supply-V 24"),
        (PWM, [], {"supply_V": 0.0}, r"--supply-V: got 0\.0"),
        (PWM, [], {"supply_V": float("nan")}, r"--supply-V: got nan"),
        (PWM, [], {"supply_V": 24.0}, r"amplifier\.supply_V: the rig says none, --supply-V 24\. Write"),
        (PWM, ["amplifier.supply_V=12"], {"supply_V": 24.0}, r"the rig says 12.*, --supply-V 24"),
        (PWM, [], {"full_scale_V": 10.0}, r"--full-scale-V: .*Say --supply-V"),
        (DAC, [], {"supply_V": 24.0}, r"--supply-V: bench_f405_dac divides no supply"),
        (DAC, ["amplifier.supply_V=24"], {}, r"amplifier\.supply_V: bench_f405_dac divides no supply"),
    ],
)
def test_supply_that_is_not_known_or_not_the_rigs_is_refused(
    board: str, rig: list[str], said: dict[str, float], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        record_of(load_rig("bench-serial", rig), BOARDS[board], **said)  # type: ignore[arg-type]


@pytest.mark.parametrize("board", released(read_boards()))
def test_every_board_that_is_released_can_be_flashed(
    board: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_images(tmp_path, board, FOLDER / board / "board.h")
    options = ("bench-serial", "--firmware", str(tmp_path), "--only", "record", "--dry-run")
    supply = ("--set", "amplifier.supply_V=24", "--supply-V", "24") if board in pwm_boards() else ()
    assert run(monkeypatch, board, *options, *supply) == 0


def pwm_boards() -> list[str]:
    return [name for name, board in read_boards().items() if board.amplifier == "pwm"]


def test_board_with_a_program_of_its_own_cannot_be_flashed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch, "qemu_f405", "bench-serial", "--dry-run")
    assert "invalid choice: 'qemu_f405'" in capsys.readouterr().err


def test_pwm_board_without_its_supply_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_images(tmp_path, PWM, FOLDER / PWM / "board.h")
    options = ("--firmware", str(tmp_path), "--only", "record", "--dry-run")
    assert run(monkeypatch, PWM, "bench-serial", *options) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: --supply-V: ")


def test_record_fills_its_two_sectors_and_no_more() -> None:
    made = image(record_of(load_rig("bench-serial"), BOARDS[DAC], zero_code=2048, full_scale_V=10.0))
    assert RECORD_ADDRESS + len(made) == CODE_ADDRESS
    assert len(made) == 2 * SECTOR_BYTES
    assert set(made[SECTOR_BYTES:]) == {0xFF}  # older records are gone with it


def test_commands_write_every_piece_at_its_address(tmp_path: Path) -> None:
    pieces = [Piece(tmp_path / "a.bin", CODE_ADDRESS), Piece(tmp_path / "b.bin", VECTORS_ADDRESS)]
    serial = commands("stm32flash", pieces, "/dev/ttyUSB7")
    assert [command[-2:] for command in serial] == [
        ["0x800c000", "/dev/ttyUSB7"], ["0x8000000", "/dev/ttyUSB7"], ["0x8000000", "/dev/ttyUSB7"],
    ]  # fmt: skip
    assert "-v" in serial[0]
    assert "-g" in serial[-1]
    probe = commands("pyocd", pieces, "")
    assert [command[-2:] for command in probe] == [
        ["0x800c000", str(tmp_path / "a.bin")],
        ["0x8000000", str(tmp_path / "b.bin")],
    ]


def test_dry_run_shows_what_would_be_done(
    built: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, DAC, "bench-serial", "--firmware", str(built), "--dry-run") == 0
    said = capsys.readouterr().out
    assert [line.split(" -S ")[-1].split()[0] for line in said.splitlines()[:4]] == [
        "0x1fffc000:4", "0x8004000", "0x800c000", "0x8000000",
    ]  # fmt: skip


# ----------------------------------------------------------------- the image is that of today's board.h


def test_board_of_another_folder_is_flashed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_images(tmp_path, "mine", write_own_board(tmp_path / "boards"))
    folders = ("--boards", str(tmp_path / "boards"), "--firmware", str(tmp_path))
    assert run(monkeypatch, *folders, "mine", "bench-serial", "--dry-run") == 0
    assert f"-w {tmp_path}/mine.code.bin" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch, "mine", "bench-serial", "--dry-run")
    assert "invalid choice: 'mine'" in capsys.readouterr().err


def test_image_of_another_board_h_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    boards = tmp_path / "my boards"
    data = write_own_board(boards)
    write_images(tmp_path, "mine", data)
    data.write_text(data.read_text("utf-8").replace("ENABLE PB15", "ENABLE PC4"), "utf-8")
    folders = ("--boards", str(boards), "--firmware", str(tmp_path))
    assert run(monkeypatch, *folders, "mine", "bench-serial", "--dry-run") == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"error: {data}: mine.code.bin was built of another board.h")
    assert said.err.endswith(f"anew: `python -m tools.artefact {tmp_path} --boards '{boards}'`.\n")


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        (f"{DAC}.vectors.bin", "other", f"{DAC}.vectors.bin: it is not the one that manifest.json says."),
        (f"{DAC}.code.bin", "other", f"{DAC}.code.bin: it is not the one that manifest.json says."),
        ("manifest.json", None, f"manifest.json: it does not say of what {DAC} was built."),
        ("manifest.json", "{", f"manifest.json: it does not say of what {DAC} was built."),
        ("manifest.json", "[]", f"manifest.json: it does not say of what {DAC} was built."),
        ("manifest.json", '{"boards": {}}', f"manifest.json: it does not say of what {DAC} was built."),
        (
            "manifest.json",
            json.dumps({"boards": {DAC: {"sha256": {}}}}),  # as older ones are
            f"{DAC}.code.bin was built of another board.h",
        ),
    ],
)
def test_image_that_the_manifest_does_not_know_is_refused(
    built: Path,
    file: str,
    text: str | None,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (built / file).unlink()
    if text is not None:
        (built / file).write_text(text)
    assert run(monkeypatch, DAC, "bench-serial", "--firmware", str(built), "--dry-run") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert line.endswith(f"Build it anew: `python -m tools.artefact {built}`.")


@pytest.mark.parametrize(("text", "said"), [(None, "no board is in"), ("", "mine/board.h: 'NUMBER'. Build")])
def test_folder_without_a_board_is_one_line(
    tmp_path: Path,
    text: str | None,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if text is not None:
        write_own_board(tmp_path).write_text(text)
    assert run(monkeypatch, "mine", "bench-serial", "--boards", str(tmp_path), "--dry-run") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: --boards: ")
    assert said in line


# -------------------------------------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["bench-serial", "--firmware", "nowhere"], 2, "make firmware"),
        (["bench-1khz"], 2, "Start from bench-serial"),
        (["bench-serial", "--only", "record", "--firmware", "nowhere"], 3, "no cmake here, which checks"),
        (["bench-serial", "--only", "brown-out", "--by", "pyocd"], 3, "pip install pyocd"),
    ],
)
def test_mistake_is_one_line_with_its_remedy(
    arguments: list[str],
    code: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PATH", "")
    assert run(monkeypatch, DAC, *arguments) == code
    assert said in capsys.readouterr().err


def test_programmer_that_fails_ends_it(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = tmp_path / "stm32flash"
    tool.write_text("#!/bin/sh\nexit 1\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    assert run(monkeypatch, DAC, "bench-serial", "--firmware", str(built)) == 3
    said = capsys.readouterr()
    assert "BOOT0" in said.err
    assert len(said.out.splitlines()) == 1  # the next piece is not tried


def test_record_says_how_old_it_is() -> None:
    made = record(
        {
            "counts_per_rev": 1, "period_us": 2, "voltage_limit_mV": 3, "slew_mV_per_ms": 4, "watchdog_ms": 5,
            "speed_limit_counts_s": 6, "travel_limit_counts": 7, "node": 8,
        },
        boot_count=9, sequence=10,
    )  # fmt: skip
    assert (word(made, 4), word(made, 8)) == (10, 9)
