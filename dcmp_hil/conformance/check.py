"""Check of a device, and its result."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from dcmp_hil.conformance.terms import CARRIERS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.conformance.client import Client


class Verdict(StrEnum):
    """Verdicts of a check."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_JUDGED = "not judged"
    NEEDS_ARM = "needs --arm"
    OTHER_CARRIER = "other carrier"


@dataclass(frozen=True, slots=True)
class DeviceCheck:
    """A requirement of the page, and the function that checks it.

    Parameters
    ----------
    name
        What it is called, from release to release.
    section
        Of docs/protocol.md.
    says
        What the page says, as a sentence.
    run
        Asks the device; yields a sentence for everything that is not so.
    needs_arm
        Whether it sends a DRIVE with `arm` = 1: the motor may move.
    timed
        Whether a host that answers too late may be the cause of a finding. What needs_arm is timed, too.
    carriers
        On which it means anything.
    """

    name: str
    section: str
    says: str
    run: Callable[[Client], Iterator[str]]
    needs_arm: bool = False
    timed: bool = False
    carriers: tuple[str, ...] = CARRIERS


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a check.

    Parameters
    ----------
    check
        Which.
    verdict
        How it ended.
    findings
        A sentence for each thing that is not as the page says; else the reason why it was not judged.
    """

    check: DeviceCheck
    verdict: Verdict
    findings: tuple[str, ...] = ()
