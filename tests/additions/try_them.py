"""Run in a copy of the package to which one of each kind was added: each of them is found and works."""

from __future__ import annotations

import json
import sys
from typing import Any

from dcmp_hil import load_rig, run
from dcmp_hil.config.explain import warnings
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.schema import rig_schema
from dcmp_hil.config.suggestions import for_unknown_kind
from dcmp_hil.device.links.listen_only import make_listening_link
from dcmp_hil.live.tunable_ranges import tunable_descriptions
from dcmp_hil.live.tunables import changed
from dcmp_hil.offline import ReplaySettings
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.telemetry.signals import by_plot
from sim_backend.faults.fault_spec import FaultSpec
from sim_backend.plant import make_plant
from tests.contract.benches import PUMPED, WIRED, on_bench

_SHORT = {"duration": 1.5, "fast": True}


def _tunables(*overrides: str) -> list[str]:
    return [one["key"] for one in tunable_descriptions(load_rig("bench-1khz", overrides))]


def _change(kind: str, change: str) -> Any:
    return changed(load_rig("bench-1khz", [kind]), [change])[1]


def _on_the_wire() -> list[float]:
    with on_bench("cobs tcp") as bench, bench.make() as backend:
        link = make_listening_link(bench.rig.backend, SimulatedClock())
        assert link.name.startswith("127.0.0.1:")
        assert any("supervisor.probe" in one for one in warnings(load_rig("bench-1khz", _WIRED_RIG)))
        volts = []
        for _ in range(5):
            volts.append(backend.read().voltage)
            backend.write(2.0)
        return volts


def _weak() -> list[float]:
    """Return how much of a demand is left before and behind the fault's beginning."""
    faults = [FaultSpec.of("host.weak:factor=0.5,at=1s")]
    with_it, without = (
        run(load_rig("bench-1khz"), duration=1.5, fast=True, faults=one) for one in (faults, ())
    )
    demands = [one.columns["voltage_demand_V"] for one in (with_it, without)]
    return [round(float(demands[0][place] / demands[1][place]), 3) for place in (999, 1000)]


def _pushed() -> float:
    """Return the angle of a resting arm after one period at 0 V, rad."""
    return make_plant(load_rig("bench-1khz", ["sim.integrator=pushed"])).advance(0.0).position


_WIRED_RIG = ("backend.kind=tcp", "backend.tcp_port=5000", "supervisor.probe=off")
_OBSERVER, _CONTROLLER = "observer.kind=luenberger", "controller.kind=proportional"


def main() -> None:
    """Print what was found, as JSON."""
    plain = run(load_rig("bench-1khz", [_OBSERVER, _CONTROLLER, "reference.kind=approach"]), **_SHORT)  # type: ignore[arg-type]
    schema = json.dumps(rig_schema())
    found = {
        "observer": [
            "luenberger" in KINDS["observer"],
            "luenberger" in for_unknown_kind("observer", "x"),
            "LuenbergerSettings" in schema,
            "observer.bandwidth_rad_s" in _tunables(_OBSERVER),
            _change(_OBSERVER, "observer.bandwidth_rad_s=50").tuning == 50.0,
            ReplaySettings(observer="luenberger").section.kind == "luenberger",
        ],
        "controller": [
            "ProportionalSettings" in schema,
            "controller.kp_V_rad" in _tunables(_CONTROLLER),
            _change(_CONTROLLER, "controller.kp_V_rad=60").gains == (60.0, 5.0),
        ],
        "reference": [
            "Approach" in schema,
            "reference.time_constant_s" in _tunables("reference.kind=approach"),
            _change("reference.kind=hold", "reference.kind=approach").reference is not None,
        ],
        "link": [
            "TcpSettings" in schema,
            {"cobs tcp"} <= {*PUMPED, *WIRED},
            _on_the_wire() == [0.0, 0.0, 2.0, 2.0, 2.0],
        ],
        "signal": [
            "control/asked_V" in by_plot(),
            len(plain.columns["asked_V"]) == len(plain.columns["time_s"]),
        ],
        "plant": [_pushed() > 0.0, "`pushed`: a constant torque" in schema],
        "fault": [_weak() == [1.0, 0.5]],
    }
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
