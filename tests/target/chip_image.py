"""The law in single precision, as a program for an emulated Cortex-M4 and as a library for this computer."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tests.firmware.core_library import CORE, LAW, WARNINGS
from tests.target.build import FIRMWARE, needed

if TYPE_CHECKING:
    from collections.abc import Sequence

Words = np.ndarray[Any, np.dtype[np.uint32]]
Rows = np.ndarray[Any, np.dtype[np.void]]

HERE = Path(__file__).resolve().parent / "chip"
JOB_FILES = sorted(HERE.glob("*_job.c"))
SINGLE = ("-DDCMP_REAL_FLOAT", "-Wdouble-promotion", f"-I{CORE}", f"-I{HERE}")
M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-fno-short-enums")
WHOLE = "--param=sra-max-scalarization-size-Ospeed=256"
"""Structures by value stay in registers: without it gcc copies those of more than 16 bytes."""
LEVEL = "-O2"
"""As the boards' programs are compiled."""
FLUSH_TO_ZERO = 1 << 24
"""FPSCR: numbers below the normal ones are 0."""
JOBS = ("r1", "friction", "cycle")
RESULTS = 16
ROWS_MAX = 100_000
STATE = 4096
"""Bytes of the largest state, and of the largest set-up."""
_EMULATOR = (
    *("-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"),
    *("-semihosting-config", "enable=on,target=native"),
)
_PATIENCE_S = 600.0
_TICK_NS, _INSTRUCTION_NS = 40.0, 1024.0

ROW = np.dtype(
    [("tick", "<i4"), ("restarts", "<i4")]
    + [(name, "<f4") for name in ("position", "voltage", "gap", "x", "v", "a", "x_middle", "v_middle")]
)


class Order(NamedTuple):
    """A job with its set-up and its rows; its state begins with nothing."""

    job: str
    setup: bytes
    rows: Rows
    fpscr: int = 0


def build_image(folder: Path) -> Path:
    """Link the program; return its ELF file."""
    built = folder / "image.elf"
    command = [
        *(needed("arm-none-eabi-gcc"), *WARNINGS, *LAW, *SINGLE, *M4, LEVEL, WHOLE, "-g"),
        *("-fno-tree-loop-distribute-patterns", "-nostdlib"),
        *("-Wl,--no-enum-size-warning", "-Wl,--fatal-warnings"),
        *("-T", str(HERE / "image.ld"), *map(str, [HERE / "image.c", *JOB_FILES]), "-lgcc", "-o", str(built)),
    ]
    subprocess.run(command, check=True)
    return built


def build_library(folder: Path) -> ctypes.CDLL:
    """Compile the same jobs for this computer, and the arm in double that a job may move."""
    built, arm = folder / "jobs.so", folder / "closed_loop.o"
    shared = [*WARNINGS, *LAW, f"-I{CORE}", f"-I{HERE}", f"-I{FIRMWARE / 'boards/simlib'}", "-O2", "-fPIC"]
    files = map(str, [HERE / "here.c", *JOB_FILES, arm])
    cc = needed("gcc")
    subprocess.run([cc, *shared, "-c", str(HERE / "closed_loop.c"), "-o", str(arm)], check=True)
    subprocess.run([cc, *shared, *SINGLE, "-shared", *files, "-o", str(built)], check=True)
    library = ctypes.CDLL(str(built))
    library.closed_loop.restype = ctypes.c_int64
    return library


def _address(array: Any) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def here(library: ctypes.CDLL, order: Order) -> Words:
    """Do a job on this computer; return its results, one row of words for each row."""
    rows, found = np.ascontiguousarray(order.rows), np.zeros((len(order.rows), RESULTS), np.uint32)
    job = getattr(library, f"{order.job}_job")
    job(
        order.setup,
        ctypes.create_string_buffer(STATE),
        _address(rows),
        _address(found),
        ctypes.c_uint32(len(rows)),
    )
    return found


def cycle_setup(library: ctypes.CDLL, parameters: Rows) -> bytes:
    """Return struct cycle_setup of `struct run_parameters`."""
    made = ctypes.create_string_buffer(STATE)
    size = library.cycle_setup_of(_address(parameters), made)
    return made.raw[:size]


class Loop(NamedTuple):
    """What the law in a loop was given, what it gave, and how far the arm was from the reference, rad."""

    order: Order
    results: Words
    errors: Any
    began: int  # tick of the trajectory's start; -1 without one


def closed_loop(library: ctypes.CDLL, parameters: Rows, cycles: int) -> Loop:
    """Let the law move the simulated arm along sin(t / 2)."""
    setup = cycle_setup(library, parameters)
    rows, found, errors = np.zeros(cycles, ROW), np.zeros((cycles, RESULTS), np.uint32), np.zeros(cycles)
    state = ctypes.create_string_buffer(STATE)
    arrays = (_address(rows), _address(found), _address(errors))
    began = library.closed_loop(_address(parameters), setup, state, *arrays, ctypes.c_int64(cycles))
    return Loop(Order("cycle", setup, rows), found, errors, began)


def on_the_chip(image: Path, orders: Sequence[Order], *options: str) -> list[Words]:
    """Do jobs on the emulated chip; return the results of each."""
    folder = image.parent
    with (folder / "orders.bin").open("wb") as file:
        for order in orders:
            assert len(order.rows) <= ROWS_MAX
            head = (JOBS.index(order.job), len(order.setup), len(order.rows), order.fpscr)
            file.write(np.array(head, "<u4").tobytes() + order.setup + order.rows.tobytes())
    command = [needed("qemu-system-arm"), *_EMULATOR, *options, "-kernel", str(image)]
    subprocess.run(command, cwd=folder, check=True, timeout=_PATIENCE_S)
    words = np.fromfile(folder / "results.bin", "<u4").reshape(-1, RESULTS)
    ends = np.cumsum([len(order.rows) for order in orders])
    assert len(words) == ends[-1]
    return np.split(words, ends[:-1])


class Cost(NamedTuple):
    """What the steps of a job take."""

    stack: int  # bytes
    instructions: Words  # of each step


def costs(image: Path, orders: Sequence[Order]) -> list[Cost]:
    """Count the instructions of every step: each takes 1024 ns, and the chip's own clock measures them."""
    on_the_chip(image, orders, "-icount", "shift=10,sleep=off")
    words, found = np.fromfile(image.parent / "costs.bin", "<u4"), []
    while len(words):
        stack, empty, steps = words[:3].tolist()
        ticks, words = words[3 : 3 + steps], words[3 + steps :]
        found.append(
            Cost(stack, np.round((ticks - float(empty)) * (_TICK_NS / _INSTRUCTION_NS)).astype(np.uint32))
        )
    return found


def differing(found: Words, wanted: Words) -> Any:
    """Return the places of words that differ; one NaN is as good as another."""
    no_number = np.isnan(found.view(np.float32)) & np.isnan(wanted.view(np.float32))
    return np.argwhere((found != wanted) & ~no_number)
