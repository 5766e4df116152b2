"""`dcmp-hil run` in virtual time: figures, folder, exit codes."""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from dcmp_hil import load_rig, run
from tests.cli.conftest import Outcome

Cli = Callable[..., Outcome]

PROMISED = {
    *("tracking_rms_rad", "tracking_max_rad", "velocity_error_rms_rad_s", "velocity_error_max_rad_s"),
    *("disturbance_error_rms_rad_s2", "voltage_peak_V", "voltage_tv_V_s", "periods", "late_periods"),
    *("period_us", "lateness_us", "compute_us", "rate_error_ppm", "realtime_factor", "window_s"),
    *("overruns", "outliers", "engine", "engine_reason", "realtime", "host"),
}


def test_run_gives_promised_keys_when_json_goes_to_stdout(cli: Cli) -> None:
    outcome = cli("run", "--fast", "--no-record", "--duration", "2", "--from", "1", "--json", "-")
    figures = json.loads(outcome.out)
    assert outcome.code == 0
    assert figures.keys() >= PROMISED
    assert figures["periods"] == 1000
    assert figures["window_s"] == pytest.approx([1.0, 2.0])
    assert (
        set(figures["period_us"])
        == set(figures["lateness_us"])
        == set(figures["compute_us"])
        == {"p50", "p99", "p999", "max"}
    )
    assert figures["period_us"]["max"] == 1000.0  # us, virtual time
    assert figures["late_periods"] == figures["overruns"] == 0
    assert figures["rate_error_ppm"] == pytest.approx(0.0, abs=1e-6)
    assert figures["realtime"] == {}  # virtual time asks for nothing
    assert (figures["engine"], figures["engine_reason"]) == ("core", "")
    assert figures["host"]["cpus"] >= 1


def test_run_equals_python_api_when_rig_is_the_same(cli: Cli) -> None:
    outcome = cli("run", "--fast", "--no-record", "--duration", "3", "--json", "-")
    summary = run(load_rig("bench-1khz"), duration=3.0, fast=True).summary
    assert json.loads(outcome.out)["tracking_rms_rad"] == summary.tracking_rms_rad


