"""Are the results in an object store still what they were? What `tumble check --results-only` does for directories."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from tumble import _tumble
from tumble.distributed._job import ALL_INPUTS, DistributedError
from tumble.distributed._stores import Store, read_text, store

# The number of objects that are read at the same time. Reading mostly waits for the network.
_AT_ONCE = 16


@dataclass(frozen=True)
class Checked:
    """The result of checking."""

    results: int
    faults: list[str]
    """The results that differ, and how, a line each."""
    unfinished: list[str]
    """Inputs that failed or do not have all their results yet, a line each."""
    shards: tuple[int, int] | None
    """Where they are not merged: how many are done, of how many."""


def check(out: str) -> Checked:
    """Compares every object with its line of the manifest, or of a shard that is not merged yet."""
    results = store(out)
    manifest = read_text(results, "manifest.jsonl")
    plan = read_text(results, "manifest.d/plan.json")
    if manifest is None and plan is None:
        raise DistributedError(f"{out}: has no manifest.jsonl", ALL_INPUTS)
    listed = {name: sha256 for name, sha256, _ in _tumble.manifest_results(manifest or "")}
    records: list[str] = []
    shards = None
    if plan is not None:
        recorded_plan = json.loads(plan)
        done = 0
        for name in results.list("manifest.d"):
            text = read_text(results, name) if name.endswith(".jsonl") else None
            if text is None:
                continue
            record = _tumble.Record.parse(text)
            if record is None:
                continue
            done += record.is_whole and record.plan == recorded_plan["plan"]
            listed.update((name, sha256) for name, sha256, _ in record.results())
            records.append(text)
        shards = (done, recorded_plan["shards"])
    with ThreadPoolExecutor(_AT_ONCE) as threads:
        found = threads.map(lambda result: _fault(results, *result), listed.items())
        faults = [fault for fault in found if fault is not None]
    unfinished = _tumble.manifest_unfinished(manifest or "", records)
    return Checked(len(listed), faults, unfinished, shards)


def _fault(results: Store, name: str, sha256: str) -> str | None:
    content = results.read(name)
    if content is None:
        return f"{name}: is not there"
    if hashlib.sha256(content).hexdigest() != sha256:
        return f"{name}: its bits have changed since it was written"
    return None
