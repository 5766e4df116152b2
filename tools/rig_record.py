"""The record of a board that fits a rig: limits, link and scale, as `tools.flash` writes it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from sim_backend.board.config import board_config
from tools.record import RecordLink, record

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from tools.boards import Board

_DAC_FULL_SCALE_V = 10.0  # V, full scale unless it is said
_SUPPLY_RANGE_V = (1.0, 100.0)  # V


def record_of(
    rig: Rig,
    board: Board,
    *,
    zero_code: int = 2048,
    full_scale_V: float | None = None,
    supply_V: float | None = None,
) -> bytes:
    """Return the record of a board that fits a rig.

    Parameters
    ----------
    zero_code
        The DAC's code at which the amplifier puts out 0 V.
    full_scale_V
        V, that 2048 codes of a DAC more put out; None is 10.
    supply_V
        V, the motor's supply, of which a PWM board puts out a part. No other board has it, and no rig's key
        `amplifier.supply_V` may say otherwise.

    Raises
    ------
    ConfigError
        If the rig is not one for a device, asks for more than the board can put out, or the supply is not
        known or not the rig's.
    """
    kind = rig.backend.kind
    if kind not in ("serial", "can"):
        raise ConfigError(
            f"backend.kind: got {kind!r}; a board is at serial or can. Start from bench-serial."
        )
    full_scale = _full_scale(rig, board, full_scale_V, supply_V)
    config = board_config(rig, board.number)
    full_scale_mV = round(1e3 * full_scale)
    if config["voltage_limit_mV"] > full_scale_mV:
        raise ConfigError(
            f"amplifier.voltage_limit_V: got {1e-3 * config['voltage_limit_mV']:g}; expected "
            f"{full_scale:g} V or less, the board's full scale. Lower it, or say --full-scale-V."
        )
    slcan = getattr(rig.backend, "interface", "") == "slcan"
    link = RecordLink.cobs if kind == "serial" else RecordLink.slcan if slcan else RecordLink.can
    baud = getattr(rig.backend, "baud", None) or getattr(rig.backend, "tty_baud", None) or 1_000_000
    return record(config, link=link, baud=baud, zero_code=zero_code, full_scale_mV=full_scale_mV)


def _full_scale(rig: Rig, board: Board, full_scale_V: float | None, supply_V: float | None) -> float:
    """Return what the board puts out at most, V: of a PWM board it is the supply, and nothing is assumed."""
    rig_supply = rig.amplifier.supply_V
    if board.amplifier != "pwm":
        if supply_V is not None or rig_supply != "none":
            where = "--supply-V" if supply_V is not None else "amplifier.supply_V"
            raise ConfigError(f"{where}: {board.name} divides no supply. Leave it out; see --full-scale-V.")
        return _DAC_FULL_SCALE_V if full_scale_V is None else full_scale_V
    if full_scale_V is not None:
        raise ConfigError(
            f"--full-scale-V: the full scale of {board.name} is the motor's supply. Say --supply-V."
        )
    if supply_V is None or not _SUPPLY_RANGE_V[0] <= supply_V <= _SUPPLY_RANGE_V[1]:
        raise ConfigError(
            f"--supply-V: got {supply_V}; {board.name} puts out a part of the motor's supply, and every "
            "limit is wrong by the factor by which this number is. Measure the supply, and say it: "
            "--supply-V 24."
        )
    if rig_supply != supply_V:
        raise ConfigError(
            f"amplifier.supply_V: the rig says {rig_supply}, --supply-V {supply_V:g}. Write the measured one "
            "into the rig: every run compares it with the board."
        )
    return supply_V
