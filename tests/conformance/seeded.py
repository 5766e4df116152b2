"""Every device with an error, by what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.conformance import seeds_drives, seeds_motor, seeds_sessions, seeds_wire

if TYPE_CHECKING:
    from tests.conformance.seed import Row

SEEDS: dict[str, Row] = {
    **seeds_wire.SEEDS,
    **seeds_sessions.SEEDS,
    **seeds_drives.SEEDS,
    **seeds_motor.SEEDS,
}
