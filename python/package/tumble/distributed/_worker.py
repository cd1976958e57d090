"""The work of a worker on a task. A worker is a process of Ray's; it keeps one engine open."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import os
import platform
import posixpath
import subprocess
import tempfile
import time
from collections.abc import Iterator
from typing import Any

from tumble import _tumble
from tumble.distributed import _parquet
from tumble.distributed._job import (
    DEVICE,
    OUTPUT,
    DistributedError,
    Entry,
    Job,
    Task,
    is_url,
    refusal,
    wheel,
)
from tumble.distributed._stores import Store, objects, put_text, read_text, store


def run(job: Job, task: Task) -> Entry:
    """Evaluates a shard; returns counts and failures."""
    started = time.monotonic()
    installed = wheel()
    reply: Entry = {"node": _node(), "pid": os.getpid(), "host": platform.node()}
    if installed != job.wheel:
        return {**reply, "other_wheel": f"tumble {installed[1]}, kernels {installed[0][:12]}"}
    try:
        worker = _worker(job.line, task.device or _device(job))
        with _inputs(job, task) as inputs:
            outcome = _run(worker, job, task, inputs)
    except ValueError as error:  # a command line or a device that was refused
        code, message = error.args if len(error.args) == 2 else (DEVICE, str(error))
        return {**reply, "code": code, "message": message}
    except DistributedError as error:
        return {**reply, "code": error.exit_code, "message": str(error)}
    return {**reply, **outcome, "seconds": time.monotonic() - started}


# The state of a worker process: its engine (by the options and the device with which it was opened), the last manifest
# that was read, and the UUID of each card.
_WORKERS: dict[tuple[tuple[str, ...], str], _tumble.Worker] = {}
_MANIFESTS: dict[tuple[str, int | None], dict[str, list[str]]] = {}
_UUIDS: dict[str, str] = {}


def _worker(line: tuple[str, ...], device: str) -> _tumble.Worker:
    found = _WORKERS.get((line, device))
    if found is None:
        _WORKERS.clear()
        found = _WORKERS[line, device] = _tumble.Worker(["--device", device, *line], 1)
    return found


def _node() -> str:
    ray: Any = importlib.import_module("ray")
    return str(ray.get_runtime_context().get_node_id())


def _device(job: Job) -> str:
    """The device of a worker: Ray says which card is its own by a variable that Vulkan ignores."""
    if not job.has_gpu:
        return job.device
    ray: Any = importlib.import_module("ray")
    return f"uuid:{_uuid(str(ray.get_gpu_ids()[0]))}"


def _uuid(card: str) -> str:
    """By NVIDIA's own tool, which comes with the driver; Ray may name cards by it already."""
    if card.startswith("GPU-"):
        return card.removeprefix("GPU-")
    if card in _UUIDS:
        return _UUIDS[card]
    query = ["nvidia-smi", f"--id={card}", "--query-gpu=uuid", "--format=csv,noheader"]
    try:
        found = subprocess.run(query, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise DistributedError(f"card {card}: its UUID is not known: {error}", DEVICE) from error
    return _UUIDS.setdefault(card, found.stdout.strip().removeprefix("GPU-"))


@contextlib.contextmanager
def _inputs(job: Job, task: Task) -> Iterator[list[tuple[str, str]]]:
    """The inputs under the names on the command line, which messages and manifests have. Objects
    are fetched into a directory in which those names lead to them."""
    inputs = [(item.path, item.below) for item in task.inputs]
    if not is_url(job.library):
        with _in(job.folder if not os.path.isabs(job.library) else os.getcwd()):
            yield inputs
        return
    source = objects(job.library)
    with tempfile.TemporaryDirectory(prefix="tumble-") as folder:
        for path, below in inputs:
            target = os.path.join(folder, path)
            os.makedirs(os.path.dirname(target), exist_ok=True)
            # If a file is missing or cannot be read, the evaluation reports the error with the name of the input.
            with contextlib.suppress(FileNotFoundError, PermissionError):
                source.fetch(below, target)
                _fetch_referred(source, below, target)
        with _in(folder):
            yield inputs


def _fetch_referred(source: Any, below: str, target: str) -> None:
    """The files that an input refers to, such as the buffers of a glTF, are objects too."""
    for name in _tumble.referred_files(target):
        path = os.path.join(os.path.dirname(target), name)
        if not os.path.exists(path):
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with contextlib.suppress(FileNotFoundError, PermissionError):
                source.fetch(posixpath.join(posixpath.dirname(below), name), path)


@contextlib.contextmanager
def _in(folder: str) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _run(
    worker: _tumble.Worker, job: Job, task: Task, inputs: list[tuple[str, str]]
) -> Entry:
    """Into the directory itself, where the program can; else beside it first."""
    refused = [refusal(path, message) for path, message in task.refused]
    if not task.is_trial and not refused and job.into == "files" and not is_url(job.out):
        return _evaluate(worker, job, task, inputs, job.out, record=True)
    out = store(job.out)
    before = None
    if job.resume and not task.is_trial:
        before = _done(worker, job, task, inputs, out)
    if before is not None:
        return before
    with tempfile.TemporaryDirectory(prefix="tumble-") as folder:
        outcome = _evaluate(worker, job, task, inputs, folder, record=False)
        text = outcome.pop("record")
        if task.is_trial:
            return outcome
        record = _tumble.Record.parse(text)
        assert record is not None, "the program has written it"
        for path, message in task.refused:
            record.refuse(path, message)
        outcome["failed"] += refused
        try:
            if job.into == "parquet":
                _put_rows(job, task, inputs, folder, record, out)
            else:
                for name, _, _ in record.results():
                    out.put(os.path.join(folder, name), name)
            # Written last: the record states that all other files exist.
            put_text(out, record.text(), record.name_of(task.shard))
        except OSError as error:
            raise DistributedError(f"{job.out}: cannot be written: {error}", OUTPUT) from error
        return outcome


def _evaluate(
    worker: _tumble.Worker,
    job: Job,
    task: Task,
    inputs: list[tuple[str, str]],
    folder: str,
    *,
    record: bool,
) -> Entry:
    shard, of, plan = task.shard, job.shards, job.plan
    code, text = worker.run(folder, shard, of, plan, inputs, record=record)
    if code:
        raise DistributedError(text, code)
    outcome: Entry = json.loads(text)
    return outcome


def _put_rows(
    job: Job,
    task: Task,
    inputs: list[tuple[str, str]],
    folder: str,
    record: _tumble.Record,
    out: Store,
) -> None:
    """Writes a shard's file of rows, and its line of the manifest in the place of those of its results."""
    results = [name for name, _, _ in record.results()]
    if not results:
        return
    name = _parquet.name_of(task.shard)
    path = os.path.join(folder, name)
    _parquet.write(path, folder, results)
    record.join(
        name,
        sha256=_hash(path) or "",
        bytes=os.path.getsize(path),
        library=job.library,
        inputs_sha256=_hash_of_all(inputs),
        into=job.into,
    )
    out.put(path, name)


def _hash(path: str) -> str | None:
    digest = hashlib.sha256()
    try:
        with open(path, "rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
    except OSError:
        return None
    return digest.hexdigest()


def _hash_of_all(inputs: list[tuple[str, str]]) -> str:
    """The hash of the hashes of a shard's inputs, in their order."""
    hashes = "".join(f"{_tumble.input_sha256(path)}\n" for path, _ in inputs)
    return hashlib.sha256(hashes.encode()).hexdigest()


def _done(
    worker: _tumble.Worker,
    job: Job,
    task: Task,
    inputs: list[tuple[str, str]],
    out: Store,
) -> Entry | None:
    """The outcome of a shard that was done before, from the same inputs with the same options, by its
    record or by the manifest that it was merged into; else None. The bytes of its results are not read
    again: a result of the recorded length counts as whole."""
    file_name = _tumble.Record.name_of(task.shard)
    text = read_text(out, file_name)
    if text is None:
        merged = _manifest(job.out, out.size("manifest.jsonl"))
        lines = [line for key in _keys(worker, job, task, inputs) for line in merged.get(key, [])]
        record = _tumble.Record(task.shard, job.shards, job.plan, len(inputs), lines)
    else:
        recorded = _tumble.Record.parse(text)
        if recorded is None or not recorded.is_whole:
            return None
        record = recorded
    options = worker.options
    if job.into == "parquet":
        options += " into=parquet"
        hashes = {_parquet.name_of(task.shard): _hash_of_all(inputs)}
    else:
        hashes = {
            key: _tumble.input_sha256(path) or ""
            for key, (path, _) in zip(_keys(worker, job, task, inputs), inputs, strict=True)
        }
    is_done = record.is_made_from(hashes, options) and all(
        out.size(name) == length for name, _, length in record.results()
    )
    if not is_done:
        return None
    if record.plan != job.plan or text is None:
        record.plan = job.plan
        put_text(out, record.text(), file_name)
    return {
        "made": 0,
        "skipped": len(inputs),
        "rotations": 0,
        "device": worker.device,
        "failed": [],
    }


def _keys(
    worker: _tumble.Worker, job: Job, task: Task, inputs: list[tuple[str, str]]
) -> list[str]:
    """The names of the results of inputs, without the ending, which is the format's."""
    if job.into == "parquet":
        return [_parquet.name_of(task.shard)]
    return [worker.key_of(below) for _, below in inputs]


def _manifest(location: str, size: int | None) -> dict[str, list[str]]:
    """The lines of a merged manifest of that size, by the keys of their inputs."""
    if (location, size) in _MANIFESTS:
        return _MANIFESTS[location, size]
    text = (read_text(store(location), "manifest.jsonl") or "") if size is not None else ""
    _MANIFESTS.clear()
    return _MANIFESTS.setdefault((location, size), _tumble.manifest_by_input(text))
