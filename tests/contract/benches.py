"""One bench for every way to a device: what the contract suite needs of each."""

from __future__ import annotations

import time
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.device.factory import open_backend
from dcmp_hil.platform.clock import MonotonicClock, SimulatedClock
from sim_backend.board.backend import SimBoardBackend
from sim_backend.board.board import Board
from tests.contract.pump import Port, Pump
from tests.contract.reference_board import ReferenceBoard
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig

IN_PROCESS = (
    *("sim-board cobs", "sim-board slcan", "sim-board can"),
    *("reference cobs", "reference slcan", "reference can"),
)
FAR_ENDS: dict[str, Callable[[], tuple[Port, tuple[str, ...]]]] = {
    name: make
    for file in sorted((Path(__file__).parent / "ports").glob("*.py"))
    for name, make in import_module(f"tests.contract.ports.{file.stem}").BENCHES.items()
}
"""`carrier port` to what makes the port and the keys of `[backend]` that lead to it: one module a port."""
PUMPED = tuple(FAR_ENDS)
WIRED = (*IN_PROCESS, *PUMPED)
ALL = ("sim", *WIRED)


class PatientClock(MonotonicClock):
    """The host's clock a hundred times as slow: what it calls 20 ms is long enough for a busy computer."""

    @staticmethod
    def now_ns() -> int:
        return time.monotonic_ns() // 100


class Bench:
    """A rig with its backend and board.

    Parameters
    ----------
    rig
        With the `[backend]` that leads to the board.
    board
        None for the plain simulated rig.
    make
        Makes a backend: the first host, or a second one.
    pump
        Where there is a thread.
    carrier
        `cobs`, `slcan` or `can`.
    """

    def __init__(
        self,
        rig: Rig,
        make: Callable[[], Backend],
        board: Board | None = None,
        pump: Pump | None = None,
        carrier: str = "",
    ) -> None:
        self.rig, self.make, self.pump, self.carrier = rig, make, pump, carrier
        self._board = board

    @property
    def board(self) -> Board:
        """Return the board of the bench."""
        assert self._board is not None
        return self._board

    def hurry(self, patience: float = 5e-3) -> None:
        """Let ticks wait less for a host that will not answer (s, wall)."""
        if self.pump is not None:
            self.pump.patience = patience

    def device(self) -> DeviceBackend:
        """Make a backend that is a device on a wire."""
        backend = self.make()
        assert isinstance(backend, DeviceBackend)
        return backend


@contextmanager
def on_bench(kind: str, *overrides: str, **of_board: int) -> Iterator[Bench]:
    """Set up a bench; `of_board` is handed to Board, such as `count_offset`."""
    if kind == "sim":
        rig = bench(*overrides)
        backend = open_backend(rig, SimulatedClock())
        yield Bench(rig, lambda: backend)
    elif kind in IN_PROCESS:
        make, carrier = kind.split()
        rig = bench("backend.kind=sim-board", f"backend.carrier={carrier}", *overrides)
        board = (Board if make == "sim-board" else ReferenceBoard)(rig, carrier=carrier, **of_board)
        first = SimBoardBackend(rig, SimulatedClock(), board)  # type: ignore[arg-type]
        yield Bench(rig, lambda: first, first.board, carrier=carrier)
    else:
        with pumped(kind, overrides, lambda rig, carrier: Board(rig, carrier=carrier, **of_board)) as there:
            yield there


@contextmanager
def pumped(kind: str, overrides: tuple[str, ...], make: Callable[[Rig, str], Any]) -> Iterator[Bench]:
    """Set up a bench whose board is behind a port of the system; `make` makes the board."""
    carrier = kind.split(maxsplit=1)[0]
    port, way = FAR_ENDS[kind]()
    rig = bench(*way, *overrides)
    pump = Pump(make(rig, carrier), port)
    pump.start()
    try:
        yield Bench(rig, lambda: open_backend(rig, PatientClock()), pump.board, pump, carrier)
    finally:
        pump.close()
