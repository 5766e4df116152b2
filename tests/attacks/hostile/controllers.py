"""Controllers that are bad to their run, each in one way; all of them drive the arm well until then."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil import ControllerContext, Estimate, Reference

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
ERROR = RuntimeError("of this controller")


class Good:
    """A PD controller that turns bad after so many periods."""

    def __init__(self, context: ControllerContext, turns: int = 600) -> None:
        self.model, self.left = context.model, turns
        self.begin()

    def begin(self) -> None:
        """Misbehave at the start of the run."""

    def turn(self) -> None:
        """Misbehave once."""

    def every(self) -> None:
        """Misbehave in every cycle."""

    def control(self, reference: Reference, estimate: Estimate) -> float:
        error = reference.position - estimate.position
        u = reference.acceleration + 400.0 * error + 40.0 * (reference.velocity - estimate.velocity)
        return (u - estimate.disturbance) / self.model.ku

    def update(self, reference: Reference, estimate: Estimate) -> float:
        self.left -= 1
        self.every()
        if self.left == 0:
            self.turn()
        return self.control(reference, estimate)


class HandlersSet(Good):
    """Sets handlers of its own, at the start and later."""

    def begin(self) -> None:
        for number in SIGNALS:
            signal.signal(number, lambda *_: None)

    turn = begin


class HandlersSetEachPeriod(Good):
    def every(self) -> None:
        signal.signal(signal.SIGINT, lambda *_: None)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


class SignalsIgnored(Good):
    def begin(self) -> None:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    turn = begin


class SignalsIgnoredInC(Good):
    """As a library in C does, such as rclpy: Python does not see it."""

    def turn(self) -> None:
        libc = ctypes.CDLL(None)
        for number in SIGNALS:
            libc.signal(int(number), ctypes.c_void_p(1))

    begin = turn


class SignalsBlocked(Good):
    def turn(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)

    begin = turn


class Swallows(Good):
    """Keeps every exception for itself."""

    def update(self, reference: Reference, estimate: Estimate) -> float:
        try:
            return super().update(reference, estimate)
        except BaseException:  # noqa: BLE001
            return 0.0


class SwallowsForEver(Good):
    """Tries again and again, after any interruption."""

    def turn(self) -> None:
        while True:
            try:
                while True:
                    time.sleep(0.01)
            except BaseException:  # noqa: BLE001, S110
                pass


class Forks(Good):
    """Leaves a copy of the run's process behind, with every descriptor that it has."""

    def turn(self) -> None:
        if os.fork() == 0:
            time.sleep(8.0)
            os._exit(0)


class ForksThenBlocks(Forks):
    def turn(self) -> None:
        super().turn()
        time.sleep(1e6)


class Worker(Good):
    """Has a worker of multiprocessing, which is no daemon."""

    def begin(self) -> None:
        multiprocessing.get_context("fork").Process(target=time.sleep, args=(8.0,)).start()


class BlocksInC(Good):
    """Sleeps in C with the interpreter's lock held."""

    def turn(self) -> None:
        ctypes.PyDLL(None).sleep(1000)


class Sleeps(Good):
    def turn(self) -> None:
        time.sleep(1e6)


class BusyLoop(Good):
    def turn(self) -> None:
        while True:
            pass


class BusyLoopDeaf(Good):
    def turn(self) -> None:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        while True:
            try:
                while True:
                    pass
            except BaseException:  # noqa: BLE001, S110
                pass


class Raises(Good):
    def turn(self) -> None:
        raise ERROR


class RaisesBase(Good):
    def turn(self) -> None:
        raise KeyboardInterrupt


class Threads(Good):
    """Starts threads that are not daemons."""

    def begin(self) -> None:
        threading.Thread(target=time.sleep, args=(30.0,)).start()


class Exits(Good):
    def turn(self) -> None:
        sys.exit(0)


class ExitsAtOnce(Good):
    def turn(self) -> None:
        os._exit(0)


class ExitsInC(Good):
    def turn(self) -> None:
        ctypes.CDLL(None)["_exit"](0)


class Aborts(Good):
    def turn(self) -> None:
        os.abort()


class AbortsInC(Good):
    def turn(self) -> None:
        ctypes.CDLL(None).abort()


class KillsItself(Good):
    def turn(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)
