"""Faults as text: `wire.drop:p=0.2,at=3s,for=1s`."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from dcmp_hil.common.number_range import NumberRange
from dcmp_hil.common.similar_names import did_you_mean
from sim_backend.faults.fault_model import Number

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from sim_backend.faults.fault_model import Choice, Kind, Value

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)")
_SECONDS_PER_UNIT = {"s": 1.0, "ms": 1e-3, "": 1.0}
_PERCENT_RATIO = 0.01
_START_TIME_S = NumberRange(0.0, 1e6)


class WrongFaultError(ValueError):
    """Something about one fault is wrong; `faults` says what, each in a sentence."""

    def __init__(self, faults: Iterable[str]) -> None:
        super().__init__("\n".join(faults))
        self.faults = tuple(faults)


def parse(text: str, kinds: Mapping[str, Kind]) -> tuple[str, dict[str, Value]]:
    """Return the kind's name and what is said of it; `at` and `for` among it, in s.

    Raises
    ------
    WrongFaultError
        With everything that is wrong.
    """
    name, colon, rest = text.partition(":")
    name = name.strip()
    if name not in kinds:
        raise WrongFaultError([f'"{name}" is no kind of fault. {_meant(name, kinds)}'])
    said, faults = {}, []
    for item in rest.split(",") if colon else ():
        key, equals, value = (part.strip() for part in item.partition("="))
        try:
            said[key] = _value(key, value if equals else "", kinds[name])
        except ValueError as error:
            faults.append(f"{name}: {error}")
    if faults:
        raise WrongFaultError(faults)
    return name, said


def _value(key: str, text: str, kind: Kind) -> Value:
    if key in ("at", "for"):
        return _time(key, text)
    if key not in kind.params:
        raise ValueError(unknown_parameter(key, [*kind.params, "at", "for"]))
    param = kind.params[key]
    if not isinstance(param, Number):
        return text if text in param.words else check(key, text, param)
    number, unit = _split(key, text, param)
    if unit == "%" and param.unit == "":
        number, unit = number * _PERCENT_RATIO, ""
    if unit == "s" and param.unit == "ms":
        number, unit = 1e3 * number, "ms"
    if unit not in ("", param.unit):
        raise ValueError(f'{key}: got "{text}"; expected {param.allowed.words(param.unit)}.')
    return check(key, number, param)


def _time(key: str, text: str) -> Value:
    if key == "at" and text == "boot":
        return text
    found = _NUMBER.fullmatch(text)
    if found and found[2] in _SECONDS_PER_UNIT:
        value = float(found[1]) * _SECONDS_PER_UNIT[found[2]]
        if _START_TIME_S.holds(value):
            return value
    words = 'a time such as 3s or 200ms, or "boot"' if key == "at" else "a time such as 3s or 200ms"
    raise ValueError(f'{key}: got "{text}"; expected {words}.')


def _split(key: str, text: str, param: Number) -> tuple[float, str]:
    found = _NUMBER.fullmatch(text)
    if found is None:
        raise ValueError(f'{key}: got "{text}"; expected {param.allowed.words(param.unit)}.')
    return float(found[1]), found[2]


def check(key: str, value: Value, param: Number | Choice) -> Value:
    """Return a parameter's value.

    Raises
    ------
    ValueError
        If it is none that the parameter may have.
    """
    if not isinstance(param, Number):
        if value not in param.words:
            raise ValueError(f'{key}: got "{value}"; expected {" or ".join(param.words)}.')
        return value
    if isinstance(value, str) or not param.allowed.holds(value):
        raise ValueError(f"{key}: got {value}; expected {param.allowed.words(param.unit)}.")
    return value


def unknown_parameter(got: str, known: Iterable[str]) -> str:
    """Return in words that a fault has no such parameter, and which it has."""
    return f'"{got}" is no parameter. {_meant(got, known)}'


def _meant(got: str, known: Iterable[str]) -> str:
    names = list(known)
    return did_you_mean(got, names, f"Known: {', '.join(names)}.")
