"""The firmware's own C core in this process, with the simulated plant on its pins, in virtual time."""

from __future__ import annotations

import ctypes
import struct
from typing import TYPE_CHECKING

from sim_backend.board import hostlib
from sim_backend.board.config import LAYOUT, SIMULATED, board_config
from sim_backend.board.plant_io import PlantIO

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.values import Truth

_UINT32_MAX = 0xFFFF_FFFF
_RESET_PIN_CAUSE = 2  # the parameter RESET_CAUSE
_VOLTAGE, _LENGTH = hostlib.VOLTAGE, hostlib.OUT_LENGTH  # wanted in every period


class Board:
    """A device whose time passes when it is told to tick.

    Parameters
    ----------
    rig
        Its `[sim]`, `[model]`, `[encoder]`, `[amplifier]` and `[loop]` tables; it is wired as they say.
    carrier
        `cobs` or `slcan` for bytes, `can` for frames.
    count_offset
        Counts, what the encoder shows where the arm is at 0 rad.
    start_us
        us, of the device's clock at boot.
    first_tick
        Number of the first period.

    Raises
    ------
    OpenError
        If the firmware cannot be compiled.
    ConfigError
        If no device can be what the rig says.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        carrier: str = "cobs",
        count_offset: int = 0,
        start_us: int = 0,
        first_tick: int = 0,
    ) -> None:
        self._lib = lib = hostlib.load()
        self._config = board_config(rig, SIMULATED)
        self._carrier = hostlib.CARRIERS[carrier]
        self._memory = (ctypes.c_int64 * (lib.hostlib_size() // 8 + 1))()
        self._at = ctypes.c_void_p(ctypes.addressof(self._memory))
        self._bytes = memoryview(self._memory).cast("B")
        self._view = self._bytes[: 4 * (hostlib.OUT_OFFSET + 1)].cast("i")
        self.pins = PlantIO(rig, count_offset)
        self._period_us = self._config["period_us"]
        self.now_us = start_us & _UINT32_MAX
        self.tick_count = 0
        self._c_tick, self._c_receive = lib.hostlib_tick, lib.hostlib_receive  # the two of every period
        self._boot(first_tick)
        self._out_at = self._view[hostlib.OUT_OFFSET]

    def tick(self) -> None:
        """Simulate one period: the held output moves the plant, then the firmware runs its tick."""
        if self.tick_count:
            self.pins.advance(self._view[_VOLTAGE])
            self.now_us = (self.now_us + self._period_us) & _UINT32_MAX
        self.tick_count += 1
        self._c_tick(self._at, self.now_us, self.pins.count())

    def receive(self, data: bytes) -> None:
        """Pass bytes to the device, between two ticks."""
        self._c_receive(self._at, data, len(data), self.now_us)

    def transmit(self) -> bytes:
        """Return the bytes that the device has sent."""
        return self._sent() if self._view[_LENGTH] else b""

    def receive_frame(self, number: int, data: bytes) -> None:
        """Pass a frame to the device, between two ticks, on any carrier."""
        self._lib.hostlib_receive_frame(self._at, number, data, len(data), self.now_us)

    def transmit_frames(self) -> list[tuple[int, bytes]]:
        """Return the frames that the device has sent; its carrier must be `can`."""
        if not self._view[_LENGTH]:
            return []
        records = struct.iter_unpack(hostlib.RECORD, self._sent())
        return [(number, data[:length]) for number, length, data in records]

    def advance(self, microseconds: int) -> None:
        """Advance time within a period; the watchdog is checked."""
        self.now_us = (self.now_us + microseconds) & _UINT32_MAX
        self._lib.hostlib_look(self._at, self.now_us)

    def link(self, *, up: bool) -> None:
        """Plug or unplug the line; what is sent into an unplugged one is lost."""
        self._lib.hostlib_link(self._at, up, self.now_us)

    def reset(self) -> None:
        """Reset the device, as a finger on its button does; the plant goes on as it was."""
        self._config["boot_count"] += 1
        self._config["reset_cause"] = _RESET_PIN_CAUSE
        self._boot(0)

    def truth(self) -> Truth:
        """Return the true state at the last tick."""
        return self.pins.truth

    @property
    def applied_mV(self) -> int:
        """Voltage command of the amplifier at present, mV."""
        return self._view[hostlib.VOLTAGE]

    @property
    def enable(self) -> bool:
        """Whether the amplifier is switched on."""
        return self._view[hostlib.ENABLE] != 0

    @property
    def state(self) -> int:
        """State of the device, as in SAMPLE."""
        return self._view[hostlib.STATE]

    @property
    def fault(self) -> int:
        """Code of the fault that is latched, or was the last."""
        return self._view[hostlib.FAULT]

    @property
    def owner(self) -> int:
        """Session that owns the device; 0 for none."""
        return self._view[hostlib.OWNER]

    def _sent(self) -> bytes:
        length, self._view[_LENGTH] = self._view[_LENGTH], 0
        return bytes(self._bytes[self._out_at : self._out_at + length])

    def _boot(self, first_tick: int) -> None:
        config = LAYOUT.pack(*self._config.values())
        arguments = (config, self._carrier, self.now_us, first_tick & _UINT32_MAX)
        if not self._lib.hostlib_init(self._at, *arguments):
            raise AssertionError(f"the firmware refuses {self._config}")
