import random

import fastcrc

from tests.firmware.bench import Core


def test_the_check_values_of_the_page(core: Core) -> None:
    assert core.lib.dcmp_crc8(b"123456789", 9) == 0xDF
    assert core.lib.dcmp_crc16(b"123456789", 9) == 0x29B1


def test_any_bytes(core: Core) -> None:
    rng = random.Random(1)
    for length in range(40):
        data = rng.randbytes(length)
        assert core.lib.dcmp_crc8(data, length) == fastcrc.crc8.autosar(data)
        assert core.lib.dcmp_crc16(data, length) == fastcrc.crc16.ibm_3740(data)


def test_the_hash_is_that_of_the_dbc_file(core: Core) -> None:
    import hashlib

    from tests.firmware.core_library import DBC

    lines = [line.strip() for line in DBC.read_text().splitlines()]
    kept = "".join(f"{line}\n" for line in lines if line.startswith(("BO_ ", "SG_ ", "VAL_ ")))
    assert core.lib.check_protocol_hash() == int.from_bytes(hashlib.sha256(kept.encode()).digest()[:4], "big")
