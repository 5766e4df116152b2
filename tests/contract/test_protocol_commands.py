"""What docs/protocol.md says of a device, asked with messages made here, through `Stranger`'s interface."""

from __future__ import annotations

import binascii
import struct
from typing import TYPE_CHECKING, NamedTuple, Protocol

import pytest

from tests.contract import stranger_wire as wire
from tests.contract.firmware_device import Firmware
from tests.contract.stranger import Stranger
from tests.contract.stranger_wire import ARMING, FAULTED, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable

OURS, THEIRS = 0x1234, 0x4321
HASH = wire.protocol_hash()


class Device(Protocol):
    now_us: int

    @property
    def applied_mV(self) -> int: ...
    @property
    def enable(self) -> bool: ...
    def receive(self, data: bytes) -> None: ...
    def transmit(self) -> bytes: ...
    def receive_frame(self, id: int, data: bytes) -> None: ...  # noqa: A002 - the interface's word
    def transmit_frames(self) -> list[tuple[int, bytes]]: ...
    def tick(self, counts: int) -> None: ...
    def advance(self, us: int) -> None: ...
    def link(self, up: bool) -> None: ...


class Sample(NamedTuple):
    position: int
    voltage_mV: int
    tick: int
    state: int
    missed: bool
    limited: bool
    fault_class: int


