"""The options of `replay`: what they mean for a CSV file, and what for a run's own recording."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from dcmp_hil.cli.replay_variants import Variant, variants_of
from dcmp_hil.common.number_range import number
from dcmp_hil.config import load_tables
from dcmp_hil.config.compared_observers import kind_named
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings
from dcmp_hil.offline.settings import PERIOD_RANGE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from dcmp_hil.config.tables import RigTables

T = TypeVar("T", bound="RigTables")

IDEAL = "ideal"
_OPTION_KEYS = {  # short options for keys of a rig
    "observer": "observer.kind",
    "mu0": "observer.mu0_rad_s",
    "M": "observer.M_rad_s3",
    "L1": "observer.L1_1_s",
    "L2": "observer.L2_1_s2",
    "f0": "model.f0_1_s",
    "ku": "model.ku_rad_s2_V",
}
_FILE_TABLES = ("observer", "model", "encoder")


@dataclass(frozen=True)
class ReplayOptions:
    """The options as they were written; None or absent where one was not.

    Parameters
    ----------
    columns
        Names and units.
    file
        Period, no_input, modulus, input_at: what the file does not say.
    gains
        Short options for keys of `[observer]` and `[model]`.
    encoder
        Rig, inertia, counts_per_rev.
    figures
        Start and cutoff.
    overrides
        Of `--set`.
    variants
        Of `--compare`.
    """

    columns: Mapping[str, Any]
    file: Mapping[str, Any]
    gains: Mapping[str, Any]
    encoder: Mapping[str, Any]
    figures: Mapping[str, Any]
    overrides: tuple[str, ...]
    variants: tuple[str, ...] = ()

    def keys(self) -> tuple[str, ...]:
        """Return the short options and those of `--set` as overrides of a rig.

        Raises
        ------
        ConfigError
            If one key is given twice.
        """
        written = [override.partition("=")[0].strip() for override in self.overrides]
        twice = [option for option in _set(self.gains) if _OPTION_KEYS[option] in written]
        if twice:
            raise ConfigError(
                *(
                    f"--{option} and --set {_OPTION_KEYS[option]} say the same. Leave one out."
                    for option in twice
                )
            )
        return (
            *(f"{_OPTION_KEYS[name]}={_toml(value)}" for name, value in self._gains.items()),
            *self.overrides,
        )

    def compared(self, tables: T, allowed: Sequence[str]) -> list[Variant[T]]:
        """Return each variant of `--compare`; see `variants_of`."""
        return variants_of(self.variants, tables, allowed, full_key)

    def refused_of_a_run(self) -> list[str]:
        """Return the options that were given and mean nothing for a run's own recording."""
        given = {**self.columns, **self.file, **self.encoder, "cutoff": self.figures.get("cutoff")}
        return [f"--{name.replace('_', '-')}" for name in _set(given)]

    def column_options(self) -> ColumnOptions:
        """Return names, units and sampling of a file.

        Raises
        ------
        ConfigError
            If a number is none or out of range.
        """
        counts = self._counts()
        period = self.file.get("period")
        if period is not None and not PERIOD_RANGE.holds(period):
            raise ConfigError(
                f"--period: got {number(period)}; expected {PERIOD_RANGE.words('s')}. Give the time from row "
                "to row, or leave it out to take the stamps."
            )
        ku = any(key.partition("=")[0].strip() == _OPTION_KEYS["ku"] for key in self.keys())
        return ColumnOptions(
            **self.columns,
            no_input=bool(self.file.get("no_input")),
            prefer="torque" if self.encoder.get("inertia") is not None else "voltage" if ku else None,
            counts_per_rev=None if counts == IDEAL else counts,
            period=period,
            modulus=_modulus(self.file.get("modulus")),
        )

    def settings(self) -> ReplaySettings:
        """Return what observer, plant and figures of a file are.

        Raises
        ------
        ConfigError
            With every value that is out of range, or a key that a file has not.
        """
        return self._settings(self._tables)

    def compared_settings(self) -> list[tuple[Variant[RigTables], ReplaySettings]]:
        """Return each variant of `--compare` of a file, and its settings.

        Raises
        ------
        ConfigError
            If a variant is there twice, or cannot be made.
        """
        variants = self.compared(self._tables, _FILE_TABLES[:2])
        return [(variant, self._settings(variant.tables)) for variant in variants]

    def _settings(self, tables: RigTables) -> ReplaySettings:
        input_at = self.file.get("input_at")
        options = {
            "input_at": None if input_at is None else str(input_at),
            "counts_per_rev": self._counts(),
            "period": self.file.get("period"),
            "inertia": self.encoder.get("inertia"),
            **self.figures,
        }
        return ReplaySettings(**{**_settings_of(tables, named=self._named), **_set(options)})

    @property
    def _gains(self) -> dict[str, Any]:
        """Return the short options that were given."""
        observer = self.gains.get("observer")
        return _set({**self.gains, "observer": observer and kind_named(observer)})

    @property
    def _named(self) -> bool:
        return self.encoder.get("rig") is not None

    @cached_property
    def _tables(self) -> RigTables:
        """Return what `--rig`, `--set` and the short options say of a file."""
        for override in self.overrides:
            if override.partition(".")[0] not in _FILE_TABLES:
                raise ConfigError(
                    f"--set {override}: what was measured stays as it was; of a recording by another program "
                    "only keys of observer, model and encoder.counts_per_rev can be set."
                )
        keys = self.keys()
        numbers = _set({"inertia": self.encoder.get("inertia"), "cutoff": self.figures.get("cutoff")})
        _ = ReplaySettings(**self._gains, **numbers).section  # its faults name the short options, all at once
        return load_tables(self.encoder.get("rig"), keys)

    def _counts(self) -> Any:
        text = self.encoder.get("counts_per_rev")
        if text is None:
            return _settings_of(self._tables, named=self._named).get("counts_per_rev")
        if text.lower() == IDEAL:
            return IDEAL
        try:
            return float(text)
        except ValueError:
            raise ConfigError(
                f'--counts-per-rev: got "{text}". Write the counts after quadrature, such as 4096, or ideal.'
            ) from None


def keys_of(overrides: Iterable[str]) -> frozenset[str]:
    """Return the dotted keys that overrides name."""
    keys = (override.partition("=")[0] for override in overrides)
    return frozenset(".".join(part.strip() for part in key.split(".")) for key in keys)


def _settings_of(rig: RigTables, *, named: bool) -> dict[str, Any]:
    """Return a rig's observer, model and encoder as keys of `ReplaySettings`."""
    folders = tuple(dict.fromkeys((*rig.plugin_folders, Path())))
    found: dict[str, Any] = {"model": rig.model.values(), "observer": rig.observer, "folders": folders}
    if named or "ku_rad_s2_V" in rig.model.model_fields_set:
        found["ku"] = rig.model.ku_rad_s2_V
    if named or "counts_per_rev" in rig.encoder.model_fields_set:
        found["counts_per_rev"] = rig.encoder.counts_per_rev
    return found


def _set(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def full_key(override: str) -> str:
    """Return an override with the key that a short option stands for, if it names one."""
    key, equals, value = override.partition("=")
    key, value = key.strip(), value.strip()
    if key == "observer" and equals:
        value = kind_named(value)
    return f"{_OPTION_KEYS.get(key, key)}{equals}{value}"


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _modulus(text: str | None) -> Any:
    if text is None or text.lower() == "none":
        return text and "none"
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ConfigError(
            f'--modulus: got "{text}". '
            "Write how many of its units the position has before it wraps, such as "
            "65536, or none."
        )
    return value
