"""Results as rows of Parquet: a file a shard, where a million small files would be a burden."""

from __future__ import annotations

import hashlib
import importlib
import os
from typing import Any

from tumble.distributed._job import USAGE, DistributedError

# A row group is written when its rows have this many bytes.
_GROUP = 64 << 20


def name_of(shard: int) -> str:
    return f"part-{shard:05}.parquet"


def write(target: str, folder: str, results: list[str]) -> None:
    """Writes the NPY results of a shard, in the order of their names."""
    import numpy as np

    try:
        arrow: Any = importlib.import_module("pyarrow")
        parquet: Any = importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        message = "--into parquet needs pyarrow: pip install 'tumble-rotations[ray]'"
        raise DistributedError(message, USAGE) from error
    schema = arrow.schema(
        [
            arrow.field("clip", arrow.string(), nullable=False),
            arrow.field("tracks", arrow.int64(), nullable=False),
            arrow.field("frames", arrow.int64(), nullable=False),
            arrow.field("rotations", arrow.list_(arrow.float32()), nullable=False),
            arrow.field("sha256", arrow.string(), nullable=False),
        ]
    )
    writer = parquet.ParquetWriter(
        target, schema, compression="zstd", use_dictionary=False, write_statistics=["clip"]
    )
    rows: list[tuple[Any, ...]] = []
    waiting = 0

    def flush() -> None:
        nonlocal waiting
        if not rows:
            return
        clips, tracks, frames, numbers, hashes = zip(*rows, strict=True)
        ends = np.cumsum([0, *(len(values) for values in numbers)])
        if ends[-1] >= 2**31:
            message = f"{clips[-1]}: more numbers than a list of Parquet's can have; --into files"
            raise DistributedError(message, USAGE)
        lists = arrow.ListArray.from_arrays(
            arrow.array(ends.astype(np.int32)), arrow.array(np.concatenate(numbers))
        )
        columns = [list(clips), list(tracks), list(frames), lists, list(hashes)]
        arrays = [
            column if isinstance(column, arrow.Array) else arrow.array(column, field.type)
            for column, field in zip(columns, schema, strict=True)
        ]
        writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))
        rows.clear()
        waiting = 0

    with writer:
        for name in sorted(results):
            found = np.load(os.path.join(folder, name), mmap_mode="r")
            if found.ndim != 3 or found.shape[-1] != 4 or found.dtype != np.float32:
                message = f"{name}: --into parquet holds rotations, float32 x y z w"
                raise DistributedError(message, USAGE)
            numbers = np.ascontiguousarray(found).reshape(-1)
            digest = hashlib.sha256(numbers.tobytes()).hexdigest()
            tracks, frames, _ = found.shape
            rows.append((name.removesuffix(".npy"), tracks, frames, numbers, digest))
            waiting += numbers.nbytes
            if waiting >= _GROUP:
                flush()
        flush()
