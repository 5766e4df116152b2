"""What may happen to a run, as rules that Hypothesis draws from."""

from __future__ import annotations

import math

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from dcmp_hil.errors import BackendError
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.wire.messages import Drive, Hello, Parameter, ParameterSet
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from tests.stateful.system import FAULTS, Start, System

VOLTAGES_V = st.one_of(
    st.floats(-3.0, 3.0),
    st.sampled_from([0.0, 10.0, -10.0, 40.0, 1e300, math.inf, -math.inf, math.nan]),
)
STARTS = st.builds(
    Start,
    st.sampled_from([0, 2**31 - 50_000, 2**32 - 50_000, 2**32 - 300_000]),
    st.sampled_from([0, 200, 8100, 2**31 - 100, 2**32 - 300]),
    st.sampled_from([0, 2**15 - 3, 2**23 - 400, 2**24 - 3, -(2**31) + 2]),
)
SILENCE_PERIODS = st.sampled_from([1, 2, 3, 9, 10, 18, 19, 20, 21, 22, 25, 40])
FIRST_PERIODS = st.sampled_from([0, 20])  # periods: after 20 a run has full authority
OTHER_SESSION = 0xBEEF


class Machine(RuleBasedStateMachine):
    """A run, its faults, and strangers on the line; at every step the judge has nothing to say."""

    steps = 0
    """Rules carried out by all machines together."""

    def __init__(self) -> None:
        super().__init__()
        self.system = System()

    @initialize(seed=st.integers(0, 1000), start=STARTS, periods=FIRST_PERIODS)
    def boot(self, seed: int, start: Start, periods: int) -> None:
        self.system = System(seed, start)
        self.open(periods)

    @rule(periods=st.integers(1, 4), volts=VOLTAGES_V)
    def run(self, periods: int, volts: float) -> None:
        for _ in range(periods):
            self.system.period(volts)

    @precondition(lambda self: self.system.host is not None)
    @rule(periods=st.integers(5, 15), volts=st.one_of(st.floats(-3.0, 3.0), st.just(40.0)))
    def run_on(self, periods: int, volts: float) -> None:
        for _ in range(periods):
            self.system.period(volts)

    @rule(ticks=SILENCE_PERIODS)
    def host_is_silent(self, ticks: int) -> None:
        self.system.alone(ticks)

    @rule(kind=st.sampled_from(sorted(FAULTS)), ticks=st.integers(1, 25))
    def fault(self, kind: str, ticks: int) -> None:
        self.system.inject_fault(kind, ticks)

    @rule(session=st.sampled_from([0, OTHER_SESSION]), wrong=st.booleans())
    def stranger_says_hello(self, session: int, wrong: bool) -> None:
        self.system.say(Hello(session, PROTOCOL_HASH ^ wrong))

    @rule(mV=st.integers(-32768, 32767), age=st.integers(-3, 12), arm=st.booleans(), own=st.booleans())
    def another_host_drives(self, mV: int, age: int, arm: bool, own: bool) -> None:  # noqa: N803
        session = self.system.board.owner if own else OTHER_SESSION
        self.system.alone(1)
        self.system.say(Drive(mV, self.system.seq(age), arm, False, False, session, 20))

    @rule(mV=st.integers(-3000, 3000), age=st.integers(4, 12), ticks=st.integers(15, 40))
    def owner_lags(self, mV: int, age: int, ticks: int) -> None:  # noqa: N803
        """Commands go on coming, and all of them are too old."""
        for _ in range(ticks):
            self.system.alone(1)
            seq, owner = self.system.seq(age), self.system.board.owner
            self.system.say(Drive(mV, seq, True, False, False, owner, 20))

    @rule(mV=st.sampled_from([0, 0, 1]), clear=st.booleans(), own=st.booleans())
    def another_host_clears(self, mV: int, clear: bool, own: bool) -> None:  # noqa: N803
        session = self.system.board.owner if own else OTHER_SESSION
        self.system.alone(1)
        self.system.say(Drive(mV, self.system.seq(), False, clear, False, session, 20))

    @rule(periods=st.integers(1, 11))
    def stranger_arms(self, periods: int) -> None:
        for _ in range(periods):
            self.system.say(Drive(0, self.system.seq(), True, False, False, OTHER_SESSION, 20))
            self.system.period()

    @rule(reason=st.integers(0, 255))
    def stop(self, reason: int) -> None:
        self.system.stop(reason)

    @rule(
        parameter=st.sampled_from([Parameter.VOLTAGE_LIMIT_MV, Parameter.WATCHDOG_MS, Parameter.PERIOD_US]),
        value=st.sampled_from([0, 4, 51, 20_000, 2**31 - 1]),
        own=st.booleans(),
    )
    def set_what_may_not_be(self, parameter: int, value: int, own: bool) -> None:
        self.system.say(ParameterSet(self.system.board.owner if own else OTHER_SESSION, parameter, value))

    @rule(watchdog=st.integers(5, 50))
    def lower_watchdog(self, watchdog: int) -> None:
        self.system.say(ParameterSet(self.system.board.owner, Parameter.WATCHDOG_MS, watchdog))

    @rule(back=st.integers(1, 40))
    def say_again(self, back: int) -> None:
        pieces = self.system.judge.heard_pieces
        if pieces:
            self.system.inject(pieces[-min(back, len(pieces))])

    @rule(noise=st.binary(min_size=1, max_size=20))
    def noise(self, noise: bytes) -> None:
        self.system.inject(noise)

    @rule()
    def reset(self) -> None:
        self.system.reset()

    @precondition(lambda self: self.system.host is not None)
    @rule(volts=VOLTAGES_V)
    def careless_write(self, volts: float) -> None:
        """A write past the supervisor cannot get a number that is none onto the wire."""
        assert self.system.host is not None
        backend = self.system.host.backend
        try:
            backend.read()
        except BackendError as error:
            self.system.close(error)
            return
        backend.write(volts)

    @precondition(lambda self: self.system.host is not None)
    @rule(volts=st.floats(-3.0, 3.0))
    def objection(self, volts: float) -> None:
        assert self.system.host is not None
        self.system.host.objector.objects = True
        self.system.period(volts)

    @precondition(lambda self: self.system.host is not None)
    @rule(volts=st.floats(-3.0, 3.0), periods=st.sampled_from([1, 10, 60]))
    def orderly_end(self, volts: float, periods: int) -> None:
        host = self.system.host
        assert host is not None
        host.supervisor.stop(TripRequest("test", "an orderly end", "", Urgency.RAMP), host.sample.t)
        for _ in range(periods):
            self.system.period(volts)

    @precondition(lambda self: self.system.host is not None)
    @rule()
    def close(self) -> None:
        self.system.close()

    @precondition(lambda self: self.system.host is None)
    @rule(periods=FIRST_PERIODS)
    def open(self, periods: int) -> None:
        if self.system.open():
            for _ in range(periods):
                self.system.period()

    @precondition(lambda self: self.system.host is None)
    @rule(ticks=st.sampled_from([10, 30, 60, 505]))
    def no_host_is_there(self, ticks: int) -> None:
        self.system.alone(ticks)

    def teardown(self) -> None:
        """Remove every fault; then the system runs again."""
        if not self.system.violations:
            self.system.run_again()
        self.judged()

    @invariant()
    def judged(self) -> None:
        Machine.steps += 1
        if self.system.violations:
            raise AssertionError(self.system.violations[0])
