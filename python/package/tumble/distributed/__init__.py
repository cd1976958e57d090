"""A library of clips over many machines, by Ray: the bytes of `tumble eval` on one.

    python -m tumble.distributed LIBRARY OUT --fps 60 -m slerp

or from Python:

    report = tumble.distributed.evaluate("clips", "out", fps=60, method="slerp")

LIBRARY and OUT are directories that every machine sees, or URLs of object stores. Wants Ray: `pip
install 'tumble-rotations[ray]'`; docs/distributed.md has the rest.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Literal

from tumble.distributed import _driver
from tumble.distributed._driver import Progress, Refusal, Report
from tumble.distributed._job import DistributedError, bytes_of, local

__all__ = ["DistributedError", "Progress", "Refusal", "Report", "evaluate"]


def evaluate(
    library: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    address: str | None = "auto",
    device: str = "auto",
    shard_bytes: int | str = "32MiB",
    worker_memory: int | str | None = None,
    into: Literal["files", "parquet"] = "files",
    resume: bool = True,
    overwrite: bool = False,
    progress: Callable[[Progress], None] | None = None,
    **options: Any,
) -> Report:
    """Evaluates every clip of a library, as `tumble eval LIBRARY -o OUT` does, over a cluster.

    `options` are those of `tumble eval`: `fps=60`, `method="slerp"`, `from_zero=True`, `tracks=[0, 1]`.
    `address`: of a Ray cluster; "auto" is that of this machine, else one that is started for the call.
    `device`: "auto" and "cpu" take a processor for each worker, "vulkan" a graphics card where the
    cluster has any. `worker_memory`: what a task reserves of its machine's memory, so that Ray starts
    no more of them than there is room for. `shard_bytes`: of input, at most, in what one task does. `into="parquet"`: a file
    of rows for each shard instead of a file for each clip. `resume`: keep what is done, and whole.
    `progress` is called with a `Progress` about twice a second.

    Inputs that are refused are in the report, the others are done. What ends everything, such as an
    output that cannot be written, is a `DistributedError`. After it, and after Ctrl-C, a second call
    goes on with what is left. A connection to Ray that is there is used, and left open: tasks that
    it was given before such an end run to theirs.
    """
    paths = [local(library), local(out)]
    return _driver.evaluate(
        [*_line(options), "--", paths[0]],
        *paths,
        address=address,
        device=device,
        shard_bytes=str(shard_bytes),
        worker_memory=None if worker_memory is None else bytes_of(worker_memory),
        into=into,
        resume=resume,
        overwrite=overwrite,
        progress=progress,
    )


def _line(options: dict[str, Any]) -> list[str]:
    """Options as a command line has them. Workers have other directories: files that options name get
    their whole paths."""
    line = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            line.append(flag)
        elif isinstance(value, list | tuple):
            line.append(f"{flag}={','.join(map(str, value))}")
        elif name in ("times", "offsets"):
            line.append(f"{flag}={os.path.abspath(value)}")
        else:
            line.append(f"{flag}={value}")
    return line
