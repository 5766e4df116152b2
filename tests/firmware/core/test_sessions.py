import pytest

from tests.firmware.bench import Bench, Core

IDLE, RUN, FAULT = 1, 3, 4
LEASE_US = 500_000


def test_hello(core: Core) -> None:
    bench = Bench(core)
    identity = {"protocol_hash": core.lib.check_protocol_hash(), "firmware_version": 0x0102}
    assert bench.hello(0) == identity | {"busy": 0, "owned": 0, "mismatch": 0}
    assert bench.hello(5, wrong=1) == identity | {"busy": 0, "owned": 0, "mismatch": 1}
    assert bench.hello(5) == identity | {"busy": 0, "owned": 1, "mismatch": 0}
    assert bench.hello(5) == identity | {"busy": 0, "owned": 1, "mismatch": 0}
    assert bench.hello(6) == identity | {"busy": 1, "owned": 0, "mismatch": 0}
    assert bench.hello(6, wrong=1 << 31) == identity | {"busy": 1, "owned": 0, "mismatch": 1}
    assert bench.hello(0) == identity | {"busy": 1, "owned": 0, "mismatch": 0}
    assert bench.hello(5, wrong=1) == identity | {"busy": 0, "owned": 1, "mismatch": 1}


def test_a_second_host_changes_nothing(core: Core) -> None:
    bench = Bench(core)
    bench.run(5000)
    assert bench.hello(9)["busy"] == 1
    assert not bench.drive(-5000, session=9)
    assert bench.ask("PARAMETER_SET", session=9, id=7, value=5)["result"] == 4
    assert not bench.drive(0, arm=0, release=1, session=9)
    assert bench.drive(5000)
    assert bench.tick() == (5000, True)


def test_stop_is_obeyed_from_every_host(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.send("STOP", reason=3)
    assert bench.state == FAULT


def test_release(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    assert bench.drive(5000, arm=0, release=1)
    assert bench.state == IDLE
    assert bench.output() == (0, False)
    assert bench.hello(9)["owned"] == 1


@pytest.mark.parametrize("start", [0, 0xFFFF0000])
@pytest.mark.parametrize("renewal", ["HELLO", "PARAMETER_SET", "DRIVE"])
def test_lease(core: Core, start: int, renewal: str) -> None:
    bench = Bench(core, start=start)
    bench.hello()
    for _ in range(3):
        bench.advance(LEASE_US - 1)
        assert bench.hello(9)["busy"] == 1
        if renewal == "HELLO":
            bench.hello()
        elif renewal == "DRIVE":
            bench.device.tick += 1
            assert bench.drive(arm=0)
        else:
            assert bench.ask("PARAMETER_SET", session=0x1234, id=1, value=0)["result"] == 2
    bench.advance(LEASE_US)
    assert bench.hello(9)["owned"] == 1


def test_a_lease_ends_by_a_tick_too(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.tick(499)
    assert bench.device.session.owner == 0x1234
    bench.tick()
    assert bench.device.session.owner == 0


def test_what_does_not_renew_a_lease(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    for _ in range(499):
        bench.tick()
        bench.hello(wrong=1)
        bench.hello(0)
        bench.drive(age=4)
        bench.drive(ttl_ms=0)
        bench.ask("PARAMETER_GET", id=1)
        bench.ask("PARAMETER_SET", session=3, id=9, value=20)
    assert bench.device.session.owner == 0x1234
    bench.tick()
    assert bench.device.session.owner == 0


def test_no_lease_ends_in_run(core: Core) -> None:
    bench = Bench(core)
    bench.arm()
    bench.device.session.heard_us = (bench.now - 2 * LEASE_US) % (1 << 32)
    bench.tick()
    assert bench.state == RUN
    assert bench.hello(9)["busy"] == 1


def test_a_new_owner_finds_the_fault_as_it_was(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.send("STOP", reason=2)
    bench.tick(600)
    assert bench.hello(9)["owned"] == 1
    bench.tick()
    assert bench.fault == (3, 2)
    assert bench.sample["state"] == FAULT


def test_no_owner_has_no_lease_and_asks_for_none(core: Core) -> None:
    session = core.new("struct dcmp_session *")
    for owner in (0, 1, 0xFFFF):
        session.owner = owner
        assert core.lib.dcmp_session_lapsed(session, LEASE_US) is (owner != 0)
        session.owner = 0
        assert core.lib.dcmp_session_ask(session, owner, 0) is (owner != 0)


def test_a_new_owner_inherits_nothing(core: Core) -> None:
    session = core.new("struct dcmp_session *", (0, 5, True, 6, 7))
    assert core.lib.dcmp_session_ask(session, 9, 77)
    assert (session.owner, session.heard_us, session.has_predecessor) == (9, 77, False)
    assert (session.seq, session.step) == (0, 0)
