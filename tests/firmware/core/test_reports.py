"""What the device says of its own accord, in which order, and what it forgets."""

from typing import Any

from tests.firmware.bench import Bench, Core


def _edge(core: Core, **fields: Any) -> Any:
    return core.new(
        "struct dcmp_edge *", {"counts": 0x1FFFFFF, "age_us": 400, "direction": -1, "seen": True} | fields
    )


def test_health_ten_times_a_second(core: Core) -> None:
    for period, ticks in [(1000, 100), (300, 334), (100000, 1)]:
        bench = Bench(core, period_us=period, boot=False)
        bench.tick(4 * ticks)
        reports = [i for i, (name, _) in enumerate(bench.seen) if name == "HEALTH"]
        assert reports == [ticks + i * (ticks + 1) for i in range(4)]


def test_what_health_counts(core: Core) -> None:
    bench = Bench(core)
    lib = core.lib
    bench.corrupt(1)
    for _ in range(2):
        lib.dcmp_device_overrun(bench.device)
    for _ in range(3):
        lib.dcmp_device_link(bench.device, False, bench.now)
        lib.dcmp_device_link(bench.device, False, bench.now)
        lib.dcmp_device_link(bench.device, True, bench.now)
        lib.dcmp_device_link(bench.device, True, bench.now)
    for _ in range(4):
        lib.dcmp_device_late_tick(bench.device)
    lib.dcmp_device_idle(bench.device, 87)
    bench.hello()
    for _ in range(5):
        bench.drive(age=4)
    bench.tick(100)
    (report,) = [fields for name, fields in bench.seen if name == "HEALTH"]
    counted = ["crc_errors", "ring_overruns", "bus_offs", "late_ticks", "sequence_gaps", "idle_percent"]
    assert [report[name] for name in counted] == [1, 2, 3, 4, 5, 87]


def test_counters_stop_at_255(core: Core) -> None:
    bench = Bench(core)
    for _ in range(300):
        bench.corrupt()
        core.lib.dcmp_device_late_tick(bench.device)
    report = bench.device.health.report
    assert (report.crc_errors, report.late_ticks) == (255, 255)
    for percent, said in [(99, 99), (100, 100), (101, 100), (255, 100)]:
        core.lib.dcmp_device_idle(bench.device, percent)
        assert report.idle_percent == said


def test_ten_corrupt_frames_among_a_hundred(core: Core) -> None:
    """In the order bad, 10 good, bad, ...: exactly the last hundred frames count."""
    for good, code in [(9, 4), (10, 4), (11, 0)]:
        bench = Bench(core)
        bench.arm()
        for _ in range(10):
            bench.send("PARAMETER_GET", id=1)
        for _ in range(9):
            bench.corrupt()
            assert bench.fault[0] == 0
            for _ in range(good):
                bench.send("PARAMETER_GET", id=1)
        bench.corrupt()
        assert bench.fault == (code, 10 if code else 0)


def test_the_window_is_exact(core: Core) -> None:
    history = core.new("struct dcmp_history *")
    core.lib.dcmp_history_init(history)
    pushed = []
    state = 12345
    for _ in range(3000):
        state = state * 1103515245 + 12345 & 0x7FFFFFFF
        bad = state >> 16 & 3 == 0
        pushed.append(bad)
        core.lib.dcmp_history_add(history, bad)
        assert history.count == sum(pushed[-100:])


def test_a_wrong_checksum_is_corrupt_and_a_foreign_frame_is_not(core: Core) -> None:
    bench = Bench(core)
    for payload in (bytes(8), bytes(7), bytes(2)):
        core.lib.dcmp_device_receive(bench.device, core.frame(0x020, payload), bench.now)
        core.lib.dcmp_device_receive(bench.device, core.frame(0x021, payload), bench.now)
        core.lib.dcmp_device_receive(bench.device, core.frame(0x040, payload), bench.now)
    assert bench.device.health.report.crc_errors == 1
    assert bench.device.health.frames.count == 1


def test_corrupt_frames_before_run_count_at_the_next_one(core: Core) -> None:
    bench = Bench(core)
    bench.corrupt(30)
    bench.arm()
    assert bench.fault == (0, 0)
    bench.corrupt()
    assert bench.fault == (4, 31)


def test_edge_stamps(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.tick(edge=_edge(core))
    assert "EDGE" not in dict(bench.seen)
    assert bench.ask("PARAMETER_SET", session=0x1234, id=12, value=1)["result"] == 0
    bench.tick(edge=_edge(core, seen=False))
    bench.tick()
    assert "EDGE" not in dict(bench.seen)
    bench.seen.clear()
    bench.tick(edge=_edge(core))
    assert [name for name, _ in bench.seen] == ["SAMPLE", "EDGE"]
    tick = bench.device.tick % 256
    assert bench.seen[1][1] == {"position_counts": 0xFFFFFF, "age_us": 400, "tick": tick, "direction": -1}


def _blocked_tick(bench: Bench, edge: Any = None) -> None:
    bench.advance(1000)
    bench.lib.dcmp_device_tick(
        bench.device, bench.now, bench.counts, bench.core.ffi.NULL if edge is None else edge
    )


def test_a_blocked_link_brings_no_old_samples(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.ask("PARAMETER_SET", session=0x1234, id=12, value=1)
    bench.device.health.report.ring_overruns = 0
    _blocked_tick(bench, _edge(core))
    for _ in range(49):
        bench.counts += 1
        _blocked_tick(bench)
    assert bench.device.health.report.ring_overruns == 49
    taken = bench.take()
    assert [name for name, _ in taken] == ["SAMPLE"]
    assert taken[0][1]["tick"] == bench.device.tick % 256
    assert taken[0][1]["position_counts"] == 49


def test_the_order_on_the_wire(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.ask("PARAMETER_SET", session=0x1234, id=12, value=1)
    bench.device.health_in = 1
    bench.send("PARAMETER_GET", id=4)
    bench.send("STOP", reason=1)
    bench.send("HELLO", session=0, protocol_hash=0)
    _blocked_tick(bench, _edge(core))
    taken = bench.take()
    assert [n for n, _ in taken] == ["FAULT", "SAMPLE", "EDGE", "HEALTH", "PARAMETER_VALUE", "IDENTITY"]
    assert taken[4][1]["value"] == taken[1][1]["tick"]


def test_sixteen_answers_wait_and_no_more(core: Core) -> None:
    bench = Bench(core)
    for round_ in range(3):
        for _ in range(5 + 8 * round_):
            bench.send("PARAMETER_GET", id=2)
        assert len(bench.take()) == min(5 + 8 * round_, 16)
    assert bench.device.health.report.ring_overruns == 5


def test_answers_do_not_outlive_the_link(core: Core) -> None:
    bench = Bench(core)
    bench.send("PARAMETER_GET", id=2)
    core.lib.dcmp_device_link(bench.device, False, bench.now)
    core.lib.dcmp_device_link(bench.device, True, bench.now)
    assert bench.take() == []


def test_a_device_with_another_node(core: Core) -> None:
    bench = Bench(core, node=5)
    bench.arm()  # take() looks at the node of every frame sent
    core.lib.dcmp_device_receive(bench.device, core.frame(0x010, bytes(2)), bench.now)
    assert bench.state == 3
    bench.send("STOP", reason=0)
    assert bench.state == 4