def test_run_leaves_figures_recording_and_picture_without_a_viewer(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("run", "--fast", "--duration", "1", "--note", "first light")
    (folder,) = (tmp_path / "runs").iterdir()
    assert outcome.code == 0
    assert folder.name.endswith("-bench-1khz")
    assert {"summary.json", "run.rrd", "run.png"} <= {path.name for path in folder.iterdir()}
    figures = json.loads((folder / "summary.json").read_text())
    assert figures["note"] == "first light"
    assert figures["rig_toml"]["loop"]["rate_hz"] == 1000
    assert str(folder.relative_to(tmp_path)) in outcome.err


def test_run_writes_nothing_when_told_so(cli: Cli, tmp_path: Path) -> None:
    assert cli("run", "--fast", "--duration", "1", "--no-record").code == 0
    assert list(tmp_path.iterdir()) == []


def test_run_puts_recording_where_told(cli: Cli, tmp_path: Path) -> None:
    target = tmp_path / "mine.rrd"
    assert cli("run", "--fast", "--duration", "1", "--no-record", "--record", str(target)).code == 0
    assert target.stat().st_size > 10_000


def test_run_shows_every_figure_when_on_screen(cli: Cli) -> None:
    outcome = cli("run", "--fast", "--no-record", "--duration", "1")
    for words in (
        "tracking error",
        "velocity error",
        "disturbance error",
        "total variation",
        "speed",
    ):
        assert words in outcome.out
    assert "how often" not in outcome.out  # in virtual time every period is the nominal one


def test_run_exits_4_and_keeps_black_box_when_it_trips(cli: Cli, tmp_path: Path) -> None:
    shove = ("--fault", "plant.shove:at=3s,for=100ms", "--set", "supervisor.disturbance_limit_rad_s2=1000")
    outcome = cli("run", "--fast", "--duration", "5", *shove, "--set", "supervisor.velocity_limit_rad_s=2")
    (folder,) = (tmp_path / "runs").iterdir()
    figures = json.loads((folder / "summary.json").read_text())
    with (folder / "black_box.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert outcome.code == 4
    assert outcome.err.count("error:") == 1
    assert (outcome.out + outcome.err).count("2 rad/s") == 1  # the trip says itself once
    assert figures["ended_by"] == "speed"
    assert len(rows) == 1000  # one second at 1 kHz
    moved, took = (float(rows[-1][key]) - float(rows[-9][key]) for key in ("position_rad", "t_s"))
    assert abs(moved) / took > 2.0  # the cycle that tripped is the last one; the run's own observer is slower
    assert float(rows[-1]["voltage_sent_V"]) == 0.0
    assert float(rows[-1]["t_s"]) - float(rows[0]["t_s"]) == pytest.approx(0.999)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "bench-1kHz", "--fast"), "bench-1khz"),
        (("run", "--set", "loop.rat_hz=5", "--fast"), "rate_hz"),
        (("run", "--set", "loop.rate_hz=fast", "--fast"), "loop.rate_hz"),
        (("run", "--set", "sim.step_us=300", "--fast"), "sim.step_us"),
        (("run", "--set", "amplifier.voltage_limit_mV=5000", "--fast"), "voltage_limit_V"),
        (("run", "--set", "controller.kind=nowhere:Thing", "--fast", "--no-record"), "controller.kind"),
        (("run", "--duration", "-1", "--no-record"), "duration"),
        (("run", "--duration", "nan", "--no-record"), "duration"),
        (("run", "--fast", "--duration", "0", "--no-record"), "duration"),
        (("run", "--fast", "--duration", "5", "--from", "6", "--no-record"), "window"),
        (("run", "no/such/file.toml",), "no/such/file.toml"),
        (("run", "--fast", "--duration", "1", "--no-record", "--record", "no/such/place/a.rrd"), "a.rrd"),
        (("run", "--fast", "--duration", "1", "--no-record", "--json", "no/such/place/a.json"), "a.json"),
        (("check", "nope"), "nope"),
        (("rigs", "--copy", "nope", "x.toml"), "nope"),
        (("replay", "nope.csv"), "nope.csv"),
    ],
)  # fmt: skip
def test_cli_exits_2_with_words_and_no_traceback_when_input_is_bad(
    cli: Cli, arguments: tuple[str, ...], words: str
) -> None:
    outcome = cli(*arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert "Traceback" not in outcome.err + outcome.out


def test_run_leaves_no_folder_when_the_rig_is_bad(cli: Cli, tmp_path: Path) -> None:
    assert cli("run", "--fast", "--set", "loop.rate_hz=0").code == 2
    assert list(tmp_path.iterdir()) == []


def test_run_exits_2_when_folder_cannot_be_made(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file in the way")
    outcome = cli("run", "--fast", "--duration", "1")
    assert outcome.code == 2
    assert "--no-record" in outcome.err


def test_run_lowers_the_arm_when_rig_says_so(cli: Cli) -> None:
    outcome = cli("run", "--fast", "--no-record", "--duration", "4", "--set", "run.end=lower", "--json", "-")
    figures = json.loads(outcome.out)
    assert outcome.code == 0
    assert math.isclose(figures["periods"], 6001, abs_tol=2)  # 4 s, and 2 s down


def test_check_lists_every_key_when_rig_is_right(cli: Cli) -> None:
    outcome = cli("check", "bench-1khz", "--set", "loop.rate_hz=500")
    assert outcome.code == 0
    for words in ("loop.rate_hz", "500", "controller.kp_1_s2", "4000", "no faults"):
        assert words in outcome.out


def test_check_names_every_fault_at_once(cli: Cli) -> None:
    outcome = cli("check", "bench-1khz", "--set", "loop.rate_hz=-1", "--set", "controller.kd_1_s=true")
    assert outcome.code == 2
    assert outcome.err.count("error:") >= 2
    assert "loop.rate_hz" in outcome.err
    assert "controller.kd_1_s" in outcome.err


def test_rigs_lists_and_copies(cli: Cli, tmp_path: Path) -> None:
    listed = cli("rigs")
    copied = cli("rigs", "--copy", "bench-1khz", str(tmp_path / "mine.toml"))
    assert "paper" in listed.out
    assert "bench-1khz" in listed.out
    assert copied.code == 0
    assert cli("run", str(tmp_path / "mine.toml"), "--fast", "--duration", "1", "--no-record").code == 0
    again = cli("rigs", "--copy", "bench-1khz", str(tmp_path / "mine.toml"))
    assert again.code == 2  # never overwrites


def test_version_is_printed(cli: Cli) -> None:
    assert cli("--version").out.startswith("dcmp-hil 0.")


def test_help_names_every_command(cli: Cli) -> None:
    out = cli("--help").out
    for command in ("run", "check", "paper", "replay", "rigs"):
        assert command in out


def test_fast_run_by_the_loop_says_so_and_why(cli: Cli) -> None:
    by_loop = cli("run", "--fast", "--no-record", "--duration", "0.2", "--set", "sim.engine=python")
    assert by_loop.code == 0
    said = " ".join(by_loop.out.split())
    assert 'the loop of the host ran it, not the core: sim.engine is "python".' in said
    assert by_loop.err == ""
    in_core = cli("run", "--fast", "--no-record", "--duration", "0.2")
    assert "the loop of the host" not in in_core.out
