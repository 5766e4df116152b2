"""Results of a sweep on disk: a manifest, and Parquet parts that are there wholly or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping.engine import RunOutcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from dcmp_hil.sweeping.block_work import RunRow
    from dcmp_hil.sweeping.executor import SweepBlock
    from dcmp_hil.sweeping.spec import Scalar

PART_BYTES = 9_000
"""Bytes of a part beside its rows, at most: the schema and the footer."""
ROW_BYTES = 8 * len(RunOutcome._fields) + 48
"""Bytes of a row beside its values."""
VALUE_BYTES = 10
"""Bytes of a value of a row, with the checksums of its page."""
_MISSING = "A sweep's results are Parquet, which needs pyarrow. Install it: pip install 'dcmp-hil[sweep]'"


def load_pyarrow() -> Any:
    """Return pyarrow, whose `parquet` is imported, too.

    Raises
    ------
    ConfigError
        If it is not installed.
    """
    try:
        import_module("pyarrow.parquet")
        return import_module("pyarrow")
    except ImportError:
        raise ConfigError(_MISSING) from None


def schema_of(keys: Sequence[str], examples: Sequence[Scalar]) -> Any:
    """Return the columns: the run, its values under their dotted keys, engine, refusal, figures, trip."""
    arrow = load_pyarrow()
    types = {"periods": arrow.int64(), "tripped": arrow.bool_(), "trip_cause": arrow.string()}
    outcome = [(name, types.get(name, arrow.float64())) for name in RunOutcome._fields]
    swept = [(key, _type_of(arrow, value)) for key, value in zip(keys, examples, strict=True)]
    return arrow.schema(
        [("run", arrow.int64()), *swept, ("engine", arrow.string()), ("refused", arrow.string()), *outcome]
    )


def _type_of(arrow: Any, value: Scalar) -> Any:
    if isinstance(value, bool):
        return arrow.bool_()
    if isinstance(value, str):
        return arrow.string()
    return arrow.int64() if isinstance(value, int) else arrow.float64()


def table_of(rows: Iterable[RunRow], schema: Any) -> Any:
    """Return rows as a table of Arrow."""
    flat = [(row.run, *row.values, row.engine, row.refused, *row.outcome) for row in rows]
    columns = list(zip(*flat, strict=True)) if flat else [()] * len(schema)
    arrow = load_pyarrow()
    arrays = [
        arrow.array([_as(field.type, value) for value in column], field.type)
        for field, column in zip(schema, columns, strict=True)
    ]
    return arrow.Table.from_arrays(arrays, schema=schema)


def _as(kind: Any, value: Any) -> Any:
    """Return a value as its column has it: a list of a grid may mix words, numbers and whole numbers."""
    if str(kind) == "string":
        return str(value)
    return float(value) if str(kind) == "double" else value


def part_of(folder: Path, block: SweepBlock) -> Path:
    """Return the path of the part of a block."""
    return folder / f"part-{block.number:06d}.parquet"


def write_part(folder: Path, block: SweepBlock, rows: Sequence[RunRow], schema: Any) -> None:
    """Write the part of a block: to a temporary name, to the disk, then renamed.

    Raises
    ------
    OSError
        If it cannot be written; nothing of it is left.
    """
    part = part_of(folder, block)
    place = part.with_name(f".{part.name}.{os.getpid()}")
    try:
        with place.open("wb") as file:
            parquet(file, table_of(rows, schema))
            file.flush()
            os.fsync(file.fileno())
        place.replace(part)
        _sync_folder(folder)
    except BaseException:
        place.unlink(missing_ok=True)
        raise


def parquet(file: Any, table: Any) -> None:
    """Write a table to an open file, with a checksum for each page."""
    load_pyarrow().parquet.write_table(table, file, write_page_checksum=True, compression="zstd")


def read_part(folder: Path, block: SweepBlock, schema: Any) -> Any:
    """Return the table of a part; None if there is none, or it is damaged, and then it is removed."""
    part, arrow = part_of(folder, block), load_pyarrow()
    if not part.exists():
        return None
    with suppress(OSError, ValueError, arrow.ArrowException):
        with part.open("rb") as file:
            table = arrow.parquet.ParquetFile(file, page_checksum_verification=True).read()
        runs = list(range(block.first, block.first + block.runs))
        if table.schema.equals(schema) and table.column("run").to_pylist() == runs:
            return table
    part.unlink(missing_ok=True)
    return None


def _sync_folder(folder: Path) -> None:
    """Have the folder's entries on the disk, where folders can be opened."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
