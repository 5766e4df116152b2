"""After any garbage, nothing arms and nothing drives; and the next good frame is understood."""

import random

import pytest

from tests.firmware.bench import Bench, Core
from tests.firmware.core.test_port import COBS, SLCAN, Port

ALPHABETS = {
    "any byte": b"",
    "slcan": b"tTrRSsVNFCOL\r\r0123456789ABCDEF",
    "zeros": b"\0\0\x01\x02\x03\x09\x0c\x20\x60",
}


@pytest.mark.parametrize("carrier", [COBS, SLCAN])
@pytest.mark.parametrize("alphabet", ALPHABETS)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_million_bytes(core: Core, carrier: int, alphabet: str, seed: int) -> None:
    letters = ALPHABETS[alphabet]
    bench = Bench(core)
    bench.hello()
    assert core.lib.check_garbage(carrier, bench.device, 1_000_000, seed, letters, len(letters)) == 0


@pytest.mark.parametrize("carrier", [COBS, SLCAN])
def test_in_step_again_within_one_good_frame(core: Core, carrier: int) -> None:
    rng = random.Random(7)
    for length in range(60):
        for _ in range(20):
            port = Port(core, carrier)
            port.receive(rng.randbytes(length))
            port.receive(port.hello())  # may be lost, joined to the garbage
            port.receive(port.hello())
            assert port.bench.device.session.owner == 77
