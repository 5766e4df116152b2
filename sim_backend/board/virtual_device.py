"""A virtual device: the firmware as a process behind a pseudo terminal, with the simulated plant."""

from __future__ import annotations

import select
import socket
import subprocess
import threading
from collections import deque
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Self

from dcmp_hil.errors import BackendError, LinkError, OpenError
from sim_backend.board import build
from sim_backend.board.config import NATIVE, board_config
from sim_backend.board.plant_io import PlantIO
from sim_backend.board.plant_port import OUTPUT, PLANT_TIME_FLAG, TICK, Output
from sim_backend.board.symlink import Symlink
from sim_backend.pacer import Pacer

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Truth

_ARMED_STATES = (2, 3)  # ARMING, RUN: a host is expected to answer every SAMPLE
_TICK_WAIT_MAX_MS = 2  # wall: how long a tick in plant time waits for a host that does not drive
_ANSWER_TIMEOUT_S = 10.0  # wall: the process is gone if it takes longer
_END_TIMEOUT_S = 2.0
_LOG_OUTPUTS_MAX = 10_000
_ANSWERS_KEPT = 10_000
_UINT32_MAX = 0xFFFF_FFFF


class VirtualDevice:
    """A device that any program can open like a serial port.

    A context manager: the process ends with it.

    Parameters
    ----------
    rig
        Its `[sim]`, `[model]`, `[encoder]`, `[amplifier]` and `[loop]` tables; it is wired as they say.
    link
        `cobs` or `slcan`.
    clock
        What paces its ticks. None: plant time, in which a tick is over as soon as the host has answered, and
        nothing depends on how fast that was.
    patience_ms
        ms, wall: how long a tick in plant time waits for a host that drives.
    symlink
        A path that leads to the port, for as long as there is one.
    count_offset
        Counts, what the encoder shows where the arm is at 0 rad.
    start_us
        us, of the firmware's clock at the first tick.
    program
        A command that takes the native board's arguments; by default the native board itself.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        link: str = "cobs",
        clock: Clock | None = None,
        patience_ms: int = 50,
        symlink: Path | None = None,
        count_offset: int = 0,
        start_us: int = 0,
        program: Sequence[str] = (),
    ) -> None:
        self._config = board_config(rig, NATIVE)
        self._link, self._patience_ms = link, patience_ms
        self._symlink = None if symlink is None else Symlink(symlink)
        self._clock = clock
        self._program = program
        self._pace = None if clock is None else Pacer(clock, rig.period)
        self.pins = PlantIO(rig, count_offset)
        self.now_us = start_us & _UINT32_MAX
        self._ticked = (self.now_us, 0, 0)  # the same; when its tick was sent and answered, ns
        self.tick_count = 0
        self.port = ""
        self.output = Output(self.now_us, self.now_us, self.now_us, 0, 0, 0, 0, 0, 0)
        self.log: deque[Output] = deque(maxlen=_LOG_OUTPUTS_MAX)
        self._answered_ns: deque[int] = deque(maxlen=_ANSWERS_KEPT)
        self._process: subprocess.Popen[bytes] | None = None
        self._socket: socket.socket | None = None
        self._changes = select.poll()
        self._rest = b""
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self.error: BackendError | None = None  # what ended the thread

    def __enter__(self) -> Self:
        """Start the process.

        Raises
        ------
        OpenError
            If it cannot be compiled or started.
        ConfigError
            If the symlink cannot be made.
        """
        program = self._program or [str(build.program())]
        ours, theirs = socket.socketpair()
        fields = [f"{name}={value}" for name, value in self._config.items()]
        arguments = ["--link", self._link, "--plant-fd", str(theirs.fileno()), *fields]
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                [*program, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C is for us; it ends when we hang up
            )
        except OSError as error:
            ours.close()
            raise OpenError(
                f"{program[0]}: {error.strerror or error}. Point XDG_CACHE_HOME at a folder that "
                "programs may be started from."
            ) from error
        finally:
            theirs.close()
        ours.settimeout(_ANSWER_TIMEOUT_S)
        self._changes.register(ours, select.POLLIN)
        self._socket = ours
        try:
            self._learn_port(self._process)
            if self._symlink:
                self._symlink.make(self.port)
        except BaseException:
            self._end()
            raise
        if self._pace:
            self._pace.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End thread and process; the port is gone then."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(2.0 * _ANSWER_TIMEOUT_S)
        if self._symlink:
            self._symlink.remove()
        self._end()

    def start(self) -> None:
        """Tick in a thread from now on, until the end."""
        self._thread = threading.Thread(target=self._run, name="virtual-device", daemon=True)
        self._thread.start()

    def run_ticks(self, count: int) -> None:
        """Run `count` ticks of the board.

        Raises
        ------
        LinkError
            If the process ended, or does not answer.
        """
        for _ in range(count):
            self._tick()

    def wait_for_change(self, seconds: float) -> bool:
        """Wait until the firmware's output changes between two ticks; return whether it did.

        Raises
        ------
        LinkError
            If the process ended.
        """
        if not self._changes.poll(1e3 * seconds):
            return False
        self._listen()
        return True

    def truth(self) -> Truth:
        """Return the true state at the last tick."""
        return self.pins.truth

    def clock_us(self, at_ns: int | None = None) -> tuple[int, int]:
        """Return the firmware's clock, between two ticks too, and by how much it may be further, us.

        In wall time the firmware's clock goes on from when it hears of a tick, which is known to lie between
        the tick and its answer.

        Parameters
        ----------
        at_ns
            ns, an instant of the clock that paces the ticks; None is now.
        """
        now_us, sent_ns, answered_ns = self._ticked
        gone_ns = (self._now_ns() if at_ns is None else at_ns) - answered_ns
        return (now_us + gone_ns // 1000) & _UINT32_MAX, (answered_ns - sent_ns) // 1000

    def longest_gap_us(self, since_ns: int) -> int:
        """Return the longest time between two ticks after an instant, us; a device of its own has its period.

        A host hears nothing in that time; on a busy computer the tick itself comes late.
        """
        answers_ns = [at_ns for at_ns in tuple(self._answered_ns) if at_ns >= since_ns]
        gaps_ns = (after - before for before, after in pairwise([since_ns, *answers_ns]))
        return max(gaps_ns, default=0) // 1000

    @property
    def pid(self) -> int:
        """Of the firmware's process."""
        return self._process.pid if self._process else 0

    def _now_ns(self) -> int:
        return self._clock.now_ns() if self._clock else 0

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                self._tick()
        except BackendError as error:
            self.error = error

    def _tick(self) -> None:
        if self._pace:
            self._pace.wait_for(self.tick_count)
        if self.tick_count:
            self.wait_for_change(0.0)
            self.pins.advance(self.output.voltage_mV)
            self.now_us = (self.now_us + self._config["period_us"]) & _UINT32_MAX
        self.tick_count += 1
        patience_ms = self._patience_ms if self.output.state in _ARMED_STATES else _TICK_WAIT_MAX_MS
        wait_ms = 0 if self._pace else patience_ms
        flags = 0 if self._pace else PLANT_TIME_FLAG
        sent_ns = self._now_ns()
        try:
            self._plug().sendall(TICK.pack(self.now_us, self.pins.count(), wait_ms, flags))
        except OSError as error:
            raise self._lost(error) from error
        while not self._listen():
            pass
        answered_ns = self._now_ns()
        self._ticked = (self.now_us, sent_ns, answered_ns)
        self._answered_ns.append(answered_ns)

    def _listen(self) -> bool:
        """Process the firmware's output; return whether it contained an answer to a tick."""
        try:
            data = self._plug().recv(4096)
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost(None)
        data = self._rest + data
        whole = len(data) - len(data) % OUTPUT.size
        self._rest = data[whole:]
        outputs = [Output(*fields) for fields in OUTPUT.iter_unpack(data[:whole])]
        self.log.extend(outputs)
        if outputs:
            self.output = outputs[-1]
        return any(not output.unasked for output in outputs)

    def _plug(self) -> socket.socket:
        if self._socket is None:
            raise LinkError("The virtual device is not running. Use it as a context manager.")
        return self._socket

    def _lost(self, error: OSError | None) -> LinkError:
        why = "does not answer" if isinstance(error, TimeoutError) else "has ended"
        return LinkError(f"The firmware's process {self.pid} {why}. Start the virtual device again.")

    def _learn_port(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None  # noqa: S101 - it was asked for
        self.port = process.stdout.readline().decode().strip()
        if not self.port:
            said = process.communicate(timeout=_END_TIMEOUT_S)[1].decode().strip()
            raise OpenError(f"The firmware's process did not start: {said}. Look at /dev/pts and /dev/ptmx.")

    def _end(self) -> None:
        """Hang up, which ends the process; help it if it does not."""
        plug, self._socket = self._socket, None
        if plug is not None:
            plug.close()
        process, self._process = self._process, None
        if process is None:
            return
        for help_it in (process.terminate, process.kill):
            try:
                process.wait(_END_TIMEOUT_S)
                break
            except subprocess.TimeoutExpired:
                help_it()
        process.wait(_END_TIMEOUT_S)
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()
