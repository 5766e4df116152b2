"""The short way to a named tuple ends where its constructor does."""

from __future__ import annotations

import pickle
from pathlib import Path

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.values import Estimate, Sample


def test_it_makes_what_the_constructor_makes() -> None:
    for kind, fields in ((Estimate, (1.0, 2.0, 3.0)), (Sample, (1.0, 2.0, 3.0, 4))):
        made = make(kind, fields)  # type: ignore[arg-type]
        assert type(made) is kind
        assert made == kind(*fields)
        assert pickle.loads(pickle.dumps(made)) == made  # noqa: S301 - our own


def test_its_type_is_that_of_the_tuple() -> None:
    made: Estimate = make(Estimate, (1.0, 2.0, 3.0))
    assert made._replace(velocity=5.0).velocity == 5.0


def test_it_is_used_in_the_cycle_alone_with_the_gain_beside_the_line() -> None:
    root, used = Path(__file__).parents[2], set()
    for file in (*(root / "dcmp_hil").rglob("*.py"), *(root / "sim_backend").rglob("*.py")):
        text = file.read_text("utf-8")
        if "from dcmp_hil.common.fast_tuple import make" not in text:
            continue
        used.add(str(file.relative_to(root)).removeprefix("dcmp_hil/"))
        if file.name != "layouts.py":  # generated, all messages in one form
            assert text.count(" us less") == text.count(" make(") + text.count("(make("), file
    assert used == {
        *("loop.py", "control/predictor.py", "control/references/periodic.py"),
        *("control/observers/friction_kalman/observer.py", "control/observers/friction_kalman/predictor.py"),
        *("control/observers/super_twisting.py", "device/backend.py", "wire/layouts.py"),
        *(
            "sim_backend/backend.py",
            "sim_backend/core_plant.py",
            "sim_backend/hardware.py",
            "sim_backend/plant.py",
        ),
    }