class Host:
    """The other end: joins ticks from boot on, keeps the newest message of each kind and counts them all."""

    def __init__(self, device: Device, carrier: str, *, node: int, first_tick: int) -> None:
        self.device = device
        self.node = node
        self.line = {"cobs": wire.Cobs, "slcan": wire.Slcan, "can": wire.Line}[carrier]()
        self.carrier = carrier
        self.ticks = first_tick - 1  # of the newest SAMPLE
        self.counts = 0
        self.seen: list[tuple[int, bytes]] = []

    def send(self, number: int, content: bytes, *, node: int | None = None, spoil: int = 0) -> None:
        identifier, data = wire.frame(number, self.node if node is None else node, content)
        data = data[:-1] + bytes([data[-1] ^ spoil])
        if self.carrier == "can":
            self.device.receive_frame(identifier, data)
        else:
            self.device.receive(self.line.pack([(identifier, data)]))

    def collect(self) -> list[tuple[int, bytes]]:
        """Return the messages that wait: number and content without crc8."""
        carried = self.carrier != "can"
        frames = self.line.feed(self.device.transmit()) if carried else self.device.transmit_frames()
        out = []
        for frame in frames:
            assert frame is not None
            identifier, data = frame
            assert wire.intact(identifier, data)
            assert identifier % 16 == self.node
            assert len(data) == wire.LENGTHS[identifier // 16]
            out.append((identifier // 16, data[:-1]))
        self.seen += out
        return out

    def tick(self, moved: int = 0) -> Sample:
        self.counts += moved
        self.device.tick(self.counts)
        self.ticks += 1
        contents = [content for number, content in self.collect() if number == wire.SAMPLE]
        assert len(contents) == 1
        voltage_mV, tick, flags = struct.unpack("<hBB", contents[0][3:])
        assert tick == self.ticks & 255
        position = int.from_bytes(contents[0][:3], "little")
        return Sample(position, voltage_mV, tick, flags & 7, bool(flags & 8), bool(flags & 16), flags >> 5)

    def drive(
        self,
        voltage_mV: int = 0,
        *,
        arm: int = 0,
        clear: int = 0,
        release: int = 0,
        back: int = 0,
        session: int = OURS,
        ttl_ms: int = 50,
    ) -> None:
        """Answer the SAMPLE `back` before the newest."""
        word = (self.ticks - back) % 8192 * 8 + arm + 2 * clear + 4 * release
        self.send(wire.DRIVE, struct.pack("<hHHB", voltage_mV, word, session, ttl_ms))

    def hello(self, session: int = OURS, hash_: int = HASH) -> str:
        """Return the letters of the flags that IDENTITY says."""
        self.send(wire.HELLO, struct.pack("<HI", session, hash_))
        ((number, content),) = self.collect()
        assert number == wire.IDENTITY
        assert struct.unpack("<I", content[:4]) == (HASH,)
        return "".join(letter for bit, letter in enumerate("bom") if content[6] >> bit & 1)

    def get(self, id_: int) -> tuple[int, int]:
        """Return result and value."""
        self.send(wire.GET, bytes([id_]))
        return self.value(id_)

    def put(self, id_: int, value: int, session: int = OURS) -> tuple[int, int]:
        self.send(wire.SET, struct.pack("<HBi", session, id_, value))
        return self.value(id_)

    def value(self, id_: int) -> tuple[int, int]:
        ((number, content),) = self.collect()
        said, value, result = struct.unpack("<BiB", content)
        assert (number, said) == (wire.VALUE, id_)
        return result, value

    def newest(self, number: int) -> bytes:
        return next(content for n, content in reversed(self.seen) if n == number)

    def fault(self) -> tuple[int, int, int]:
        """Return code, tick and detail of the newest FAULT."""
        code, tick, detail = struct.unpack("<BBi", self.newest(wire.FAULT))
        return code, tick, detail

    def health(self) -> dict[str, int]:
        """Let HEALTH come."""
        self.seen.clear()
        while not any(number == wire.HEALTH for number, _ in self.seen):
            self.tick()
        names = ("crc_errors", "sequence_gaps", "ring_overruns", "bus_offs", "late_ticks", "idle_percent")
        return dict(zip(names, self.newest(wire.HEALTH), strict=True))

    def arm(self) -> Sample:
        """From IDLE to RUN, as section 10 does it."""
        assert self.hello() == "o"
        for _ in range(10):
            self.tick()
            self.drive(arm=1)
        sample = self.tick()
        assert sample.state == RUN
        return sample

    def run(self, ticks: int, voltage_mV: int = 0, moved: int = 0) -> Sample:
        for _ in range(ticks - 1):
            self.drive(voltage_mV, arm=1)
            self.tick(moved)
        self.drive(voltage_mV, arm=1)
        return self.tick(moved)


@pytest.fixture(params=[Stranger, Firmware])
def device(request: pytest.FixtureRequest) -> Callable[..., Device]:
    make: Callable[..., Device] = request.param
    return make


@pytest.fixture(params=["cobs", "slcan", "can"])
def host(request: pytest.FixtureRequest, device: Callable[..., Device]) -> Callable[..., Host]:
    def make(*, carrier: str = request.param, node: int = 0, first_tick: int = 0, **built: int) -> Host:
        made = device(carrier=carrier, node=node, first_tick=first_tick, **built)
        return Host(made, carrier, node=node, first_tick=first_tick)

    return make


@pytest.fixture
def ready(host: Callable[..., Host]) -> Host:
    """Booted, owned, in IDLE."""
    made = host()
    made.tick()
    assert made.hello() == "o"
    return made


@pytest.fixture
def running(host: Callable[..., Host]) -> Host:
    made = host()
    made.arm()
    return made


def test_the_checks_of_the_page() -> None:
    assert wire.crc8(b"123456789") == 0xDF
    assert wire.crc16(b"123456789") == 0x29B1 == binascii.crc_hqx(b"123456789", 0xFFFF)


def test_one_sample_a_period_from_boot_on(host: Callable[..., Host]) -> None:
    h = host(first_tick=250, node=3)
    h.counts = -2
    assert h.tick() == (0xFFFFFE, 0, 250, IDLE, True, False, 0)
    for k in range(20):
        assert h.tick(1).position == (k - 1) % 2**24
    for _ in range(1000):
        h.tick()
    assert sum(number == wire.HEALTH for number, _ in h.seen) in {10, 11}


def test_hello_finds_an_owner(host: Callable[..., Host]) -> None:
    h = host()
    h.tick()
    assert h.hello(0) == ""
    assert h.hello(0, HASH ^ 1) == "m"
    assert h.hello(OURS, HASH ^ 1) == "m"
    assert h.hello(OURS) == "o"
    assert h.hello(THEIRS) == "b"
    assert h.hello(0) == "b"
    assert h.hello(OURS) == "o"


def test_ownership_ends_by_silence_or_release(ready: Host) -> None:
    for _ in range(490):
        ready.tick()
    ready.drive(session=THEIRS)  # no owner's
    ready.drive(back=4)  # too old
    assert ready.hello(THEIRS) == "b"
    assert ready.put(wire.TICK, 1)[0] == wire.READ_ONLY  # counts all the same
    for _ in range(490):
        ready.tick()
    assert ready.hello(THEIRS) == "b"
    assert ready.hello(OURS, HASH ^ 1) == "om"  # counts for nothing
    for _ in range(11):
        ready.tick()
    assert ready.hello(THEIRS) == "o"
    ready.drive(release=1, session=THEIRS)
    assert ready.hello(OURS) == "o"


def test_parameters(host: Callable[..., Host]) -> None:
    h = host(first_tick=2**31 - 1, counts_per_rev=8192)
    h.tick()
    assert h.get(wire.TICK) == (wire.OK, 2**31 - 1)
    h.tick()
    assert h.get(wire.TICK) == (wire.OK, 0)
    assert h.get(wire.COUNTS_PER_REV) == (wire.OK, 8192)
    assert h.get(wire.PERIOD_US) == (wire.OK, 1000)
    assert h.get(wire.EDGE_STAMPS) == (wire.OK, 0)
    assert h.get(wire.TRAVEL_ORIGIN) == (wire.OK, -1)
    assert h.get(0) == h.get(17) == (wire.UNKNOWN, 0)
    assert h.get(wire.SUPPLY) == (wire.OK, 0)
    assert h.put(wire.VOLTAGE_LIMIT, 5000) == (wire.NOT_OWNER, 10_000)
    h.hello()
    assert h.put(99, 0, THEIRS) == (wire.UNKNOWN, 0)
    assert h.put(wire.PERIOD_US, 0, THEIRS) == (wire.READ_ONLY, 1000)
    assert h.put(wire.VOLTAGE_LIMIT, 10_001, THEIRS) == (wire.OUT_OF_RANGE, 10_000)
    for id_, built in ((wire.VOLTAGE_LIMIT, 10_000), (wire.SPEED_LIMIT, 32_768), (wire.TRAVEL_LIMIT, 16_384)):
        assert h.put(id_, 1) == (wire.OK, 1)
        assert h.put(id_, 0) == h.put(id_, -1) == h.put(id_, built + 1) == (wire.OUT_OF_RANGE, 1)
        assert h.put(id_, built) == (wire.OK, built)
    built = h.get(wire.WATCHDOG)[1]
    assert [h.put(wire.WATCHDOG, ms)[0] for ms in (4, 5, built, built + 1)] == [3, 0, 0, 3]
    assert h.put(wire.SLEW, 0) == (wire.OUT_OF_RANGE, 0)
    assert h.put(wire.SLEW, 70_000) == (wire.OK, 70_000)
    h.drive(arm=1)
    assert h.put(wire.SLEW, 1, THEIRS) == (wire.NOT_IDLE, 70_000)


@pytest.mark.parametrize("session", [OURS, THEIRS])
def test_the_next_host_finds_the_device_as_it_was_built(ready: Host, session: int) -> None:
    watchdog_ms = ready.get(wire.WATCHDOG)[1]
    assert ready.put(wire.VOLTAGE_LIMIT, 2000) == (wire.OK, 2000)
    assert ready.put(wire.SLEW, 5) == (wire.OK, 5)
    assert ready.put(wire.WATCHDOG, 12) == (wire.OK, 12)
    assert ready.hello() == "o"  # the owner again: nothing changes
    assert ready.get(wire.VOLTAGE_LIMIT) == (wire.OK, 2000)
    ready.drive(release=1)
    assert ready.get(wire.SLEW) == (wire.OK, 0)  # it ends with the session
    assert ready.hello(session) == "o"
    assert ready.get(wire.VOLTAGE_LIMIT) == (wire.OK, 10_000)
    assert ready.get(wire.SLEW) == (wire.OK, 0)
    assert ready.get(wire.WATCHDOG) == (wire.OK, watchdog_ms)
    assert ready.get(wire.TICK)[1] == ready.ticks


def test_ten_drives_arm_the_device(ready: Host) -> None:
    for _ in range(9):
        ready.drive(arm=1)
        assert ready.tick().state == ARMING
        assert not ready.device.enable
    ready.drive(arm=1)
    assert ready.tick().state == RUN
    assert ready.device.enable


def test_arming_must_be_unbroken(ready: Host) -> None:
    ready.drive(5, arm=1)
    assert ready.tick().state == IDLE
    for broken in ({"arm": 0}, {"clear": 1}, {"release": 1}, {"arm": 1, "voltage_mV": 1}):
        ready.drive(arm=1)
        assert ready.tick().state == ARMING
        ready.drive(**broken)
        assert ready.tick().state == IDLE
        assert ready.hello() == "o"
    for gap, state in ((3, ARMING), (4, IDLE)):
        ready.drive(arm=1)
        for _ in range(gap):
            ready.tick()
        ready.drive(arm=1)
        assert ready.tick().state == state


def test_a_command_from_sample_k_acts_from_k_plus_1_and_is_seen_in_k_plus_2(running: Host) -> None:
    running.drive(1500, arm=1)
    assert running.device.applied_mV == 0
    sample = running.tick()
    assert (sample.voltage_mV, sample.missed, sample.limited) == (0, False, False)
    assert running.device.applied_mV == 1500
    sample = running.tick()
    assert (sample.voltage_mV, sample.missed) == (1500, True)
    assert running.device.applied_mV == 1500  # held
    running.drive(-700, arm=1, back=1)
    running.drive(-800, arm=1)
    running.tick()
    assert running.device.applied_mV == -800  # the newest of several


@pytest.mark.parametrize(("period_us", "reach"), [(1000, 3), (2000, 2), (2500, 2), (3000, 1), (4000, 1)])
def test_age(host: Callable[..., Host], period_us: int, reach: int) -> None:
    h = host(period_us=period_us, first_tick=8188)
    for _ in range(10):  # over the end of seq
        h.tick()
    h.hello()
    for back in (reach + 1, 256, -1, 4096):
        h.drive(back=back)
    assert h.tick().missed
    h.drive(back=reach)
    assert not h.tick().missed
    assert h.health()["sequence_gaps"] == 4


def test_age_goes_by_the_counter_whether_samples_came_or_not(ready: Host) -> None:
    for _ in range(5):  # the host hears nothing of these
        ready.device.tick(0)
        (ready.device.transmit_frames if ready.carrier == "can" else ready.device.transmit)()
    ready.drive(arm=1)  # answers the newest SAMPLE that it heard
    ready.ticks += 5
    assert ready.tick().missed
    assert ready.get(wire.TICK) == (wire.OK, ready.ticks)
    ready.drive(arm=1)
    assert not ready.tick().missed
    assert ready.health()["sequence_gaps"] >= 1


@pytest.mark.parametrize("drives", [4, 10])
def test_a_hello_of_the_owner_again_changes_nothing(ready: Host, drives: int) -> None:
    for _ in range(drives):
        ready.drive(arm=1)
        assert ready.tick().state in {ARMING, RUN}
    before = ready.tick().state
    assert ready.hello() == ready.hello() == "o"
    ready.drive(arm=1, back=ready.ticks % 8192)  # far too old, as it was before
    ready.drive(900, arm=1) if before == RUN else ready.drive(arm=1)
    assert ready.tick().state == before
    assert ready.device.applied_mV == (900 if before == RUN else 0)


def test_order(ready: Host) -> None:
    for _ in range(5):
        ready.tick()
    ready.drive(back=1)
    assert not ready.tick().missed
    ready.drive(back=2)  # the same again
    ready.drive(back=3)
    assert ready.tick().missed
    assert ready.health()["sequence_gaps"] == 2


def test_what_is_not_the_owners_or_not_in_range_feeds_nothing(ready: Host) -> None:
    for ttl_ms in (0, 4, 51, 255):
        ready.drive(arm=1, ttl_ms=ttl_ms)
    ready.drive(arm=1, clear=1)
    ready.drive(arm=1, release=1)
    ready.drive(clear=1, release=1)
    ready.drive(arm=1, session=THEIRS)
    ready.drive(arm=1, session=0)
    assert ready.tick().missed
    assert ready.tick().state == IDLE
    assert ready.health()["sequence_gaps"] == 0


def test_what_is_not_for_this_device_is_no_error(ready: Host) -> None:
    ready.send(wire.STOP, b"\0", node=1)
    ready.send(wire.STOP, b"\0", node=1, spoil=1)
    ready.send(wire.STOP, b"\0\0")
    ready.send(wire.DRIVE, bytes(6), spoil=1)
    ready.send(0x7E, bytes(7))
    assert ready.tick().state == IDLE
    ready.send(wire.STOP, b"\0", spoil=1)
    assert ready.health()["crc_errors"] == 1


def test_voltage_is_clamped_and_slewed(host: Callable[..., Host]) -> None:
    h = host(voltage_limit_mV=5000, slew_mV_per_ms=2000)
    h.arm()
    h.drive(-32768, arm=1)
    assert h.tick().limited
    assert h.device.applied_mV == -2000
    assert h.tick().voltage_mV == -2000  # goes on without a DRIVE
    assert h.device.applied_mV == -4000
    assert h.tick().limited
    assert h.device.applied_mV == -5000
    h.drive(-4000, arm=1)
    assert not h.tick().limited
    assert h.device.applied_mV == -4000
    h.drive(arm=0)
    assert h.device.applied_mV == 0  # at once


@pytest.mark.parametrize("word", [{"arm": 0}, {"clear": 1}, {"release": 1}])
def test_run_ends_at_once(running: Host, word: dict[str, int]) -> None:
    running.run(3, 3000)
    running.drive(3000, **word)
    assert (running.device.applied_mV, running.device.enable) == (0, False)
    sample = running.tick()
    assert (sample.state, sample.voltage_mV, sample.fault_class) == (IDLE, 0, 0)
    assert running.hello(THEIRS) == ("o" if "release" in word else "b")


@pytest.mark.parametrize(("watchdog_ms", "ttl_ms", "bound"), [(20, 50, 20), (50, 7, 7), (5, 50, 5)])
def test_watchdog(host: Callable[..., Host], watchdog_ms: int, ttl_ms: int, bound: int) -> None:
    h = host(watchdog_ms=watchdog_ms)
    h.arm()
    h.device.advance(100)
    h.drive(2000, arm=1, ttl_ms=ttl_ms)
    at_us = h.device.now_us
    h.drive(2000, arm=1, ttl_ms=ttl_ms)  # the same seq feeds nothing
    while h.device.now_us + 1000 <= at_us + 1000 * bound:
        assert h.tick().state == RUN
    before = h.tick() if h.device.enable else None
    assert (h.device.applied_mV, h.device.enable) == (0, False)
    assert before is None or before.state == FAULTED
    sample = h.tick()
    assert (sample.state, sample.voltage_mV, sample.fault_class) == (FAULTED, 0, wire.HOST_SILENT)
    code, _, age_us = h.fault()
    assert code == wire.HOST_SILENT
    assert 1000 * bound < age_us <= 1000 * bound + 1000


def test_watchdog_ends_arming_without_a_fault(ready: Host) -> None:
    ready.drive(arm=1, ttl_ms=5)
    states = [ready.tick().state for _ in range(7)]
    assert states[:4] == [ARMING] * 4
    assert states[-1] == IDLE


def test_stop_is_obeyed_from_every_host_and_said_ten_times_a_second(running: Host) -> None:
    running.run(3, 3000)
    running.send(wire.STOP, b"\x03")
    assert running.device.applied_mV == 0
    happened = running.ticks & 255
    running.send(wire.STOP, b"\x01")
    running.seen.clear()
    at = []
    for k in range(301):
        sample = running.tick()
        assert (sample.state, sample.fault_class, sample.voltage_mV) == (FAULTED, wire.STOPPED, 0)
        kinds = [number for number, _ in running.seen]
        if wire.FAULT in kinds:
            assert kinds.index(wire.FAULT) < kinds.index(wire.SAMPLE)
            at.append(k)
        running.seen = [m for m in running.seen if m[0] == wire.FAULT][-1:] if k == 300 else []
    assert at == [0, 100, 200, 300]
    assert running.fault() == (wire.STOPPED, happened, 3)


def test_a_fault_is_cleared_by_two_drives_of_one_session(ready: Host) -> None:
    ready.send(wire.STOP, b"\0")

    def after(**word: int) -> int:
        ready.drive(**word)
        return ready.tick().state

    assert after(clear=1) == FAULTED  # no DRIVE without clear since the fault
    assert after(arm=1) == FAULTED
    assert after(release=1) == FAULTED
    assert ready.hello(THEIRS) == "o"
    assert after(clear=1, session=THEIRS) == FAULTED  # the other one's DRIVE does not count
    assert after(session=THEIRS) == FAULTED
    assert after(clear=1, voltage_mV=1, session=THEIRS) == FAULTED
    assert after(clear=1, session=THEIRS) == IDLE
    ready.send(wire.STOP, b"\0")
    assert after(clear=1, session=THEIRS) == FAULTED  # each fault anew


@pytest.mark.parametrize("sign", [1, -1])
def test_speed_limit(running: Host, sign: int) -> None:
    assert running.run(30, moved=sign * 32).state == RUN
    assert running.run(1, 1000, moved=sign * 34).state == RUN  # may be a wrong count
    sample = running.run(1, 1000, moved=sign * 34)
    assert (sample.state, sample.fault_class) == (FAULTED, wire.OVER_SPEED)
    code, tick, detail = running.fault()
    assert (code, tick, abs(detail)) == (wire.OVER_SPEED, sample.tick, 34_000)


def test_travel_limit_counts_from_the_first_arming(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=300)
    for _ in range(100):
        h.tick(30)  # IDLE: no limit
    h.arm()
    assert h.run(10, moved=30).state == RUN
    h.drive(arm=0)
    h.tick()
    h.arm()
    assert h.run(1, moved=1).state == RUN  # may be a wrong count
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 301


@pytest.mark.parametrize("sign", [1, -1])
def test_a_low_speed_limit_shows_over_8_ms(ready: Host, sign: int) -> None:
    assert ready.put(wire.SPEED_LIMIT, 1000) == (wire.OK, 1000)  # 8 counts in 8 ms, and one more
    ready.arm()
    for moved in (1, 1, 1, 1, 1, 1, 1, 1, 2) * 3:
        assert ready.run(1, moved=sign * moved).state == RUN
    for moved in (1, 1, 2):
        assert ready.run(1, moved=sign * moved).state == RUN
    assert ready.run(1, moved=sign).fault_class == wire.OVER_SPEED
    assert abs(ready.fault()[2]) == 1250


def test_travel_from_an_origin_that_was_given(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=300)
    h.tick()
    h.hello()
    assert h.put(wire.TRAVEL_ORIGIN, 2**24 - 50) == (wire.OK, 2**24 - 50)
    assert (
        h.put(wire.TRAVEL_ORIGIN, 2**24) == h.put(wire.TRAVEL_ORIGIN, -2) == (wire.OUT_OF_RANGE, 2**24 - 50)
    )
    assert h.put(wire.TRAVEL_LIMIT, 60) == (wire.OK, 60)
    h.arm()
    assert h.run(5, moved=2).state == RUN
    assert h.run(1, moved=1).state == RUN  # may be a wrong count
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 61


def test_what_the_board_was_built_with_counts_from_the_first_arming(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=30)
    h.tick()
    h.hello()
    assert h.put(wire.TRAVEL_ORIGIN, 25) == (wire.OK, 25)
    h.arm()
    assert h.run(15, moved=2).state == RUN
    assert h.run(1, moved=1).state == RUN
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 31


def test_the_third_jump_within_100_periods(running: Host) -> None:
    for jump in (5000, -7000):
        assert running.run(1, moved=jump).state == RUN
        assert running.run(110, moved=0).state == RUN
    assert running.run(1, moved=9000).state == RUN
    assert running.run(1, moved=131).state == RUN
    assert running.run(1).fault_class == wire.OVER_SPEED  # not above four times 32.768
    assert running.fault()[2] == 65_500  # over twice the time


@pytest.mark.parametrize("wrong", [1, 34, 68, 98, 99, 131, 132, 163, 164, 165, 9000, 2**23 - 1, 2**23])
@pytest.mark.parametrize(("period_us", "speed"), [(1000, 0), (1000, 32), (100, 3)])
def test_one_wrong_count(device: Callable[..., Device], wrong: int, period_us: int, speed: int) -> None:
    """Sizes around one and two times the speed limit, and where one way or both are jumps."""
    for sign in (1, -1):
        h = Host(device(period_us=period_us), "cobs", node=0, first_tick=0)
        h.arm()
        h.run(30, moved=speed)
        sample = h.run(1, moved=speed + sign * wrong)
        assert (sample.state, sample.position) == (RUN, h.counts % 2**24)
        assert h.run(1, moved=speed - sign * wrong).state == RUN
        assert h.run(30, moved=speed).state == RUN


@pytest.mark.parametrize(("wrong", "state"), [(67, RUN), (68, FAULTED), (131, FAULTED)])
def test_two_wrong_counts_in_a_row(running: Host, wrong: int, state: int) -> None:
    assert running.run(1, moved=wrong).state == RUN
    assert running.run(1, moved=0).state == state
    assert running.run(1, moved=-wrong).state == state


def test_one_wrong_count_is_no_travel(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=100)
    h.arm()
    assert h.run(4, moved=25).state == RUN
    assert h.run(1, moved=60).state == RUN
    assert h.run(1, moved=-60).state == RUN
    assert h.run(30).state == RUN
    assert h.run(1, moved=1).state == RUN
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 101


def test_three_jumps(running: Host) -> None:
    assert running.run(1, moved=132 + 1).state == RUN
    assert running.run(50, moved=32).state == RUN
    assert running.run(1, moved=-8000).state == RUN
    sample = running.run(1, moved=4000)
    assert (sample.state, sample.fault_class) == (FAULTED, 7)
    assert running.fault() == (wire.ENCODER_JUMP, sample.tick, 4000)


def test_ten_corrupt_frames_among_a_hundred(running: Host) -> None:
    for _ in range(9):
        running.send(wire.HELLO, bytes(6), spoil=0x80)
        running.send(wire.STOP, b"\0", node=2)  # not one of the hundred
    assert running.run(1).state == RUN
    assert running.run(100, 500).state == RUN  # forgotten
    for _ in range(9):
        running.send(wire.HELLO, bytes(6), spoil=0x80)
    assert running.device.applied_mV == 500
    running.send(wire.STOP, b"\0", spoil=1)
    assert running.device.applied_mV == 0
    assert running.tick().fault_class == wire.CORRUPT_LINK
    assert running.fault()[2] == 10


def test_link_down(running: Host) -> None:
    running.run(3, 500)
    running.send(wire.GET, bytes([wire.TICK]))
    running.device.link(up=False)
    running.device.advance(2000)
    assert (running.device.applied_mV, running.device.enable) == (0, False)
    assert running.device.transmit() == b""
    running.device.link(up=True)
    sample = running.tick()
    assert (sample.state, sample.fault_class) == (FAULTED, wire.LINK_DOWN)
    assert not any(number == wire.VALUE for number, _ in running.seen)


def test_a_blocked_link_never_brings_old_samples(ready: Host) -> None:
    if isinstance(ready.device, Firmware):
        pytest.skip("its library empties the device at every call; tests/firmware/core asks the core itself")
    for _ in range(20):
        ready.send(wire.GET, bytes([wire.TICK]))
    for _ in range(4):
        ready.device.tick(0)
    ready.ticks += 4
    ready.tick()
    numbers = [number for number, _ in ready.seen[-17:]]
    assert numbers == [wire.SAMPLE] + 16 * [wire.VALUE]
    assert {struct.unpack("<i", content[1:5])[0] for _, content in ready.seen[-16:]} == {ready.ticks}
    assert ready.health()["ring_overruns"] == 4


def test_cobs_is_in_step_again_after_a_zero(host: Callable[..., Host]) -> None:
    h = host(carrier="cobs")
    h.tick()
    h.device.receive(b"\0\0\0")
    h.hello(0)
    h.device.receive(b"\x05\x11\0")  # no such block
    h.device.receive(b"\x02\x11" * 4 + b"\0")
    h.device.receive(b"\x01" * 40 + b"\0")
    stop = h.line.pack([wire.frame(wire.STOP, 0, b"\0")]).strip(b"\0")
    h.device.receive(stop[:-1] + bytes([stop[-1] ^ 1]) + b"\0")
    above = struct.pack("<H", 0x810) + b"\0\1"
    h.device.receive(wire.cobs_encode(above + struct.pack("<H", wire.crc16(above))) + b"\0")
    assert h.tick().state == IDLE
    assert h.health()["crc_errors"] == 5
    for byte in stop + b"\0":
        h.device.receive(bytes([byte]))
    assert h.tick().state == FAULTED


def test_slcan_commands(host: Callable[..., Host]) -> None:
    h = host(carrier="slcan")
    h.tick()

    def says(line: bytes) -> bytes:
        h.device.receive(line + b"\r")
        return h.device.transmit()

    stop = f"t0102{wire.frame(wire.STOP, 0, b'+')[1].hex()}"
    assert [says(line) for line in (b"O", b"L", b"S8", b"s031C", b"s00031C")] == 5 * [b"\r"]
    assert (says(b"V"), says(b"N"), says(b"F"), says(b"")) == (b"V0101\r", b"NDCMP\r", b"F00\r", b"")
    assert says(b"T000000102AABB") == says(b"r0102") == says(b"R000000102") == says(b"t7FF1AA") == b""
    bad = (
        stop.encode(),
        b"t0103AABB",
        b"t0100",
        b"t8001AA",
        b"X",
        b"S",
        b"t0101\xc1A",
        b"V" * 40,
        b"\nV",
        b"R01",
    )
    assert [says(line) for line in bad] == len(bad) * [b"\a"]
    assert h.health()["crc_errors"] == len(bad)
    assert says(b"C") == b"\r"
    h.device.tick(0)
    assert says(b"") == b""
    assert says(b"V") == b"V0101\r"
    h.ticks += 1
    assert says(b"O") == b"\r"
    assert h.tick().state == IDLE
    assert says(stop.upper().replace("T", "t").encode()) == b""
    assert h.tick().state == FAULTED
