"""The model of the device is the firmware: both walk side by side through everything it can reach."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Drive, Hello, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tests.firmware.bench import Core
from tests.firmware.core_library import build, load
from tests.stateful.device_model import NEXT, Command, Device, Rules, State

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.messages import Message

TTL_MS = 5  # ms: the shortest watchdog
RULES = Rules(arming=10, oldest=3, watchdog=TTL_MS)
TOO_FAST = 42  # counts a period
SESSIONS = (1, 2)
FLAGS = ("arm", "", "clear", "release")
COMMANDS = [Command(*fields) for fields in product(SESSIONS, (0, 1, 3, 4), (False, True), FLAGS)]


class Twin:
    """The firmware, with a state that can be copied."""

    def __init__(self, core: Core, device: Any = None, now: int = 0, counts: int = 0) -> None:
        self.core, self.lib, self.now, self.counts = core, core.lib, now, counts
        self.device = core.new("struct dcmp_device *") if device is None else device
        if device is None:
            core.lib.dcmp_device_init(self.device, core.config(), now)

    def copy(self) -> Twin:
        device = self.core.new("struct dcmp_device *", self.device[0])
        return Twin(self.core, device, self.now, self.counts)

    def say(self, message: Message) -> None:
        self.lib.dcmp_device_receive(self.device, self.core.frame(*pack(message, 0)), self.now)

    def command(self, command: Command) -> None:
        seq = (self.device.tick - command.age) & 0x1FFF
        arm, clear, release = (command.flag == name for name in ("arm", "clear", "release"))
        self.say(Drive(1000 * command.volts, seq, arm, clear, release, command.session, TTL_MS))

    def tick(self) -> None:
        self.now += 1000
        self.lib.dcmp_device_tick(self.device, self.now, self.counts, self.core.ffi.NULL)

    def rush(self) -> None:
        """Tick for the second time at a speed above the limit, which the first time is not enough to see.

        The first time is put into its memory, and both are taken out again: the model has no memory.
        """
        encoder = self.device.encoder
        for i in range(len(encoder.past)):
            encoder.past[i] -= TOO_FAST * (i != encoder.newest)
        self.counts += TOO_FAST
        self.tick()
        for i in range(len(encoder.past)):
            encoder.past[i] = encoder.position

    def seen(self) -> tuple[object, ...]:
        """Return the state that the model has as well."""
        device = self.device
        out = self.lib.dcmp_device_output(device, self.now)
        supervisor = device.supervisor
        assert out.enable == (supervisor.state == State.RUN)
        return (
            supervisor.state, device.session.owner, supervisor.counted, supervisor.lowered,
            out.voltage_mV != 0, device.link_up,
        )  # fmt: skip


def expected(device: Device) -> tuple[object, ...]:
    return device.state, device.owner, device.counted, device.lowered, device.out, device.up


Event = tuple["Callable[[Rules, Device], Device]", "Callable[[Twin], object]"]


def _command(command: Command) -> Event:
    return lambda r, d: r.command(d, command), lambda t: t.command(command)


def _hello(session: int) -> Event:
    return lambda r, d: r.hello(d, session), lambda t: t.say(Hello(session, PROTOCOL_HASH))


def _link(up: bool) -> Event:
    return (
        lambda r, d: r.link(d, up=up),
        lambda t: t.lib.dcmp_device_link(t.device, up, t.now),
    )


EVENTS: list[Event] = [
    (Rules.tick, lambda t: t.tick()),
    (lambda r, d: r.tick(d, limit=True), lambda t: t.rush()),
    (Rules.stop, lambda t: t.say(Stop(3))),
    (Rules.corrupt, lambda t: [t.lib.dcmp_device_corrupt(t.device, t.now) for _ in range(10)]),
    *map(_link, (False, True)),
    *map(_hello, SESSIONS),
    *map(_command, COMMANDS),
]


def disagreements(core: Core, rules: Rules = RULES) -> tuple[int, int]:
    """Return how many states the model reached, and in how many pairs of state and event the two differ."""
    start = rules.boot()
    twins = {start: Twin(core)}
    waiting, wrong = [start], 0
    for device in waiting:
        for model, real in EVENTS:
            twin, after = twins[device].copy(), rules.guard(model(rules, device))
            real(twin)
            if twin.seen() != expected(after):
                wrong += 1
            elif after not in twins:
                twins[after] = twin
                waiting.append(after)
    return len(twins), wrong


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    return Core(*load(build(tmp_path_factory.mktemp("core"), "plain")))


def test_table_is_the_firmwares(core: Core) -> None:
    assert len(NEXT) == core.lib.DCMP_EVENTS
    for number, (event, following) in enumerate(NEXT.items()):
        found = tuple(core.lib.dcmp_supervisor_next(state, number) for state in State)
        assert found == following, event


@pytest.mark.untraced
def test_firmware_goes_where_the_model_goes(core: Core) -> None:
    states, wrong = disagreements(core)
    assert wrong == 0, f"{wrong} differences in {states} states x {len(EVENTS)} events"
    assert states > 500, f"only {states} states"


OTHERS = {
    "nine commands arm": Rules(9, 3, TTL_MS),
    "older commands are taken": Rules(10, 4, TTL_MS),
    "the watchdog is a period late": Rules(10, 3, TTL_MS + 1),
    "release clears a fault": Rules(10, 3, TTL_MS, NEXT | {"release": NEXT["clear"]}),
    "a limit disarms, and is forgotten": Rules(10, 3, TTL_MS, NEXT | {"limit": NEXT["disarm"]}),
}


@pytest.mark.untraced
@pytest.mark.parametrize("error", OTHERS, ids=str)
def test_walk_notices_a_model_that_is_another(core: Core, error: str) -> None:
    assert disagreements(core, OTHERS[error])[1] > 0
