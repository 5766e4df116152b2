"""Durations as people write them: with a unit, or a number of seconds."""

from __future__ import annotations

import pytest

from dcmp_hil.common.durations import seconds
from sim_backend.faults.fault_spec import FaultSpec


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10s", 10.0),
        ("10", 10.0),
        ("0", 0.0),
        (".5", 0.5),
        ("1e-3", 1e-3),
        ("2.5 s", 2.5),
        (" 200ms ", 0.2),
        ("1e3ms", 1.0),
        ("2min", 120.0),
        ("1.5h", 5400.0),
        ("250us", 250e-6),
        ("250\N{MICRO SIGN}s", 250e-6),
        ("250\N{GREEK SMALL LETTER MU}s", 250e-6),
        ("-1", -1.0),
    ],
)
def test_seconds_of_a_text(text: str, expected: float) -> None:
    assert seconds(text) == pytest.approx(expected)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "s",
        "10x",
        "10 sec",
        "nan",
        "inf",
        "1e400",
        "1e308h",
        "1,5s",
        "10s5",
        "\N{ARABIC-INDIC DIGIT ONE}s",
    ],
)
def test_what_is_no_duration_is_refused_with_a_remedy(text: str) -> None:
    with pytest.raises(ValueError, match="a time such as 3s, 200ms or 2min") as caught:
        seconds(text)
    assert f'got "{text}"' in str(caught.value)


def test_times_of_a_fault_are_read_alike() -> None:
    fault = FaultSpec.of("wire.drop:at=1min,for=250us")
    assert fault.at == 60.0
    assert fault.for_ == pytest.approx(250e-6)
