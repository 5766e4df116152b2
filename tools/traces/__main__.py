"""`python -m tools.traces`: write the traces of the firmware's core; with --check say which are stale."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import unpack
from dcmp_hil.wire.messages import FaultReport, SampleReport, State
from tests.contract.firmware_device import Firmware
from tools.traces.scenarios import BUILT, SCENARIOS
from tools.traces.steps import Recorder, read

if TYPE_CHECKING:
    from tools.traces.scenarios import Scenario
    from tools.traces.steps import Step

_ROOT = Path(__file__).resolve().parents[2]
PAGE = _ROOT / "docs/protocol.md"
FOLDER = _ROOT / "firmware/proto/traces"
_OTHER_FAULT_CLASS = 7  # fault class of every code from 7 on
_MARKS = re.compile(r"(<!-- traces: [^\n]*-->\n).*?(<!-- /traces -->)", re.DOTALL)


def record(scenario: Scenario) -> list[Step]:
    """Play a scenario on the core and return its steps."""
    host = Recorder(Firmware(carrier="can", **(BUILT | dict(scenario.built))))
    scenario.play(host)
    return host.steps


def files() -> dict[Path, str]:
    """Return every trace and the page, by file."""
    traces = {name: record(scenario) for name, scenario in SCENARIOS.items()}
    page, places = _MARKS.subn(
        lambda found: f"{found[1]}\n{_table(traces)}\n{found[2]}", PAGE.read_text("utf-8")
    )
    if places != 1:
        raise ValueError(f"{PAGE.name} has {places} places for traces, marked by <!-- traces: ... -->")
    return {FOLDER / f"{name}.json": _trace(SCENARIOS[name], steps) for name, steps in traces.items()} | {
        PAGE: page
    }


def _trace(scenario: Scenario, steps: list[Step]) -> str:
    """Lay a trace out, a step a line."""
    lines = ",\n".join(f"  {json.dumps(step)}" for step in steps)
    return (
        f'{{"shows": {json.dumps(scenario.shows)},\n "built": {json.dumps(BUILT | dict(scenario.built))},\n'
        f' "steps": [\n{lines}\n ]}}\n'
    )


def _table(traces: dict[str, list[Step]]) -> str:
    lines = [
        "| trace | shows | what changes, after which tick |",
        "|---|---|---|",
        *(
            f"| [{name}](../firmware/proto/traces/{name}.json) | {SCENARIOS[name].shows} "
            f"| {_changes(steps)} |"
            for name, steps in traces.items()
        ),
    ]
    return "\n".join(lines) + "\n"


def _changes(steps: list[Step]) -> str:
    """Return when the state changed."""
    tick, state, said = -1, "BOOT", []
    for step in steps:
        between = "tick" not in step
        tick = step.get("tick", tick)
        if step["state"] != state:
            state = step["state"]
            said.append(f"{tick}{'+' if between else ''} {state}{_cause(steps, step)}")
    return ", ".join(said)


def _cause(steps: list[Step], step: Step) -> str:
    """Name the fault of the step, as the next SAMPLE and FAULT tell it."""
    if step["state"] != State.FAULT.name:
        return ""
    at = next(i for i, one in enumerate(steps) if one is step)
    sent = [unpack(read(text)) for one in steps[at:] for text in one.get("sent", ())]
    known = (one.fault_class for one in sent if isinstance(one, SampleReport))
    code = next((code for code in known if code), 0)
    if code == _OTHER_FAULT_CLASS:
        code = next(one.code for one in sent if isinstance(one, FaultReport))
    return f"({Fault(code).name})"


def main() -> None:
    """Write the files, or with --check say which are not as they should be."""
    made = files()
    stale = {
        path: text for path, text in made.items() if not path.exists() or path.read_text("utf-8") != text
    }
    left_over = set(FOLDER.glob("*.json")) - set(made)
    if "--check" in sys.argv[1:]:
        for path in (*stale, *left_over):
            sys.stdout.write(f"{path.relative_to(_ROOT)} is not what the core does: python -m tools.traces\n")
        sys.exit(bool(stale or left_over))
    FOLDER.mkdir(exist_ok=True)
    for path in left_over:
        path.unlink()
    for path, text in stale.items():
        path.write_text(text, encoding="utf-8")
        sys.stdout.write(f"wrote {path.relative_to(_ROOT)}\n")


if __name__ == "__main__":
    main()
