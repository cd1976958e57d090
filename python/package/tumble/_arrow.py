"""Clips as rows of Arrow tables, which Spark, Daft, Ray Data and DuckDB pass to a function."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from tumble._errors import InputError
from tumble._tumble import Clip

# Offsets into a list column have 32 bits.
_MAX_LIST_VALUES = 2**31 - 1


def batch(engine: Any, rows: Any, *, order: Any = "xyzw", **options: Any) -> Any:
    """Evaluates a batch of rows, as `Engine.batch` documents."""
    try:
        arrow: Any = importlib.import_module("pyarrow")
    except ImportError as error:
        raise InputError("Engine.batch needs pyarrow: pip install pyarrow") from error
    rows = _one_batch(arrow, rows)
    for name in ("times", "keys"):
        if name not in rows.schema.names:
            names = ", ".join(rows.schema.names) or "none"
            message = f"there is no column `{name}`; there are {names}"
            raise InputError(message, pointer="batch")
    for made in ("tracks", "frames", "rotations"):
        if made in rows.schema.names:
            message = f"the result has a column `{made}` too; rename that of the batch"
            raise InputError(message, pointer=f"column {made}")
    times, keys = _lists(arrow, rows, "times"), _lists(arrow, rows, "keys")
    found: list[Any] = []
    for row in range(rows.num_rows):
        found.append(_evaluated(engine, times(row), keys(row), row, order, options))
    numbers = [result.reshape(-1) for result in found]
    ends = np.cumsum([0, *(len(part) for part in numbers)])
    if ends[-1] > _MAX_LIST_VALUES:
        message = f"{ends[-1]} numbers are more than a list column can have; give fewer rows"
        raise InputError(message, pointer="batch")
    values = np.concatenate(numbers) if numbers else np.empty(0, np.float32)
    lists = arrow.ListArray.from_arrays(
        arrow.array(ends.astype(np.int32)), arrow.array(values, arrow.float32())
    )
    kept = [name for name in rows.schema.names if name not in ("times", "keys")]
    columns = [rows.column(name) for name in kept]
    columns.append(arrow.array([result.shape[0] for result in found], arrow.int64()))
    columns.append(arrow.array([result.shape[1] for result in found], arrow.int64()))
    fields = [rows.schema.field(name) for name in kept]
    for name, kind in ("tracks", arrow.int64()), ("frames", arrow.int64()):
        fields.append(arrow.field(name, kind, nullable=False))
    fields.append(arrow.field("rotations", lists.type, nullable=False))
    return arrow.RecordBatch.from_arrays([*columns, lists], schema=arrow.schema(fields))


def _one_batch(arrow: Any, rows: Any) -> Any:
    if isinstance(rows, arrow.RecordBatch):
        return rows
    if isinstance(rows, arrow.Table) or hasattr(rows, "__arrow_c_stream__"):
        table = arrow.table(rows).combine_chunks()
        batches = table.to_batches()
        return batches[0] if batches else arrow.RecordBatch.from_pylist([], schema=table.schema)
    if hasattr(rows, "__arrow_c_array__"):
        return arrow.record_batch(rows)
    message = f"a batch is a RecordBatch or a Table of pyarrow's, not {type(rows).__name__}"
    raise InputError(message, pointer="batch")


def _lists(arrow: Any, rows: Any, name: str) -> Any:
    """A function from a row to the numbers of its list, in one flat array."""
    column = rows.column(name)
    if column.null_count:
        row = column.is_null().to_pylist().index(True)
        raise InputError(f"column `{name}` has no value", pointer=f"column {name}, row {row}")

    def numbers(row: int) -> Any:
        values = column[row].values
        while hasattr(values, "flatten") and arrow.types.is_nested(values.type):
            values = values.flatten()
        if not (arrow.types.is_floating(values.type) or arrow.types.is_integer(values.type)):
            message = f"column `{name}` is of type {column.type}; lists of numbers are expected"
            raise InputError(message, pointer=f"column {name}, row {row}")
        if values.null_count:
            message = f"a number of column `{name}` is missing"
            raise InputError(message, pointer=f"column {name}, row {row}")
        return values.to_numpy(zero_copy_only=False)

    if not (
        arrow.types.is_list(column.type)
        or arrow.types.is_large_list(column.type)
        or arrow.types.is_fixed_size_list(column.type)
    ):
        message = f"column `{name}` is of type {column.type}; lists of numbers are expected"
        raise InputError(message, pointer=f"column {name}, row 0")
    return numbers


def _evaluated(
    engine: Any, times: Any, keys: Any, row: int, order: Any, options: dict[str, Any]
) -> Any:
    each = 4 * len(times)
    if each == 0 or len(keys) == 0 or len(keys) % each:
        message = (
            f"{len(keys)} numbers of keys at {len(times)} times; give four for each time of each track"
        )
        raise InputError(message, pointer=f"column keys, row {row}")
    try:
        clip = Clip(times, keys.reshape(-1, len(times), 4), order=order, layout="track")
    except InputError as error:
        pointer = error.pointer or "keys"
        raise InputError(str(error), code=error.code, pointer=f"row {row}, {pointer}") from error
    return engine.evaluate(clip, order=order, **options)
