"""Every registry is walked: what is added to one is tested and shown, or a test here fails."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import pytest
import rerun.blueprint as rrb

from dcmp_hil.assembly import make_controller, make_observer
from dcmp_hil.config import kinds, load_rig
from dcmp_hil.config.backends import BackendSettings, CustomBackend, Device, SimBoard
from dcmp_hil.config.explain import warnings
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.sections import SimSection
from dcmp_hil.control.controllers.settings import ControllerSettings
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.control.references import ReferenceSettings
from dcmp_hil.device.links import registry
from dcmp_hil.device.links.listen_only import make_listening_link
from dcmp_hil.live.tunables import settable
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.plugins.named_class import find_named
from dcmp_hil.telemetry import signals
from dcmp_hil.telemetry.memory_sink import MemorySink
from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.rerun.blueprint import dashboard
from dcmp_hil.telemetry.rerun.histogram import HISTOGRAMS
from dcmp_hil.telemetry.rerun.plots import Known, plots
from dcmp_hil.telemetry.run_plot import draw_run
from dcmp_hil.telemetry.signals import SIGNALS, by_plot
from sim_backend.faults.fault_spec import KINDS as FAULTS
from sim_backend.plant import make_plant
from tests.contract.benches import ALL, on_bench
from tests.faults.rows import ROWS
from tests.helpers import bench
from tests.telemetry.runs import VIEW, feed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.common.section import Section

OWN = {KINDS[table]["custom"] for table in ("backend", "observer", "controller")}
SHIPPED = [kind for kind in KINDS["backend"] if kind != "custom"]
OTHER_COLOURS = ((1, 2, 3), (9, 8, 250))
MORE = (
    replace(SIGNALS[0], column="current_A", plot="motor/current_A", colour=OTHER_COLOURS[0]),
    replace(SIGNALS[0], column="angle_rad", plot="joint/angle_rad", colour=OTHER_COLOURS[1]),
)


def rig_of(kind: str, *overrides: str) -> Any:
    """Return the bench rig with a kind of backend, and the keys that it needs."""
    needed = [
        f"backend.{name}={field.examples[0]}"  # type: ignore[index]
        for name, field in KINDS["backend"].get(kind, CustomBackend).model_fields.items()
        if field.is_required() and name != "kind"
    ]
    return bench(f"backend.kind={kind}", *needed, *overrides)


# --------------------------------------------------------------------------------------------- backends


def test_every_kind_of_backend_has_a_factory_and_a_bench_of_the_contract_suite() -> None:
    assert list(registry.BACKENDS) == SHIPPED
    for kind, path in registry.BACKENDS.items():
        assert callable(find_named(path, kind))
    benched = set()
    for name in ALL:
        with on_bench(name) as there:
            benched.add(there.rig.backend.kind)
    assert benched == set(SHIPPED)


def test_every_carrier_of_the_board_in_this_process_is_on_a_bench() -> None:
    carriers = get_args(SimBoard.model_fields["carrier"].annotation)
    assert {f"sim-board {carrier}" for carrier in carriers} <= set(ALL)


def test_every_device_on_a_wire_can_be_listened_to() -> None:
    wired = [kind for kind in SHIPPED if KINDS["backend"][kind].device and not is_simulated(kind)]  # type: ignore[attr-defined]
    assert list(registry.LISTENERS) == wired
    for kind in wired:
        link = make_listening_link(rig_of(kind).backend, SimulatedClock())
        members = ("name", "corrupt", "pending", "open", "close", "send", "receive")
        assert all(hasattr(link, member) for member in members)


def is_simulated(kind: str) -> bool:
    return bool(KINDS["backend"][kind].simulated)  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", SHIPPED)
def test_what_a_backend_is_agrees_with_what_its_factory_says(kind: str) -> None:
    factory = find_named(registry.BACKENDS[kind], kind)
    assert is_simulated(kind) == getattr(factory, "simulated", False)
    assert issubclass(KINDS["backend"][kind], Device) == KINDS["backend"][kind].device  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", [*SHIPPED, "tests.helpers:LosesSamples"])
def test_a_start_without_a_probe_is_warned_of_where_a_motor_may_move(kind: str) -> None:
    moves = kind not in SHIPPED or not is_simulated(kind)
    warned = any(
        "supervisor.probe" in sentence for sentence in warnings(rig_of(kind, "supervisor.probe=off"))
    )
    assert warned == moves


# ----------------------------------------------------------------------------------- tables of the rig


@pytest.mark.parametrize("integrator", get_args(SimSection.model_fields["integrator"].annotation))
def test_every_integrator_has_a_plant(integrator: str) -> None:
    plant = make_plant(load_rig("bench-1khz", [f"sim.integrator={integrator}"]))
    assert plant.advance(1.0).velocity > 0.0


@pytest.mark.parametrize("table", KINDS)
def test_every_kind_is_a_word_that_its_table_takes(table: str) -> None:
    for kind, section in KINDS[table].items():
        assert kind == "custom" or kind in get_args(section.model_fields["kind"].annotation)


BASES: dict[str, type[Section]] = {
    "backend": BackendSettings,
    "observer": ObserverSettings,
    "controller": ControllerSettings,
    "reference": ReferenceSettings,
}


def derived(base: type[Section]) -> Iterator[type[Section]]:
    """Yield every class of settings in the package that makes a kind."""
    for settings in base.__subclasses__():
        if settings.__module__.startswith("dcmp_hil.") and "kind" in settings.model_fields:
            yield settings
        yield from derived(settings)


@pytest.mark.parametrize("table", BASES)
def test_every_class_of_settings_is_in_the_list_of_kinds(table: str) -> None:
    module = BASES[table].__module__
    room = module.removesuffix(".settings").removesuffix(".backends")
    for file in Path(str(import_module(module).__file__)).parent.glob("*.py"):
        import_module(room if file.stem == "__init__" else f"{room}.{file.stem}")
    assert set(derived(BASES[table])) == set(KINDS[table].values()) - OWN


@pytest.mark.parametrize("table", ["observer", "controller", "reference"])
def test_every_key_that_a_kind_calls_tunable_can_change_in_a_run(table: str, tmp_path: Path) -> None:
    (tmp_path / "csv").write_text("time_s,position_rad\n0,0\n1,0.5\n")
    for kind, section in KINDS[table].items():
        if section in OWN:
            continue
        keys = section.tunable()  # type: ignore[attr-defined]
        assert set(keys) <= section.model_fields.keys()
        needed = [f"reference.file={tmp_path / 'csv'}"] if kind == "csv" else []
        rig = bench(f"{table}.kind={kind}", *needed)
        assert [f"{table}.{key}" for key in keys] == [key for key in settable(rig) if key.startswith(table)]
        if keys and table == "observer":
            assert callable(getattr(make_observer(rig), "retune", None))
        if keys and table == "controller":
            assert isinstance(make_controller(rig).gains, tuple)  # type: ignore[attr-defined]


def test_every_kind_of_controller_says_which_position_it_gets() -> None:
    assert all("position" in section.model_fields for section in KINDS["controller"].values())


@pytest.mark.parametrize("table", ["observer", "controller"])
def test_every_shipped_kind_can_be_built(table: str) -> None:
    for kind, section in KINDS[table].items():
        assert (kind == "custom") != callable(getattr(section, "build", None))


def test_a_class_that_is_no_kind_of_its_table_is_refused() -> None:
    with pytest.raises(TypeError, match="is not derived from ObserverSettings"):
        kinds.union_of(ObserverSettings, kinds.CONTROLLERS)


# ------------------------------------------------------------------------------------------------ faults


def test_every_kind_of_fault_has_a_row_in_the_matrix() -> None:
    rows = {row.fault.partition(":")[0] for row in ROWS}
    assert set(FAULTS) == rows


# ----------------------------------------------------------------------------------------------- signals


def views(part: Any) -> Iterator[Any]:
    """Yield every view of a layout."""
    if isinstance(part, rrb.Container):
        for inner in part.contents:
            yield from views(inner)
    else:
        yield part


def test_every_plot_is_named_with_its_unit() -> None:
    assert [plot for plot in (*by_plot(), "motor/current_A") if not title(plot).endswith("]")] == []


@pytest.mark.parametrize("more", [(), MORE])
@pytest.mark.untraced
def test_every_plot_of_the_table_is_in_the_dashboard(
    monkeypatch: pytest.MonkeyPatch, more: tuple[signals.Signal, ...]
) -> None:
    monkeypatch.setattr(signals, "SIGNALS", (*SIGNALS, *more))
    for tripped in (False, True):
        layout = dashboard(VIEW, tripped=tripped).root_container
        shown = [str(view.origin) for view in views(layout)]
        assert all(shown.count(plot.path) == 1 for plot in plots())
        assert all(shown.count(one.entity) == 1 for one in HISTOGRAMS)
    assert {signal.plot for signal in more} <= {plot.path for plot in plots()} & by_plot().keys()


def test_a_signal_has_a_line_or_a_histogram_and_a_new_one_is_drawn_in_its_plot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    more = replace(SIGNALS[0], column="velocity_raw_rad_s", plot="joint/velocity_rad_s", label="raw")
    monkeypatch.setattr(signals, "SIGNALS", (*SIGNALS, more))
    drawn = {plot.path: plot.lines for plot in plots()}
    told = {column for lines in drawn.values() for line in lines for column in line.columns}
    assert told | {one.column for one in HISTOGRAMS} == {signal.column for signal in signals.SIGNALS}
    assert [line.label for line in drawn["joint/velocity_rad_s"]] == ["estimate", "reference", "raw"]
    assert drawn["joint/velocity_rad_s"][-1].read is more.read


def test_a_plot_has_three_lines_at_most() -> None:
    for known in (Known(truth, model) for truth in (True, False) for model in (True, False)):
        for plot in plots():
            assert sum(line.drawn(known) for line in plot.lines) <= 3
            assert plot.titled.endswith("]")


def test_every_plot_of_the_table_is_in_the_picture(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    image = pytest.importorskip("matplotlib.image")
    monkeypatch.setattr(signals, "SIGNALS", (*SIGNALS, MORE[0]))  # an odd number of plots
    draw_run(feed(MemorySink()), "with more", tmp_path / "run.png")
    pixels = image.imread(tmp_path / "run.png")[..., :3].reshape(-1, 3)
    found = {tuple(map(int, pixel)) for pixel in (pixels * 255).round().astype(int)}
    assert MORE[0].colour in found
