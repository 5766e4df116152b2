"""R6 `friction_kalman` once more, from its equations in dense matrices: nothing is shared with the package.

One function per step: predict and spread (friction_reference_motion.py), measure, break away, judge, explain
by a step of d, correct, report.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.control.observers.friction_reference_motion import (
    PS,
    ZV,
    Arm,
    Matrix,
    Motion,
    Vector,
    predict,
    sign,
    spread,
)

RC = 0.35
STEP_AGE_S = 0.025


@dataclass(frozen=True)
class Innovation:
    """A measurement e = H (x - x_hat) + noise of variance R; `edge` is False for an excess."""

    e: float
    row: Vector
    variance: float
    edge: bool


def measure(x: Vector, dt: float, y: float, turned: int, arm: Arm, rho: float) -> Innovation | None:
    """Step 3: the newest edge if the count changed by `turned`; else the excess over the cell, if any."""
    x1, x2 = float(x[0]), float(x[1])
    half = arm.q / 2.0
    if turned != 0:
        edge = y - half if turned > 0 else y + half
        span = dt if x2 == 0.0 else min(dt, arm.q / abs(x2))
        row = np.array([1.0, -span / 2.0, 0.0, 0.0, 0.0])
        variance = rho * (arm.edge_counts * arm.q) ** 2 + (x2 * span) ** 2 / 12.0
        return Innovation(edge - (x1 - span * x2 / 2.0), row, variance, edge=True)
    if abs(y - x1) > half:
        e = (y - x1) - half * sign(y - x1)
        return Innovation(e, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), rho * (RC * arm.q) ** 2, edge=False)
    return None


def breaks_away(motion: Motion, p: Matrix, seen: Innovation) -> bool:
    """Tell if an edge was seen where a stuck arm cannot have passed it."""
    return motion.stuck and seen.edge and seen.e**2 > 9.0 * (p[0, 0] + seen.variance)


def break_away(motion: Motion, p: Matrix, e: float, dt: float, tau: float) -> tuple[Motion, Matrix]:
    """Release a stuck arm: d at the edge of slipping towards e, and x2 from the time between two counts."""
    x, p = motion.x.copy(), p.copy()
    others = motion.a - x[2]
    f = x[3]
    x[2] = f - others if e > 0.0 else -f - others
    x[1] = e / (2.0 * max(tau, 2.0 * dt))
    p[1, 1] = x[1] ** 2
    p[2, 2] += f**2
    p[0, 0] += e**2
    return Motion(x, motion.a, motion.sg, stuck=False, way=motion.way), p


def innovation_variance(p: Matrix, seen: Innovation) -> float:
    """Return S = H P H' + R."""
    return float(seen.row @ p @ seen.row) + seen.variance


