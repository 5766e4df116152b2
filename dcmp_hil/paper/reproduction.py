"""The runs of the reproduction: the paper's simulation, corrected and as printed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil.config import load_rig
from dcmp_hil.paper.measures import measure
from dcmp_hil.paper.rows import Misprint, Row, misprints, rows
from dcmp_hil.session import Session

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.result import Result

WINDOW_START_S = 1.0  # s: the paper judges its curves "after one second elapsed"

_PRINTED = "dcmp_hil.paper.printed"
VARIANTS = {
    "eq9": (f"observer.kind={_PRINTED}:PrintedEq9", "observer.options.from_zero=true"),
    "eq10": (f"controller.kind={_PRINTED}:PrintedEq10",),
    "eq8": (f"observer.kind={_PRINTED}:PrintedEq8", "observer.options.from_zero=true"),
    "M17": ("observer.M_rad_s3=17",),
}
"""What each misprint changes in the shipped rig `paper`; everything else is the corrected run."""


@dataclass(frozen=True, slots=True)
class Reproduction:
    """The paper, reproduced.

    Parameters
    ----------
    rows
        The quantities that judge the corrected equations.
    misprints
        What each misprint costs.
    corrected
        The corrected run, with its columns.
    """

    rows: tuple[Row, ...]
    misprints: tuple[Misprint, ...]
    corrected: Result


def reproduce() -> Reproduction:
    """Run the shipped rig `paper`, corrected and once for each misprint, and judge it.

    Everything is measured here; only what the paper claims, and the tolerances, are constants. It takes
    five runs of 20 s at 10 kHz in virtual time, and repeats to the bit.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C ended a run early: half a run would be judged like a whole one.
    """
    result = _run(())
    corrected = measure(result)
    variants = {name: measure(_run(overrides)) for name, overrides in VARIANTS.items()}
    return Reproduction(
        rows=rows(corrected, variants["eq9"], variants["eq10"]),
        misprints=misprints(corrected, variants),
        corrected=result,
    )


def _run(overrides: Sequence[str]) -> Result:
    session = Session(load_rig("paper", overrides), fast=True, window_from=WINDOW_START_S)
    session.run()
    if session.stop.requested:
        raise KeyboardInterrupt
    return session.result()
