"""What a rig comes to, and what in it is questionable."""

from collections.abc import Callable
from pathlib import Path

import pytest

from dcmp_hil import TripError, run
from dcmp_hil.config import load_rig, shipped_rigs
from dcmp_hil.config.explain import explain, warnings
from tests.installed import Finished


def test_explain_lists_every_key_with_value_and_meaning() -> None:
    rows = {key: (value, meaning) for key, value, meaning in explain(load_rig("bench-1khz"))}
    assert rows["loop.rate_hz"] == ("1000", "Samples per second, Hz.")
    assert rows["observer.mu0_rad_s"][0] == "40 (by rule)"
    assert rows["observer.M_rad_s3"][0] == "15 (by rule)"
    assert all(meaning for _, meaning in rows.values())
    assert "trapezoid" in rows["reference.kind"][1]


def test_explain_lists_each_option_when_observer_is_custom() -> None:
    rig = load_rig("bench-1khz", ["observer.kind=lab:Mine", "observer.options={gain=7.0, name='x'}"])
    rows = {key: value for key, value, _ in explain(rig)}
    assert (rows["observer.options.gain"], rows["observer.options.name"]) == ("7", '"x"')


def test_explain_leaves_simulation_out_when_backend_is_another() -> None:
    rig = load_rig("bench-1khz", ["backend.kind=lab:Device"])
    assert not [key for key, _, _ in explain(rig) if key.startswith("sim.")]
    assert [key for key, _, _ in explain(load_rig("bench-1khz")) if key == "sim.seed"]


def test_shipped_rigs_have_no_warnings() -> None:
    assert [warnings(load_rig(name)) for name in shipped_rigs()] == [[]] * 4


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["observer.kind=paper"], "super_twisting"),
        (["observer.mu0_rad_s=0", "observer.M_rad_s3=300"], "runs away"),
        (["observer.mu0_rad_s=5"], "far from the rule's 40 rad/s"),
        (["controller.kd_1_s=50"], "will ring"),
        (["reference.soft_start_s=0"], "first command"),
        (["reference.amplitude_rad=7"], "will be held"),
        (["reference.kind=hold", "reference.position_rad=-7"], "will be held"),
        (["reference.kind=step", "reference.after_rad=7"], "will be held"),
        (["reference.kind=trapezoid", "reference.low_rad=-7"], "will be held"),
        (["reference.kind=chirp", "reference.offset_rad=-6"], "will be held"),
        (
            ["model.gravity_rad_s2=60", "model.ku_rad_s2_V=25"],
            "disturbance_limit_rad_s2 = 50. Set that to 79",
        ),
        (["observer.mu0_rad_s=121"], "far from the rule's 40 rad/s"),
        (["supervisor.monitors=finite"], "runaway"),
        (["supervisor.start=immediate"], "no ramp"),
    ],
)
def test_warnings_name_what_is_seldom_meant(overrides: list[str], words: str) -> None:
    (sentence,) = warnings(load_rig("bench-1khz", overrides))
    assert words in sentence


@pytest.mark.parametrize(
    "overrides",
    [
        ["observer.mu0_rad_s=119"],
        ["observer.mu0_rad_s=14"],
        ["controller.kd_1_s=64"],
        ["controller.kp_1_s2=0", "controller.kd_1_s=0"],
        ["reference.amplitude_rad=5.96"],
        ["reference.amplitude_rad=5.7", "reference.offset_rad=0.2"],
    ],
)
def test_warnings_are_silent_when_setting_is_just_inside(overrides: list[str]) -> None:
    assert warnings(load_rig("bench-1khz", overrides)) == []


def test_warnings_name_limit_when_csv_reference_leaves_it(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("time_s,position_rad\n0,0\n1,7\n2,0\n")
    overrides = ["reference.kind=csv", f"reference.file={tmp_path / 'way.csv'}"]
    (sentence,) = warnings(load_rig("bench-1khz", overrides))
    assert "will be held" in sentence
    assert warnings(load_rig("bench-1khz", [*overrides, "supervisor.position_limit_rad=8"])) == []


@pytest.mark.parametrize("kind", ["serial", "my_lab:Motor"])
def test_check_warns_of_a_start_without_a_probe_for_every_backend_with_a_motor(
    script: Callable[..., Finished], tmp_path: Path, kind: str
) -> None:
    methods = "__enter__ = __exit__ = read = write = truth = None"
    (tmp_path / "my_lab.py").write_text(f"class Motor:\n    {methods}\n")
    port = ["--set", "backend.port=/dev/ttyACM0"] if kind == "serial" else []
    done = script(
        "check", "bench-1khz", "--set", f"backend.kind={kind}", *port, "--set", "supervisor.probe=off"
    )
    assert done.code == 0, done.err
    assert "probe" in done.err
    assert "is found by running away" in " ".join(done.err.split())


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        (["amplifier.sign=-1"], "amplifier.sign = -1: a simulated rig is wired as its file says"),
        (["encoder.sign=-1"], "by --fault plant.enc_sign."),
        (["amplifier.sign=-1", "encoder.sign=-1"], "amplifier.sign and encoder.sign = -1: "),
    ],
)
@pytest.mark.parametrize("backend", ["sim", "sim-board"])
def test_sign_that_a_simulation_follows_is_told(sets: list[str], says: str, backend: str) -> None:
    (sentence,) = warnings(load_rig("bench-1khz", [*sets, f"backend.kind={backend}"]))
    assert says in sentence
    device = ["backend.kind=serial", "backend.port=/dev/ttyACM0"]
    assert warnings(load_rig("bench-1khz", [*sets, *device])) == []


def test_fault_that_the_warning_names_reverses_the_simulated_motor() -> None:
    rig = load_rig("bench-1khz", ["amplifier.sign=-1"])
    assert run(rig, duration=2.0, fast=True).summary.periods == 2000
    with pytest.raises(TripError, match="goes the wrong way"):
        run(rig, duration=2.0, fast=True, faults=["plant.motor_sign"])
