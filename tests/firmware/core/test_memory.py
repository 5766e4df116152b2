"""What was in memory before does not show in what begins anew."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.firmware.bench import Core

WINDOWS = {
    f".windows[{i}].{field}": value
    for i, window in enumerate(((4, 1, 1200), (8, 2, 2400), (27, 1, 8100)))
    for field, value in zip(("periods", "spare", "us"), window, strict=True)
}
BEGINNINGS: dict[str, tuple[str, tuple[int, ...], dict[str, int]]] = {
    "dcmp_amplifier": ("dcmp_amplifier_cut", (), {}),
    "dcmp_encoder": ("dcmp_encoder_init", (300,), WINDOWS),
    "dcmp_health": ("dcmp_health_init", (), {}),
    "dcmp_history": ("dcmp_history_init", (), {}),
    "dcmp_session": ("dcmp_session_end", (), {}),
    "dcmp_supervisor": ("dcmp_supervisor_init", (), {}),
    "dcmp_watchdog": ("dcmp_watchdog_feed", (7, 20, 50), {".fed_us": 7, ".time_us": 20_000}),
}
"""What begins how, and what is not 0 then."""


def fields(core: Core, thing: Any, name: str = "") -> Iterator[tuple[str, int]]:
    """Yield every number in a structure or an array."""
    kind = core.ffi.typeof(thing) if isinstance(thing, core.ffi.CData) else None
    if kind is None:
        yield name, int(thing)
    elif kind.kind == "array":
        for i, each in enumerate(thing):
            yield from fields(core, each, f"{name}[{i}]")
    else:
        for field, _ in kind.fields:
            yield from fields(core, getattr(thing, field), f"{name}.{field}")


def dirty(core: Core, name: str) -> Any:
    """Return a structure in memory that was used: all ones would be no `bool`."""
    thing = core.new(f"struct {name} *")
    size = core.ffi.sizeof(f"struct {name}")
    core.ffi.buffer(thing)[:] = b"\x01" * size
    return thing


@pytest.mark.parametrize("name", BEGINNINGS)
def test_each_part_begins_with_nothing(core: Core, name: str) -> None:
    function, arguments, expected = BEGINNINGS[name]
    thing = dirty(core, name)
    getattr(core.lib, function)(thing, *arguments)
    assert {field: value for field, value in fields(core, thing[0]) if value} == expected


def test_parameters_begin_as_the_board_was_built(core: Core) -> None:
    new, used = core.new("struct dcmp_parameters *"), dirty(core, "dcmp_parameters")
    for parameters in (new, used):
        core.lib.dcmp_parameters_init(parameters, core.config(edge_stamps=False))
    assert dict(fields(core, new[0])) == dict(fields(core, used[0]))
    assert new.value[0] == 0
    for number in (0, 1, 2, 3, 4, 5, 6, 13, 14):
        assert (new.range[number].lowest, new.range[number].highest) == (1, 0)


@pytest.mark.parametrize(("period_us", "valid"), [(1000, True), (49, False)])
def test_a_device_begins_anew(core: Core, period_us: int, valid: bool) -> None:
    new, used = core.new("struct dcmp_device *"), dirty(core, "dcmp_device")
    for device in (new, used):
        assert core.lib.dcmp_device_init(device, core.config(period_us=period_us), 77) is valid
    assert dict(fields(core, new[0])) == dict(fields(core, used[0]))
    assert (new.health_in, new.repeat, new.oldest) == ((100, 100, 3) if valid else (0, 0, 0))
    assert (new.watchdog.fed_us, new.watchdog.time_us, new.fault_in) == (77 * valid, 0, 0)
