import random
from typing import Any

import pytest

from tests.firmware.bench import Core, database, decode, encode

C_NAMES = {"EDGE": "edge_stamp", "HEALTH": "health_report"}
MESSAGES = [message.name for message in database().messages]
FROM_HOST = ["STOP", "DRIVE", "HELLO", "PARAMETER_GET", "PARAMETER_SET"]


def _values(name: str, rng: random.Random, how: str) -> dict[str, int]:
    values = {}
    for signal in database().get_message_by_name(name).signals:
        low = -(1 << (signal.length - 1)) if signal.is_signed else 0
        high = low + (1 << signal.length) - 1
        values[signal.name] = {"low": low, "high": high}.get(how, rng.randint(low, high))
    values.pop("crc8")
    return values


@pytest.mark.parametrize("name", MESSAGES)
def test_packs_and_unpacks_as_cantools_does(core: Core, name: str) -> None:
    rng = random.Random(name)
    struct = f"struct dcmp_{C_NAMES.get(name, name.lower())} *"
    pack = getattr(core.lib, f"dcmp_pack_{name.lower()}")
    unpack = getattr(core.lib, f"dcmp_unpack_{name.lower()}")
    for how in ["low", "high"] + 300 * ["random"]:
        values, node = _values(name, rng, how), rng.randrange(16)
        frame = core.new("struct dcmp_frame *", (0, 0, [0xA5] * 8))
        pack(frame, node, core.new(struct, values))
        assert core.read(frame) == encode(name, node, **values)
        assert decode(*core.read(frame)) == (name, values)
        back: Any = core.new(struct)
        unpack(frame, back)
        assert {key: int(getattr(back, key)) for key in values} == values
        assert core.lib.dcmp_check_any(frame, node) == core.lib.DCMP_GENUINE


def test_more_bits_than_a_field_has_do_not_reach_its_neighbours(core: Core) -> None:
    frame = core.new("struct dcmp_frame *")
    wide = {"position_counts": 0xFF000001, "state": 0xFF, "fault_class": 0xF8}
    core.lib.dcmp_pack_sample(frame, 0, core.new("struct dcmp_sample *", wide))
    expected = {
        "position_counts": 1,
        "voltage_mV": 0,
        "state": 7,
        "fault_class": 0,
        "missed": 0,
        "limited": 0,
        "tick": 0,
    }
    assert decode(*core.read(frame)) == ("SAMPLE", expected)
    core.lib.dcmp_pack_drive(frame, 0, core.new("struct dcmp_drive *", {"seq": 0xFFFF}))
    assert decode(*core.read(frame))[1] == {
        "seq": 8191, "arm": 0, "clear": 0, "release": 0, "session": 0, "ttl_ms": 0, "voltage_mV": 0,
    }  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_who_a_frame_is_for(core: Core, name: str) -> None:
    number, payload = encode(name, 3, **_values(name, random.Random(2), "random"))
    lib = core.lib
    host = name in FROM_HOST
    assert lib.dcmp_check(core.frame(number, payload), 3) == (lib.DCMP_GENUINE if host else lib.DCMP_FOREIGN)
    damaged = core.frame(number, payload[:-1] + bytes([payload[-1] ^ 1]))
    assert lib.dcmp_check(damaged, 3) == (lib.DCMP_DAMAGED if host else lib.DCMP_FOREIGN)
    assert lib.dcmp_check(core.frame(number, payload), 4) == lib.DCMP_FOREIGN
    for length in range(9):
        if length != len(payload):
            assert (
                lib.dcmp_check(core.frame(number, payload[:length].ljust(length, b"\0")), 3)
                == lib.DCMP_FOREIGN
            )


def test_numbers_that_do_not_exist(core: Core) -> None:
    for number in [0, *range(0x0C0, 0x800, 16)]:
        for length in range(9):
            assert core.lib.dcmp_check_any(core.frame(number, bytes(length)), 0) == core.lib.DCMP_FOREIGN


def test_the_names_of_values_are_those_of_the_dbc_file(core: Core) -> None:
    def choices(message: str, signal: str) -> dict[str, int]:
        named = database().get_message_by_name(message).get_signal_by_name(signal).choices
        assert named is not None
        return {str(name): int(number) for number, name in named.items()}

    renamed = {"NONE": "NO_FAULT", "FAULT": "FAULTED"}
    for message, signal in [
        ("FAULT", "code"),
        ("SAMPLE", "state"),
        ("PARAMETER_GET", "id"),
        ("PARAMETER_VALUE", "result"),
    ]:
        for name, number in choices(message, signal).items():
            assert getattr(core.lib, f"DCMP_{renamed.get(name, name)}") == number
    for name in MESSAGES:
        assert getattr(core.lib, f"DCMP_{name}") == database().get_message_by_name(name).frame_id
