"""Evaluates a directory of clips on many machines by Ray, with the same bytes as `tumble eval` on one.

    python -m tumble.distributed LIBRARY OUT --fps 60 -m slerp

or from Python:

    report = tumble.distributed.evaluate("clips", "out", fps=60, method="slerp")

LIBRARY and OUT are directories with the same path on every machine, or URLs of object stores. Ray is
required: `pip install 'tumble-rotations[ray]'`. See docs/distributed.md.
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
    """Evaluates every clip of a directory on a cluster, as `tumble eval LIBRARY -o OUT` does on one machine.

    `options` are those of `tumble eval`: `fps=60`, `method="slerp"`, `from_zero=True`, `tracks=[0, 1]`.
    `address`: the Ray cluster; "auto": that of this machine, or a new one for this call.
    `device`: "auto" and "cpu" use a processor for each worker, "vulkan" a graphics card if the cluster
    has cards. `worker_memory`: the memory that a task reserves, so that Ray runs only as many tasks on a
    machine as fit. `shard_bytes`: the largest total size of the inputs of a task. `into="parquet"`:
    write a file of rows for each shard instead of a file for each clip. `resume`: skip results that are
    complete. `progress` is called with a `Progress` about twice a second.

    Inputs that are refused are listed in the report; the others are evaluated. An error that stops the
    whole run, such as an output that cannot be written, raises `DistributedError`. After it, or after
    Ctrl-C, a second call continues with the rest. If Ray is already connected, this connection is used
    and left open; tasks that were submitted before an error then run to their end. One that ends after the
    next call has merged the results leaves a record in `manifest.d`, which a further call merges.
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
