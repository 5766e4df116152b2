"""The encoder: true position to counted position, with noise on request."""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING

from dcmp_hil.control.counted_random import ENCODER_NOISE, CountedRandom
from dcmp_hil.control.elementary import floor

if TYPE_CHECKING:
    from dcmp_hil.config import Rig


class Encoder:
    """Quantises a position to encoder counts.

    Parameters
    ----------
    counts_per_rev
        Counts a revolution; None for an ideal encoder.
    phase
        Counts, where between two edges the zero lies; the mean error is 0 at every phase.
    noise
        Counts (rad with an ideal encoder), standard deviation of a Gaussian before the quantiser.
    seed
        Of the noise, and of the places of the edges.
    edges
        Counts: each edge of a turn lies up to this far from its place, at most half a count.
    """

    def __init__(
        self, counts_per_rev: float | None, *, phase: float, noise: float, seed: int, edges: float = 0.0
    ) -> None:
        self._count = 2.0 * math.pi / counts_per_rev if counts_per_rev else None
        self._phase = phase
        self._noise = noise
        self._edges: list[float] = []  # counts, of each edge of a turn from its place
        if counts_per_rev and edges:
            places = random.Random(f"edges {seed}")  # noqa: S311 - a simulation must repeat itself, not be secret
            self._edges = [places.uniform(-edges, edges) for _ in range(math.ceil(counts_per_rev))]
        self._exact = not noise and not self._edges
        self._normal = CountedRandom(seed, ENCODER_NOISE).normal
        self._reads = 0

    def read(self, position: float) -> float:
        """Return the measured position, rad; NaN of a position that is not finite."""
        if self._count is None:
            return position + self._drawn() if self._noise else position
        return self._count * (self._shown(position / self._count) - self._phase)

    def count(self, position: float) -> int:
        """Return the counter at a position (rad), unwrapped; an ideal encoder has none.

        Raises
        ------
        ValueError
            If the encoder is ideal.
        """
        if self._count is None:
            raise ValueError("an ideal encoder has no counts")
        return int(self._shown(position / self._count))

    def _shown(self, counts: float) -> float:
        """Return the counter at a position in counts, a whole number."""
        counts += self._phase
        if self._exact:
            return floor(counts + 0.5)
        if self._noise:
            counts += self._drawn()
        count = floor(counts + 0.5)
        if self._edges and math.isfinite(count):
            lower, upper = (self._edges[int(edge) % len(self._edges)] for edge in (count, count + 1.0))
            count += (counts >= count + 0.5 + upper) - (counts < count - 0.5 + lower)
        return count

    def _drawn(self) -> float:
        """Return the noise of the next reading."""
        self._reads += 1
        return self._noise * self._normal(self._reads - 1)


def make_encoder(rig: Rig) -> Encoder:
    """Make the encoder that a rig's `[encoder]` and `[sim]` describe."""
    return Encoder(
        rig.encoder.counts,
        phase=rig.sim.encoder_phase_counts,
        noise=rig.sim.encoder_noise_counts,
        seed=rig.sim.seed,
        edges=rig.sim.encoder_edge_counts,
    )
