"""The one list of kinds: a line here makes a class of settings a kind of its table in rig.toml."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args

from pydantic import BaseModel, Discriminator, Tag

from dcmp_hil.config.backends import BackendSettings, CustomBackend
from dcmp_hil.config.sections import Custom, CustomController
from dcmp_hil.control.controllers.settings import ControllerSettings
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.control.references import ReferenceSettings

# The first of a list is the default. A kind is called by the words of its field `kind`.
BACKENDS = (
    "dcmp_hil.config.backends:Sim",
    "dcmp_hil.config.backends:SimBoard",
    "dcmp_hil.config.backends:Serial",
    "dcmp_hil.config.backends:Can",
)
OBSERVERS = (
    "dcmp_hil.control.observers.super_twisting:SuperTwistingSettings",
    "dcmp_hil.control.observers.friction_kalman.settings:FrictionKalmanSettings",
    "dcmp_hil.control.observers.derivative:DerivativeSettings",
    "dcmp_hil.control.observers.extended_state:ExtendedStateSettings",
    "dcmp_hil.control.observers.kalman:KalmanSettings",
    "dcmp_hil.control.observers.paper:PaperSettings",
)
CONTROLLERS = (
    "dcmp_hil.control.controllers.pd_compensated:PdSettings",  # a kind a line
)
REFERENCES = (
    "dcmp_hil.control.references.periodic:Sine",
    "dcmp_hil.control.references.periodic:Chirp",
    "dcmp_hil.control.references.piecewise:Hold",
    "dcmp_hil.control.references.piecewise:Step",
    "dcmp_hil.control.references.piecewise:Trapezoid",
    "dcmp_hil.control.references.table:Table",
)


def union_of(base: type[BaseModel], paths: tuple[str, ...], own: type[BaseModel] | None = None) -> Any:
    """Return the union of the kinds of a table, tagged by their words; `own` is for `module:Class`."""
    tagged = []
    for path in paths:
        module, _, name = path.partition(":")
        settings = getattr(import_module(module), name)
        if not issubclass(settings, base):
            raise TypeError(f"{path} is not derived from {base.__name__}.")
        words = get_args(settings.model_fields["kind"].annotation)
        tagged += [Annotated[settings, Tag(word)] for word in words]
    default = get_args(tagged[0])[1].tag
    custom = [Annotated[own, Tag("custom")]] if own else []
    return Annotated[Union[(*tagged, *custom)], _kind_or_custom(default)]


def _kind_or_custom(default: str) -> Discriminator:
    def kind(value: Any) -> str:
        got = value.get("kind", default) if isinstance(value, dict) else getattr(value, "kind", default)
        return "custom" if ":" in str(got) else str(got)

    return Discriminator(kind)


if TYPE_CHECKING:
    BackendSection = BackendSettings | CustomBackend
    ObserverSection = ObserverSettings | Custom
    ControllerSection = ControllerSettings | CustomController
    ReferenceSection = ReferenceSettings
else:
    BackendSection = union_of(BackendSettings, BACKENDS, CustomBackend)
    ObserverSection = union_of(ObserverSettings, OBSERVERS, Custom)
    ControllerSection = union_of(ControllerSettings, CONTROLLERS, CustomController)
    ReferenceSection = union_of(ReferenceSettings, REFERENCES)
