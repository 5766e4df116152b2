"""The options of `replay`: what they mean for a CSV file, and what for a run's own recording."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.config import load_rig, load_table
from dcmp_hil.config.sections import Custom
from dcmp_hil.control.observers.paper import PaperSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ColumnOptions, ReplaySettings

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.config import Rig

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
_OF_A_FILE = ("observer", "model", "encoder")
_NO_RIG_TABLES = {"loop": {"rate_hz": 20_000.0}}  # the rate bounds mu0, and that of the recording is another


@dataclass(frozen=True)
class Given:
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
    """

    columns: Mapping[str, Any]
    file: Mapping[str, Any]
    gains: Mapping[str, Any]
    encoder: Mapping[str, Any]
    figures: Mapping[str, Any]
    overrides: tuple[str, ...]

    def keys(self) -> tuple[str, ...]:
        """Return the short options and those of `--set` as overrides of a rig.

        Raises
        ------
        ConfigError
            If one key is given twice.
        """
        gains = {**self.gains, "observer": _kind(self.gains.get("observer"))}
        short = tuple(f"{_OPTION_KEYS[name]}={_toml(value)}" for name, value in _set(gains).items())
        keys = [override.partition("=")[0].strip() for override in self.overrides]
        twice = [option for option, key in _OPTION_KEYS.items() if key in keys and option in _set(self.gains)]
        if twice:
            raise ConfigError(
                *(
                    f"--{option} and --set {_OPTION_KEYS[option]} say the same. Leave one out."
                    for option in twice
                )
            )
        return short + self.overrides

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
        if period is not None and not 1e-6 <= period <= 10.0:  # noqa: PLR2004 - as ReplaySettings
            raise ConfigError(
                f"--period: got {period:g} s, expected a number of at least 1e-06 and of at most 10. Give "
                "the time from row to row in seconds, or leave it out to take the stamps."
            )
        ku = self.gains.get("ku")
        return ColumnOptions(
            **self.columns,
            no_input=bool(self.file.get("no_input")),
            prefer="torque"
            if self.encoder.get("inertia") is not None
            else "voltage"
            if ku is not None
            else None,
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
        from_rig = self._from_rig()
        kind = _kind(self.gains.get("observer"))
        if kind is not None:
            from_rig["observer"] = kind
        input_at = self.file.get("input_at")
        options = {
            "input_at": None if input_at is None else str(input_at),
            "counts_per_rev": self._counts(),
            "period": self.file.get("period"),
            "inertia": self.encoder.get("inertia"),
            **{name: value for name, value in self.gains.items() if name != "observer"},
            **self.figures,
        }
        return ReplaySettings(**{**from_rig, **_set(options)})

    def _from_rig(self) -> dict[str, Any]:
        """Return what `--rig` and `--set` say, in the words of `ReplaySettings`."""
        self.keys()
        for override in self.overrides:
            if override.partition(".")[0] not in _OF_A_FILE:
                raise ConfigError(
                    f"--set {override}: what was measured stays as it was; of a recording by another program "
                    "only keys of observer, model and encoder.counts_per_rev can be set."
                )
        source = self.encoder.get("rig")
        if source is None and not self.overrides:
            return {}
        overrides = self.overrides
        kind = _kind(self.gains.get("observer"))
        if kind is not None:
            overrides = (f"observer.kind={_toml(kind)}", *overrides)
        rig = (
            load_table(deepcopy(_NO_RIG_TABLES), overrides) if source is None else load_rig(source, overrides)
        )
        return _settings_of(rig, named=source is not None)

    def _counts(self) -> Any:
        text = self.encoder.get("counts_per_rev")
        if text is None:
            return (
                self._from_rig().get("counts_per_rev") if self.encoder.get("rig") or self.overrides else None
            )
        if text.lower() == IDEAL:
            return IDEAL
        try:
            return float(text)
        except ValueError:
            raise ConfigError(
                f'--counts-per-rev: got "{text}". Write the counts after quadrature, such as 4096, or ideal.'
            ) from None


def _settings_of(rig: Rig, *, named: bool) -> dict[str, Any]:
    """Return a rig's observer, model and encoder as keys of `ReplaySettings`."""
    found: dict[str, Any] = {"model": rig.model.values(), "observer": rig.observer.kind}
    if named or "ku_rad_s2_V" in rig.model.model_fields_set:
        found["ku"] = rig.model.ku_rad_s2_V
    if named or "counts_per_rev" in rig.encoder.model_fields_set:
        found["counts_per_rev"] = rig.encoder.counts_per_rev
    section = rig.observer
    if isinstance(section, Custom):
        return {
            **found,
            "observer_options": dict(section.options),
            "folders": tuple(dict.fromkeys((*rig.plugin_folders, Path()))),
        }
    found |= {"L1": section.L1_1_s, "L2": section.L2_1_s2, "M": section.M_rad_s3}
    if isinstance(section, SuperTwistingSettings):
        found["mu0"] = section.mu0_rad_s
    if isinstance(section, PaperSettings):
        found["from_zero"] = section.start == "zero"
    return found


def _set(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _kind(observer: str | None) -> str | None:
    """Return an observer's kind as a rig spells it."""
    return observer if observer is None or ":" in observer else observer.lower().replace("-", "_")


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
