"""The encoder's state, variable by variable."""

import pytest

from tests.firmware.bench import Bench, Core

SPEED_LIMIT_COUNTS_S, PERIOD_US = 40_000, 1000
ENCODER_JUMP = 7


def test_speed_is_taken_over_1_and_2_and_8_ms_or_more(core: Core) -> None:
    encoder = core.new("struct dcmp_encoder *")
    for period in (*range(50, 1100), 4000, 7999, 8000, 45_000, 100_000):
        core.lib.dcmp_encoder_init(encoder, period)
        brief, full = -(-1000 // period), -(-8000 // period)
        found = [(window.periods, window.spare, window.us) for window in encoder.windows]
        wanted = [(brief, 1), (2 * brief, 2), (full, 1)]
        assert found == [(periods, spare, periods * period) for periods, spare in wanted]
        assert max(brief, full) + 3 <= len(encoder.past)


def test_position_is_the_middle_one_of_three(core: Core) -> None:
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, PERIOD_US)
    for newest in [(0, 100, 50), (100, 50, 0), (50, 0, 100), (7, 7, 9), (-3, -5, -4)]:
        for ago, position in enumerate((*newest, 200, 300)):
            encoder.past[-ago % len(encoder.past)] = position
        assert core.lib.dcmp_encoder_travel(encoder) == sorted(newest)[1]


@pytest.mark.parametrize("second", [5, 0xFFFFF0])
def test_jump_right_after_the_first_count(core: Core, second: int) -> None:
    """There is no count before the first: a wrong second one is not measured from 0."""
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, PERIOD_US)
    for counts, jumped in [(1000, False), (second, True), (1000, True), (1003, False)]:
        core.lib.dcmp_encoder_tick(encoder, counts, SPEED_LIMIT_COUNTS_S, PERIOD_US)
        assert encoder.jumped is jumped
        assert encoder.position == (3 if counts == 1003 else 0)
    assert encoder.jump == 1000 - (second if second < 1 << 23 else second - (1 << 24))


def test_jumps_before_run_count_at_the_next_one(core: Core) -> None:
    bench = Bench(core)
    for step in (1000, -1000, 1000, -1000):
        bench.counts += step
        bench.tick()
    bench.arm()
    bench.drive(100)
    bench.tick()
    assert bench.fault == (0, 0)
    bench.counts += 1000
    bench.tick()
    assert bench.fault == (ENCODER_JUMP, 1000)
