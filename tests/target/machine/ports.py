"""USART 1, the DAC, and CAN 1."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from tests.target.machine.block import Block

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.target.machine.system import System

Frame = tuple[int, bytes]


class Usart(Block):
    """USART 1 at the rate that its registers say; the world talks at its own."""

    NAME = "USART1"
    CLOCK: tuple[str, int] | None = ("APB2ENR", 4)
    IRQ = 37

    def __init__(self, system: System) -> None:
        self.baud = 1e6  # the world's
        super().__init__(system)

    def reset(self) -> None:
        """Clear the receiver and the transmitter."""
        super().reset()
        self.now["SR"] = 0xC0
        self._coming: deque[int] = deque()
        self.sent = bytearray()
        self._receiving, self._sending = False, False
        self._data = 0

    def _byte_us(self) -> float:
        rate = self.system.rcc.bus_Hz(2) / max(self.now["BRR"], 1)
        return 10e6 / rate

    def _is_well_paced(self) -> bool:
        return abs(self._byte_us() * self.baud / 10e6 - 1) < 0.02

    def hear(self, data: bytes) -> None:
        """Receive bytes, one after the other."""
        self._coming.extend(data)
        if not self._receiving and self._coming:
            self._receiving = True
            self.system.after(10e6 / self.baud, self._arrive)

    def _arrive(self) -> None:
        byte = self._coming.popleft()
        led = self.system.wires.leads("SERIAL_RX")
        on = led and self.flag("CR1", 13) and self.flag("CR1", 2) and self.is_clocked()
        if on:
            if self.flag("SR", 5):
                self.raise_flag("SR", 3)  # overrun: the one before was not read
            else:
                self._data = byte if self._is_well_paced() else byte ^ 0x55
                self.raise_flag("SR", 5)
            self._tell()
        self._receiving = bool(self._coming)
        if self._receiving:
            self.system.after(10e6 / self.baud, self._arrive)

    def is_pending(self) -> bool:
        """Whether its interrupt line is up."""
        status, control = self.now["SR"], self.now["CR1"]
        return bool((status & 0x28 and control & 0x20) or (status & 0x80 and control & 0x80))

    def _tell(self) -> None:
        if self.is_pending():
            self.system.cpu.line(self.IRQ, self.is_pending)

    def read_DR(self) -> int:  # noqa: N802
        """Return the received byte, and clear the error flags."""
        self.drop_flag("SR", 0, 1, 2, 3, 5)
        return self._data

    def write_DR(self, value: int, _: int) -> int:  # noqa: N802
        """Send a byte."""
        if not self.flag("SR", 7):
            self.misuse("DR is written before TXE")
        if self.system.wires.leads("SERIAL_TX") and self.flag("CR1", 13) and self.flag("CR1", 3):
            self.drop_flag("SR", 7)
            self.system.after(self._byte_us(), lambda: self._gone(value))
        return 0

    def _gone(self, value: int) -> None:
        self.sent.append(value & 0xFF)
        self.raise_flag("SR", 7)
        self._tell()

    def write_CR1(self, value: int, _: int) -> int:  # noqa: N802
        """Switch on, choose interrupts."""
        self.now["CR1"] = value
        if value >> 13 & 1 and not self._is_well_paced():
            self.misuse(f"{10e6 / self._byte_us():.0f} baud")
        self._tell()
        return value


class Dac(Block):
    """Channel 1 of the DAC."""

    NAME = "DAC"
    CLOCK: tuple[str, int] | None = ("APB1ENR", 29)

    def code(self) -> int | None:
        """Return what is on its pin; None where nothing is."""
        on = self.flag("CR", 0) and self.is_clocked() and self.system.wires.is_analog("DAC")
        return self.now["DHR12R1"] if on else None

    def write_DHR12R1(self, value: int, _: int) -> int:  # noqa: N802
        """Convert the value to a voltage."""
        self.now["DHR12R1"] = value
        self.system.look_at_pins()
        return value

    def write_CR(self, value: int, _: int) -> int:  # noqa: N802
        """Switch the block on."""
        self.now["CR"] = value
        if value & 1 and not self.system.wires.is_analog("DAC"):
            self.misuse("it is switched on while its pin is not analog")
        self.system.look_at_pins()
        return value


class Can(Block):
    """bxCAN: initialisation, filters by lists, three mailboxes, a FIFO of three, error states."""

    NAME = "CAN1"
    CLOCK: tuple[str, int] | None = ("APB1ENR", 25)
    TX, RX0, SCE = 19, 20, 22

    def __init__(self, system: System) -> None:
        self.on_sent: Callable[[Frame], bool] = lambda _: True  # the bus; False: no acknowledge
        super().__init__(system)

    def reset(self) -> None:
        """Put the block into sleep mode."""
        super().reset()
        self._fifo: deque[Frame] = deque()
        self._queue: list[int] = []
        self._busy = False

    def _name(self, box: int, part: str) -> str:
        return {"I": f"TI{box}R", "DT": f"TDT{box}R", "L": f"TDL{box}R", "H": f"TDH{box}R"}[part]

    def write_MCR(self, value: int, before: int) -> int:  # noqa: N802
        """Enter and leave initialisation."""
        wanted, sleeps = value & 1, value >> 1 & 1
        self.now["MCR"] = value

        def answer() -> None:
            (self.raise_flag if sleeps else self.drop_flag)("MSR", 1)
            (self.raise_flag if wanted else self.drop_flag)("MSR", 0)

        if (value ^ before) & 3:
            self.system.after(12.0, answer)
        return value

    def write_BTR(self, value: int, before: int) -> int:  # noqa: N802
        """Set the bit rate."""
        if not self.flag("MSR", 0):
            self.misuse("BTR is written outside initialisation")
            return before
        quanta = 3 + (value >> 16 & 0xF) + (value >> 20 & 7)
        rate = self.system.rcc.bus_Hz(1) / ((value & 0x3FF) + 1) / quanta
        if abs(rate / 1e6 - 1) > 0.001:
            self.misuse(f"{rate:.0f} bit/s")
        sampled = (2 + (value >> 16 & 0xF)) / quanta
        if not 0.7 <= sampled <= 0.9:
            self.misuse(f"sampled at {sampled:.0%}")
        return value

    def _passes(self, number: int) -> bool:
        if self.flag("FMR", 0):
            return False
        for bank in range(28):
            if not self.flag("FA1R", bank):
                continue
            if not self.flag("FM1R", bank) or self.flag("FS1R", bank):
                self.misuse("a filter that this model does not know: it knows lists of 16 bits")
            for register in ("1", "2"):
                word = self.now[f"F{bank}R{register}"]
                if number << 5 in (word & 0xFFFF, word >> 16):
                    return True
        return False

    def store(self, offset: int, size: int, value: int) -> None:
        """Let the firmware write; filters only while they are open."""
        register = self.registers.get(offset)
        name = register.name if register else ""
        if name in ("FM1R", "FS1R", "FFA1R") or (name[:1] == "F" and name[1:2].isdigit()):
            bank = int(name[1:].split("R")[0]) if name[1:2].isdigit() else None
            if not self.flag("FMR", 0) and (bank is None or self.flag("FA1R", bank)):
                self.misuse(f"{name} is written while the filters are in use")
        super().store(offset, size, value)
        if len(name) == 4 and name[:2] == "TI" and value & 1:
            self._request(int(name[2]))

    # ------------------------------------------------------------------------------- transmission

    def _request(self, box: int) -> None:
        if not self.flag("TSR", 26 + box):
            self.misuse(f"mailbox {box} is written while it is full")
        self.drop_flag("TSR", 26 + box)
        self._queue.append(box)
        self._next()

    def _next(self) -> None:
        if self._busy or not self._queue or self.flag("ESR", 2) or self.now["MSR"] & 3:
            return
        box = self._queue[0] if self.flag("MCR", 2) else min(self._queue)
        self._busy = True
        length = self.now[f"TDT{box}R"] & 0xF
        self.system.after(55.0 + 9.4 * length, lambda: self._sent(box))

    def _sent(self, box: int) -> None:
        self._busy = False
        if box not in self._queue:
            return
        data = self.now[f"TDL{box}R"].to_bytes(4, "little") + self.now[f"TDH{box}R"].to_bytes(4, "little")
        frame = (self.now[f"TI{box}R"] >> 21, data[: self.now[f"TDT{box}R"] & 0xF])
        led = self.system.wires.leads("CAN_RX") and self.system.wires.leads("CAN_TX")
        if led and self.on_sent(frame):
            self._empty(box, well=True)
        self._next()

    def _empty(self, box: int, *, well: bool) -> None:
        self._queue.remove(box)
        self.raise_flag("TSR", 26 + box, 8 * box)
        (self.raise_flag if well else self.drop_flag)("TSR", 8 * box + 1)
        if self.flag("IER", 0):
            self.system.cpu.line(self.TX, lambda: bool(self.now["TSR"] & 0x10101 and self.flag("IER", 0)))

    def write_TSR(self, value: int, before: int) -> int:  # noqa: N802
        """Take note of what was sent; give up what was not."""
        self.now["TSR"] = before
        for box in range(3):
            if value >> (8 * box) & 1:
                self.drop_flag("TSR", *range(8 * box, 8 * box + 4))
            if value >> (8 * box + 7) & 1 and box in self._queue:
                self._empty(box, well=False)
        return self.now["TSR"]

    # ---------------------------------------------------------------------------------- reception

    def hear(self, frame: Frame) -> None:
        """Let a frame come in."""
        if self.now["MSR"] & 3 or self.flag("ESR", 2) or not self.is_clocked() or not self._passes(frame[0]):
            return
        if len(self._fifo) == 3:
            self.raise_flag("RF0R", 4)
            return
        self._fifo.append(frame)
        self._show()

    def _show(self) -> None:
        self.now["RF0R"] = (self.now["RF0R"] & ~3) | len(self._fifo)
        if not self._fifo:
            return
        number, data = self._fifo[0]
        padded = data.ljust(8, b"\0")
        self.now["RI0R"], self.now["RDT0R"] = number << 21, len(data)
        self.now["RDL0R"] = int.from_bytes(padded[:4], "little")
        self.now["RDH0R"] = int.from_bytes(padded[4:], "little")
        if self.flag("IER", 1):
            self.system.cpu.line(self.RX0, lambda: bool(self._fifo) and self.flag("IER", 1))

    def write_RF0R(self, value: int, before: int) -> int:  # noqa: N802
        """Release a frame, take note of an overrun."""
        self.now["RF0R"] = before & ~(value & 0x18)
        if value >> 5 & 1 and self._fifo:
            self._fifo.popleft()
        self._show()
        return self.now["RF0R"]

    # ------------------------------------------------------------------------------------- errors

    def write_MSR(self, value: int, before: int) -> int:  # noqa: N802
        """Take note of interrupts."""
        return before & ~(value & 0x1C)

    def go_bus_off(self, us: float) -> None:
        """Let the errors count up to bus-off, and back on the bus after so long."""
        self.raise_flag("ESR", 0, 1, 2)
        if self.flag("IER", 10) and self.flag("IER", 15):
            self.raise_flag("MSR", 2)
            self.system.cpu.line(self.SCE, lambda: self.flag("MSR", 2))
        if not self.flag("MCR", 6):
            return  # ABOM: without it only software brings it back

        def recover() -> None:
            self.drop_flag("ESR", 0, 1, 2)
            self._next()

        self.system.after(max(us, 128 * 11.0), recover)
