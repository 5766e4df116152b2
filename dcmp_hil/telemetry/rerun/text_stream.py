"""A recording stream whose text every viewer can draw: the only one that the package makes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
import rerun.blueprint as rrb

from dcmp_hil.telemetry.rerun.font_text import drawable, drawable_path

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rerun.blueprint.api import BlueprintLike


class TextStream(rr.RecordingStream):
    """A recording stream that passes each text through `drawable`: data, names, labels, layouts, paths.

    Parameters
    ----------
    application
        Recordings of the same application share the viewer's layout.
    recording_id
        None makes a new one.
    """

    def __init__(self, application: str, recording_id: str | None = None) -> None:
        super().__init__(drawable(application), recording_id=recording_id)

    def log(self, entity_path: str | list[object], entity: Any, *extra: Any, **options: Any) -> None:
        """Log data; see `rerun.RecordingStream.log`."""
        path = entity_path if isinstance(entity_path, list) else drawable_path(entity_path)
        drawn: list[Any] = [_Drawable(batch) for one in (entity, *extra) for batch in _batches(one)]
        super().log(path, drawn, **options)

    def send_columns(
        self, entity_path: str, indexes: Iterable[Any], columns: Iterable[Any], strict: bool | None = None
    ) -> None:
        """Send columns; see `rerun.RecordingStream.send_columns`."""
        drawn: Sequence[Any] = [_Drawable(column) for column in columns]
        super().send_columns(drawable_path(entity_path), indexes, drawn, strict=strict)

    def send_recording_name(self, name: str) -> None:
        """Send the recording's name."""
        super().send_recording_name(drawable(name))

    def set_sinks(self, *sinks: Any, default_blueprint: BlueprintLike | None = None) -> None:
        """Send to these from now on; see `rerun.RecordingStream.set_sinks`."""
        super().set_sinks(*sinks, default_blueprint=_layout(default_blueprint))

    def send_blueprint(self, blueprint: BlueprintLike, **options: bool) -> None:
        """Send a layout; see `rerun.RecordingStream.send_blueprint`."""
        super().send_blueprint(_layout(blueprint), **options)


class _Drawable:
    """Components as another object has them, their text drawable."""

    def __init__(self, components: Any) -> None:
        self.component_descriptor = components.component_descriptor
        self._components = components

    def as_arrow_array(self) -> pa.Array:
        """Return the components' data."""
        array = self._components.as_arrow_array()
        if array is None or not _has_text(array.type):
            return array
        return pa.array(_drawn(array.to_pylist()), array.type)


def _batches(entity: Any) -> Iterable[Any]:
    batches: Iterable[Any] = (
        entity.as_component_batches() if hasattr(entity, "as_component_batches") else entity
    )
    return batches


def _has_text(kind: pa.DataType) -> bool:
    """Return whether an array is of texts, or of lists of them, as all texts that Rerun draws are."""
    if pa.types.is_list(kind):
        return _has_text(kind.value_type)
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _drawn(value: Any) -> Any:
    if isinstance(value, list):
        return [_drawn(one) for one in value]
    return drawable(value) if isinstance(value, str) else value


def _layout(part: Any) -> Any:
    """Return a layout, changed in place: the names of views and containers, and the paths that they show."""
    if isinstance(part, rrb.Blueprint):
        _layout(part.root_container)
        return part
    if getattr(part, "name", None):
        part.name = drawable(str(part.name))
    if isinstance(part, rrb.Container):
        for one in part.contents:
            _layout(one)
    elif isinstance(part, rrb.View):
        part.origin = drawable_path(str(part.origin))
        part.contents = _paths(part.contents)
    return part


def _paths(contents: Any) -> Any:
    if isinstance(contents, str):
        return drawable_path(contents)
    return [drawable_path(str(one)) for one in contents] if isinstance(contents, list) else contents
