"""`Engine.batch`: clips as rows of Arrow tables."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow
import pytest
import tumble

Array = np.ndarray[Any, Any]


def clips() -> list[tuple[Array, Array]]:
    """Times and keys of clips of several tracks, of uneven lengths."""
    rng = np.random.default_rng(11)
    made = []
    for tracks, keys in (1, 2), (3, 7), (22, 30), (2, 1):
        times = np.cumsum(rng.uniform(0.05, 0.5, keys))
        quats = rng.normal(size=(tracks, keys, 4))
        quats /= np.linalg.norm(quats, axis=-1, keepdims=True)
        made.append((times, quats.astype(np.float32)))
    return made


def rows(made: list[tuple[Array, Array]], kind: Any = None) -> Any:
    kind = kind or pyarrow.list_(pyarrow.float32())
    is_nested = pyarrow.types.is_nested(kind.value_type)
    keys = [q.reshape(-1, 4) if is_nested else q.reshape(-1) for _, q in made]
    return pyarrow.record_batch(
        {
            "clip": [f"clip{i}" for i in range(len(made))],
            "times": [t.tolist() for t, _ in made],
            "keys": pyarrow.array([q.tolist() for q in keys], kind),
        }
    )


@pytest.mark.parametrize(
    "kind",
    [
        pyarrow.list_(pyarrow.float32()),
        pyarrow.large_list(pyarrow.float64()),
        pyarrow.list_(pyarrow.list_(pyarrow.float32(), 4)),
        pyarrow.list_(pyarrow.list_(pyarrow.float32())),
    ],
    ids=str,
)
def test_rows_have_the_bits_of_clips_alone(kind: Any) -> None:
    engine = tumble.Engine("cpu")
    made = clips()
    found = engine.batch(rows(made, kind), fps=60, method="catmull-rom")
    assert found.schema.names == ["clip", "tracks", "frames", "rotations"]
    for i, (times, keys) in enumerate(made):
        alone = engine.evaluate(tumble.Clip(times, keys), fps=60, method="catmull-rom")
        assert (found["tracks"][i].as_py(), found["frames"][i].as_py()) == alone.shape[:2]
        rotations = found["rotations"][i].values.to_numpy()
        assert rotations.dtype == np.float32
        assert rotations.tobytes() == alone.tobytes(), i


def test_tables_slices_and_orders() -> None:
    engine = tumble.Engine("cpu")
    made = clips()
    whole = engine.batch(rows(made), at=[0.1, 0.4], method="slerp")
    chunks = pyarrow.Table.from_batches([rows(made).slice(0, 1), rows(made).slice(1)])
    assert engine.batch(chunks, at=[0.1, 0.4], method="slerp").equals(whole)
    part = engine.batch(rows(made).slice(1, 2), at=[0.1, 0.4], method="slerp")
    assert part.equals(whole.slice(1, 2))
    reordered = [(t, np.roll(q, 1, axis=-1)) for t, q in made]
    other = engine.batch(rows(reordered), at=[0.1, 0.4], method="slerp", order="wxyz")
    for i in range(len(made)):
        rotations = other["rotations"][i].values.to_numpy().reshape(-1, 4)
        back = np.roll(rotations, -1, axis=-1).reshape(-1)
        assert back.tobytes() == whole["rotations"][i].values.to_numpy().tobytes()
    empty = engine.batch(rows(made).slice(0, 0), fps=60, method="slerp")
    assert (empty.num_rows, empty.schema) == (0, whole.schema)


KEYS = [[0.0, 0, 0, 1, 1, 0, 0, 0]]
NONE = pyarrow.array([[]], pyarrow.list_(pyarrow.float64()))


@pytest.mark.parametrize(
    ("columns", "says", "pointer"),
    [
        ({"keys": KEYS}, "no column `times`; there are keys", "batch"),
        ({"times": [[0.0, 1.0]], "keys": KEYS, "frames": [1]}, "rename", "column frames"),
        ({"times": [[0.0, 1.0]], "keys": [[0.0, 0, 0]]}, "3 numbers of keys at 2 times", "row 0"),
        ({"times": NONE, "keys": KEYS}, "at 0 times", "row 0"),
        ({"times": [[0.0, 1.0]], "keys": [["a"]]}, "lists of numbers", "column keys, row 0"),
        ({"times": [0.5], "keys": KEYS}, "type double", "column times"),
        ({"times": [[0.0, 1.0], None], "keys": KEYS * 2}, "no value", "column times, row 1"),
        ({"times": [[0.0, None]], "keys": KEYS}, "missing", "column times, row 0"),
        ({"times": [[0.0, 0.0]], "keys": KEYS}, "does not come after", "row 0, times"),
        ({"times": [[0.0, 1.0]], "keys": [[0.0] * 8]}, "", "row 0, keys"),
    ],
)
def test_bad_rows_are_refused_by_name(columns: dict[str, Any], says: str, pointer: str) -> None:
    with pytest.raises(tumble.InputError) as caught:
        tumble.Engine("cpu").batch(pyarrow.table(columns), fps=60, method="slerp")
    assert says in str(caught.value)
    assert pointer in (caught.value.pointer or "")


def test_what_is_no_table_is_refused() -> None:
    with pytest.raises(tumble.InputError, match="not list"):
        tumble.Engine("cpu").batch([1, 2], fps=60, method="slerp")
    with pytest.raises(TypeError):
        tumble.Engine("cpu").batch(rows(clips()), metod="slerp")
