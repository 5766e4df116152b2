"""The short way to a named tuple ends where its constructor does."""

from __future__ import annotations

import pickle

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