@dataclass
class FrictionReference:
    """The whole filter, every step computed from dense matrices."""

    arm: Arm
    x: Vector = field(default_factory=lambda: np.zeros(5))
    p: Matrix = field(default_factory=lambda: np.eye(5))
    m: float = 1.0
    ms: float = 1.0
    mb: float = 0.0
    fast: float = 0.0
    slow: float = 0.0
    rho: float = 1.0
    tau: float = 0.0
    count: int = 0
    y_first: float = 0.0
    stuck: bool = False
    hypotheses: int = 0
    reached: list[str] = field(default_factory=list)
    """The branches of the last step."""

    def start(self, y: float) -> tuple[float, float, float]:
        """Take the first sample."""
        arm = self.arm
        self.x = np.array([y, 0.0, 0.0, arm.f1, 0.0])
        self.p = np.diag([arm.q**2 / 12.0, 1e-8, 1.0, arm.f1_uncertainty**2, PS**2])
        self.m = self.ms = self.rho = 1.0
        self.mb = self.fast = self.slow = self.tau = 0.0
        self.count, self.y_first, self.stuck, self.hypotheses, self.reached = 0, y, False, 0, ["starts"]
        return y, 0.0, 0.0

    def step(self, dt: float, y: float, u: float) -> tuple[float, float, float]:
        """Go on by `dt` s under u in rad/s2 and return x1, x2, w."""
        if dt <= 0.0:
            raise ValueError(dt)
        if dt > 10.02 * self.arm.period:
            return self.start(y)
        motion = predict(self.x, dt, u, self.arm)
        self.reached = [motion.way]
        self.p = spread(self.p, motion, dt, self.arm, m=self.m, ms=self.ms)
        if abs(motion.x[1]) < ZV:
            self.reached.append("reversal zone")
        count = round((y - self.y_first) / self.arm.q)
        turned, self.count = count - self.count, count
        self.tau += dt
        seen = measure(motion.x, dt, y, turned, self.arm, self.rho)
        if seen is not None and breaks_away(motion, self.p, seen):
            motion, self.p = break_away(motion, self.p, seen.e, dt, self.tau)
            self.reached.append("breaks away")
        if turned != 0:
            self.tau = 0.0
        self.x, self.stuck = motion.x, motion.stuck
        if seen is None:
            self.reached.append("no innovation")
            self.m = 1.0 + (self.m - 1.0) * float(np.exp(-dt / 0.04))
        else:
            self._name(seen, turned)
            self._judge(seen, dt)
            self._correct(seen)
        self.mb += (min(self.m, self.mb + 50.0) - self.mb) * dt / 0.3
        return self._report(u)

    def _name(self, seen: Innovation, turned: int) -> None:
        """Note which kind of innovation this is."""
        if not seen.edge:
            self.reached.append("excess")
            return
        self.reached.append("edge up" if turned > 0 else "edge down")
        if abs(turned) > 1:
            self.reached.append("several counts")

    def _judge(self, seen: Innovation, dt: float) -> None:
        """Step 4: what the innovation says of the encoder, of the model, and of a step of d."""
        total = innovation_variance(self.p, seen)
        nu = seen.e / float(np.sqrt(total))
        if seen.edge and self.m < 10.0:
            self.rho *= 1.0 + 0.02 * (min(nu**2, 9.0) - 1.5)
            self.reached.append("rho learns")
            if not 1.0 <= self.rho <= 30.0:
                self.rho = 1.0 if self.rho < 1.0 else 30.0
                self.reached.append(f"rho at {self.rho:.0f}")
        clipped = min(max(nu, -4.0), 4.0)
        self.slow += 0.04 * (clipped - self.slow)
        self.fast += 0.2 * (clipped - self.fast)
        self._multiply(dt)
        if (
            9.0 * self.fast**2 > 30.0
            and nu**2 > 1.0
            and nu * self.fast > 0.0
            and abs(self.x[1]) >= 0.1
            and self.mb < 2.5
        ):
            self._explain_by_a_step(seen, total)

    def _multiply(self, dt: float) -> None:
        """Set m and ms, the multipliers of the noise of d and s, by the slow mean."""
        z = 49.0 * self.slow**2 / 2.0
        mt = self.ms = 1.0
        if z > 1.0:
            mt = z**2
            self.ms = min(mt, 100.0)
            self.reached.append("cap of ms" if mt > 100.0 else "slow mean")
        self.m = mt if mt > self.m else mt + (self.m - mt) * float(np.exp(-dt / 0.04))
        if self.m > 300.0:
            self.m = 300.0
            self.reached.append("cap of m")

    def _explain_by_a_step(self, seen: Innovation, total: float) -> None:
        """Widen P by a step of d that happened `STEP_AGE_S` ago and would explain e."""
        age = STEP_AGE_S
        h = age**2 / 2.0 + float(seen.row[1]) * age
        if h < age**2 / 4.0:
            h = age**2 / 4.0
            self.reached.append("floor of h")
        s2 = (seen.e**2 - total) / h**2
        if s2 > 300.0**2:
            s2 = 300.0**2
            self.reached.append("cap of s2")
        v = np.array([age**2 / 2.0, age, 1.0, 0.0, 0.0])
        self.p = self.p + s2 * np.outer(v, v)
        self.fast /= 2.0
        self.hypotheses += 1
        self.reached.append("step hypothesis")

    def _correct(self, seen: Innovation) -> None:
        """Step 5: all five states by the gain of the newest P; f stays in [0, 4 f1]."""
        total = innovation_variance(self.p, seen)
        gain = self.p @ seen.row / total
        self.x = self.x + gain * seen.e
        self.p = self.p - total * np.outer(gain, gain)
        if self.x[3] < 0.0:
            self.x[3] = 0.0
            self.reached.append("f at 0")
        elif self.x[3] > 4.0 * self.arm.f1:
            self.x[3] = 4.0 * self.arm.f1
            self.reached.append("f at 4 f1")

    def _report(self, u: float) -> tuple[float, float, float]:
        """Step 6: position, velocity, and w without the motor and viscous friction."""
        x1, x2, d, f = (float(value) for value in self.x[:4])
        if x2 == 0.0:
            return x1, x2, -u
        return x1, x2, d - self.arm.g * float(np.sin(x1)) - f * sign(x2)
