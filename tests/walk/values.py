"""What each option is tried with. Flags and lists of choices are found by themselves; the rest stands here.

Names in braces are filled in by `world.py`. A value is a list of words; an empty one leaves the option out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.walk.streams import STREAMS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.walk.surface import Option

Value = tuple[str, ...]
OUT: Value = ()
STREAM = "output"
"""The factor beside the options: where the command's output goes."""


def given(option: str, *values: str) -> tuple[Value, ...]:
    """Return what leaves an option out, and gives it each of these values."""
    return (OUT, *((option, value) for value in values))


def _columns() -> dict[str, tuple[Value, ...]]:
    units = {"time": "s", "position": "rad", "torque": "Nm", "voltage": "V", "velocity": "rad/s"}
    names = {"time": "t", "position": "q", "torque": "tau", "voltage": "u", "velocity": "v"}
    return {f"--{what}": given(f"--{what}", name) for what, name in names.items()} | {
        f"--{what}-unit": given(f"--{what}-unit", unit) for what, unit in units.items()
    }


VALUES: Mapping[str, Mapping[str, tuple[Value, ...]]] = {
    "run": {
        "RIG": (OUT, ("{rig}",)),
        "--set": given("--set", "reference.amplitude_rad=0.7"),
        "--duration": (("--duration", "1200ms"),),
        "--from": given("--from", "300ms"),
        "--record": given("--record", "{folder}/other.rrd"),
        "--json": given("--json", "{folder}/figures.json", "-"),
        "--note": given("--note", "µ → ≤"),
        "--fault": given("--fault", "plant.shove:at=600ms,for=50ms", "wire.drop:p=0.01,at=600ms,for=100ms"),
        "--compare": given("--compare", "friction_kalman,derivative"),
    },
    "check": {"RIG": (("bench-1khz",), ("{rig}",)), "--set": given("--set", "loop.rate_hz=500")},
    "sweep": {
        "SPEC": (("{sweep}",),),
        "--out": (("--out", "{folder}/results"),),
        "--workers": given("--workers", "1"),
        "--scheduler": (OUT,),
        "--json": given("--json", "{folder}/figures.json", "-"),
    },
    "paper": {
        "--out": given("--out", "{folder}/figures"),
        "--json": given("--json", "{folder}/figures.json", "-"),
    },
    "replay": {
        "FILE": (("{csv}",), ("{recording}",)),
        "--set": given("--set", "observer.mu0_rad_s=150"),
        "--compare": given("--compare", "observer=paper", "kalman,derivative"),
        **_columns(),
        "--inertia": given("--inertia", "0.16"),
        "--ku": given("--ku", "5.4"),
        "--counts-per-rev": given("--counts-per-rev", "4096"),
        "--period": given("--period", "0.001"),
        "--modulus": given("--modulus", "65536"),
        "--rig": given("--rig", "{rig}"),
        "--observer": given("--observer", "super_twisting", "paper"),
        "--f0": given("--f0", "6"),
        "--mu0": given("--mu0", "150"),
        "--M": given("--M", "4000"),
        "--L1": given("--L1", "400"),
        "--L2": given("--L2", "30000"),
        "--from": given("--from", "300ms"),
        "--cutoff": given("--cutoff", "15"),
        "--json": given("--json", "{folder}/figures.json", "-"),
        "--csv": given("--csv", "{folder}/again.csv"),
        "--rrd": given("--rrd", "{folder}/again.rrd"),
    },
    "export": {
        "FILE": (("{recording}",),),
        "--csv": given("--csv", "{folder}/run.csv"),
        "--parquet": given("--parquet", "{folder}/run.parquet"),
        "--rrd": given("--rrd", "{folder}/again.rrd"),
    },
    "rigs": {"--copy": (OUT, ("--copy", "bench-1khz", "{folder}/copy.toml"))},
    "view": {"--port": (("--port", "{served}"),)},
    "completion": {"SHELL": (("bash",), ("zsh",), ("fish",))},
    "device": {
        "RIG": (OUT, ("{rig}",)),
        "--set": given("--set", "encoder.counts_per_rev=8192"),
        "--symlink": given("--symlink", "{folder}/port"),
    },
    "ports": {
        "PORT": (("{device}",),),
        "--baud": given("--baud", "921600"),
        "--bitrate": given("--bitrate", "1000000"),
        "--wait": given("--wait", "0.5"),
    },
    "monitor": {
        "RIG": (("bench-serial",),),
        "--set": (("--set", "backend.port={device}"),),
        "--duration": (("--duration", "0.3s"),),
    },
    "conform": {
        "PORT": (("{device}",),),
        "--interface": given("--interface", "virtual"),
        "--baud": given("--baud", "921600"),
        "--bitrate": given("--bitrate", "500000"),
        "--node": given("--node", "0"),
        "--only": (("--only", "identity"),),
        "--json": given("--json", "{folder}/figures.json", "-"),
    },
    "set": {
        "CHANGES": (("controller.kp_1_s2=4100",), ("reference.amplitude_rad=0.9", "controller.kd_1_s=130")),
        "--run": (OUT, ("--run", "{pid}")),
    },
    "stop": {"--run": (OUT, ("--run", "{pid}"))},
    "status": {"--run": (OUT, ("--run", "{pid}"))},
    "panel": {
        "--port": (("--port", "{port}"),),
        "--run": given("--run", "{pid}"),
        "--viewer": given("--viewer", "http://127.0.0.1:9090"),
    },
}


def factors(command: str, options: tuple[Option, ...]) -> dict[str, tuple[Value, ...]]:
    """Return what each option of a command is tried with, and where its output goes.

    Raises
    ------
    KeyError
        If an option is neither a flag nor a list of choices, and has no row here.
    """
    rows = VALUES.get(command, {})
    found = {option.name: _values(command, option, rows) for option in options}
    return found | {STREAM: tuple((stream,) for stream in STREAMS)}


def _values(command: str, option: Option, rows: Mapping[str, tuple[Value, ...]]) -> tuple[Value, ...]:
    if option.name in rows:
        return rows[option.name]
    if option.is_flag:
        return OUT, (option.name,)
    if option.choices:
        return given(option.name, *option.choices)
    raise KeyError(
        f"tests/walk/values.py has no row for `{command} {option.name}`: say what it is tried with"
    )
