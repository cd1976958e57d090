"""The driver: hands shards to Ray, sees them through, and merges what they leave."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import json
import os
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from tumble import _tumble
from tumble.distributed import _worker
from tumble.distributed._job import (
    ALL_INPUTS,
    DEVICE,
    OUTPUT,
    SOME_INPUTS,
    USAGE,
    DistributedError,
    Entry,
    Input,
    Job,
    Task,
    is_url,
    wheel,
)
from tumble.distributed._stores import Store, check_names, objects, put_text, read_text, store

# The number of tasks that are queued for each processor. With 4, a lost machine had half a minute of work; with 32, no
# processor was idle.
_IN_FLIGHT = 32

# The largest number of tasks whose end is queried in one call.
_ASKED = 256

# The number of retries of a task on other workers, and of divisions of a shard after that.
_RETRIES = 3
_ROUNDS = 4

# The interval in which the number of processors of the cluster is queried [s].
_ASK = 2.0


@dataclass
class Progress:
    """How far a library is."""

    inputs: int
    shards: int
    inputs_done: int = 0
    shards_done: int = 0
    failed: int = 0
    rotations: int = 0
    workers: int = 0
    seconds: float = 0.0

    @property
    def seconds_left(self) -> float | None:
        """At the pace so far; None before the first shard."""
        if not self.inputs_done:
            return None
        return self.seconds * (self.inputs - self.inputs_done) / self.inputs_done


@dataclass(frozen=True)
class Refusal:
    """An input without a result."""

    input: str
    message: str


@dataclass(frozen=True)
class Report:
    """The outcome of evaluating a library."""

    inputs: int
    results: int
    made: int
    """Inputs whose results were made; the others were there before, or failed."""
    skipped: int
    failed: list[Refusal]
    shards: int
    rotations: int
    seconds: float
    workers: int
    retried: int
    """Shards whose worker ended beneath them more often than Ray tries again."""
    refused_machines: list[str] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        """That of the program: 0, 3 where inputs failed, 4 where all did."""
        if not self.failed:
            return 0
        return ALL_INPUTS if len(self.failed) == self.inputs else SOME_INPUTS


@dataclass
class _Apart:
    """A shard that ended its workers, taken apart to find out by which inputs."""

    inputs: tuple[Input, ...]
    rounds: int = 0
    waiting: int = 0
    guilty: list[tuple[str, str]] = field(default_factory=list)
    needs_cpu: bool = False


@contextlib.contextmanager
def connected(address: str | None) -> Iterator[Any]:
    """Ray: the cluster at an address, the one of this machine, else one that is started for this
    call. A connection that is there is used, and left."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    # If a task needs more memory than the node has, Ray repeats it without end by default. Here it gives up after 3
    # times.
    os.environ.setdefault("RAY_task_oom_retries", "3")
    try:
        ray: Any = importlib.import_module("ray")
    except ImportError as error:
        message = "Ray is not installed: pip install 'tumble-rotations[ray]'"
        raise DistributedError(message, USAGE) from error
    if ray.is_initialized():
        yield ray
        return
    quiet = {"log_to_driver": False, "logging_level": "ERROR"}
    try:
        ray.init(address=address, **quiet)
    except ConnectionError as error:
        if address not in (None, "auto"):
            raise DistributedError(f"{address}: no Ray answers: {error}", USAGE) from error
        ray.init(include_dashboard=False, **quiet)
    try:
        yield ray
    finally:
        ray.shutdown()


def evaluate(
    line: list[str],
    library: str,
    out: str,
    *,
    address: str | None,
    device: str,
    shard_bytes: str,
    worker_memory: int | None,
    into: str,
    resume: bool,
    overwrite: bool,
    progress: Callable[[Progress], None] | None,
    begin: Callable[[], None] | None = None,
) -> Report:
    """Plans, evaluates and merges; see `tumble.distributed.evaluate`. `begin` is called when Ray is
    there, before any work."""
    flags = ["--resume"] * resume + ["--overwrite"] * overwrite
    out = out.rstrip("/") if is_url(out) else os.path.abspath(out)
    line = [*flags, *line]  # a line may end with names behind `--`
    listed = None
    base = library
    if is_url(library):
        base = library.split("?")[0].rstrip("/")
        listed = sorted(objects(library).list().items())
        check_names(base, (name for name, _ in listed))
    with _refusals():
        with tempfile.TemporaryDirectory() as nowhere:
            folder = nowhere if is_url(out) else out
            plan = _tumble.Plan(line, base, listed, folder, shard_bytes, into)
        _claim(plan, out, into, resume, overwrite)
    with connected(address) as ray:
        has_gpu = device == "vulkan" and ray.cluster_resources().get("GPU", 0) > 0
        job = Job(
            line=tuple(line),
            plan=plan.id,
            shards=len(plan),
            library=library,
            out=out,
            folder=os.getcwd(),
            into=into,
            resume=resume,
            device="cpu" if device == "auto" else device,
            has_gpu=has_gpu,
            wheel=wheel(),
        )
        driver = _Driver(ray, job, plan, progress, worker_memory)
        if begin is not None:
            begin()
        driver.run()
        merged = _merge(out)
        failed = [Refusal(failure["input"], failure["message"]) for failure in merged["failed"]]
        return driver.report(merged["results"], failed)


@contextlib.contextmanager
def _refusals() -> Iterator[None]:
    """Turns a refusal of the extension, an exit code and a message, into an exception."""
    try:
        yield
    except ValueError as error:
        if len(error.args) != 2:
            raise
        code, message = error.args
        raise DistributedError(message, code) from None


def _claim(plan: _tumble.Plan, out: str, into: str, resume: bool, overwrite: bool) -> None:
    """Writes the plan into the directory of results."""
    results = store(out)
    fresh = not resume and not overwrite
    if fresh and any(name.endswith(".jsonl") for name in results.list("manifest.d")):
        message = f"{out}: has shards that are done; resume keeps them, overwrite makes all again"
        raise DistributedError(message, USAGE)
    if into == "parquet" and fresh and results.size("part-00001.parquet") is not None:
        message = f"{out}: part-00001.parquet exists; resume continues the run, overwrite replaces it"
        raise DistributedError(message, USAGE)
    if not is_url(out):
        plan.claim(out)
        return
    with tempfile.TemporaryDirectory() as folder:
        plan.claim(folder)
        with open(os.path.join(folder, "manifest.d", "plan.json"), encoding="utf-8") as file:
            plan_text = file.read()
    there = read_text(results, "manifest.d/plan.json")
    if there == plan_text:
        return
    if there is not None and fresh:
        message = f"{out}: has shards of another list, other options or another tumble"
        raise DistributedError(message, USAGE)
    if there is None and not overwrite:
        known = resume and results.size("manifest.jsonl") is not None
        names = set() if known else set(results.list())
        for shard in range(1, len(plan) + 1):
            for name in names.intersection(plan.names_of(shard)):
                message = f"{out}/{name}: exists; overwrite replaces it"
                raise DistributedError(message, USAGE)
    put_text(results, plan_text, "manifest.d/plan.json")


def _merge(out: str) -> Entry:
    """Makes one manifest of all shards' lines."""
    if not is_url(out):
        return _merged(out)
    results = store(out)
    with tempfile.TemporaryDirectory() as folder:
        os.mkdir(os.path.join(folder, "manifest.d"))
        for name in ["manifest.jsonl", *results.list("manifest.d")]:
            content = results.read(name)
            if content is not None:
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(content)
        merged = _merged(folder)
        path = os.path.join(folder, "manifest.jsonl")
        if os.path.exists(path):
            results.put(path, "manifest.jsonl")
    _sweep(results)
    return merged


def _sweep(results: Store) -> None:
    results.remove("manifest.d")


def _merged(folder: str) -> Entry:
    code, text = _tumble.merge(folder)
    if code:
        raise DistributedError(text, code)
    merged: Entry = json.loads(text)
    return merged


class _Driver:
    """Keeps the cluster busy until every shard's file is there."""

    def __init__(
        self,
        ray: Any,
        job: Job,
        plan: _tumble.Plan,
        progress: Callable[[Progress], None] | None,
        memory: int | None,
    ) -> None:
        self._memory = memory
        self._ray = ray
        self._job = job
        self._plan = plan
        self._tell = progress
        # Reference counts end a GPU's process after each task unless the decorator says 0.
        self._run = ray.remote(max_calls=0)(_worker.run)
        self._todo: deque[Task] = deque()
        self._next = 1
        self._running: dict[Any, Task] = {}
        self._apart: dict[int, _Apart] = {}
        self._refused: dict[str, str] = {}
        self._workers: set[tuple[str, int]] = set()
        self._progress = Progress(plan.inputs, len(plan))
        self._made = self._skipped = self._retried = 0
        self._started = time.monotonic()
        self._asked = -_ASK
        self._room = 0

    def run(self) -> None:
        # If this ends early, the connection is closed, which ends the tasks; finished shards have written their
        # records. Tasks are not cancelled, because Ray 2.60 aborts a driver if a task ends while it is cancelled
        # ("Tried to complete task that was not pending").
        while self._is_unfinished():
            self._submit()
            self._collect()
            self._progress.seconds = time.monotonic() - self._started
            self._progress.workers = len(self._workers)
            if self._tell is not None:
                self._tell(self._progress)

    def report(self, results: int, failed: list[Refusal]) -> Report:
        return Report(
            inputs=self._plan.inputs,
            results=results,
            made=self._made,
            skipped=self._skipped,
            failed=failed,
            shards=len(self._plan),
            rotations=self._progress.rotations,
            seconds=time.monotonic() - self._started,
            workers=len(self._workers),
            retried=self._retried,
            refused_machines=sorted(self._refused.values()),
        )

    def _is_unfinished(self) -> bool:
        return bool(self._running or self._todo) or self._next <= len(self._plan)

    def _task(self) -> Task | None:
        """The next task: first those given back, then the shards in their order."""
        if self._todo:
            return self._todo.popleft()
        if self._next > len(self._plan):
            return None
        shard = self._next
        self._next += 1
        return Task(shard, self._inputs(shard))

    def _inputs(self, shard: int) -> tuple[Input, ...]:
        return tuple(Input(path, below) for path, below in self._plan.inputs_of(shard))

    def _submit(self) -> None:
        """Machines come and go: how many tasks may wait is asked again."""
        if time.monotonic() - self._asked > _ASK:
            kind = "GPU" if self._job.has_gpu else "CPU"
            self._room = _IN_FLIGHT * max(1, int(self._ray.cluster_resources().get(kind, 1)))
            self._asked = time.monotonic()
            self._check_machines()
        while len(self._running) < self._room:
            task = self._task()
            if task is None:
                return
            of = f"shard {task.shard} of {self._job.shards}"
            options: dict[str, Any] = {
                "name": f"tumble: {of}, a part of it" if task.is_trial else f"tumble: {of}",
                # An input counts as fatal only if several workers end with it, so the last trial is repeated.
                "max_retries": 0 if task.is_trial and not self._is_last(task) else _RETRIES,
                # If an object store does not answer, the task is repeated: the clip is not the cause.
                "retry_exceptions": [OSError],
                "num_cpus": 1,
            }
            if self._memory is not None:
                options["memory"] = self._memory
            if self._job.has_gpu and task.device is None:
                options |= {"num_cpus": 0, "num_gpus": 1}
            if self._refused:
                nodes = ",".join(self._refused)
                options["label_selector"] = {"ray.io/node-id": f"!in({nodes})"}
            self._running[self._run.options(**options).remote(self._job, task)] = task

    def _check_machines(self) -> None:
        """Waiting for a machine that may take part is endless where there is none."""
        alive = {node["NodeID"] for node in self._ray.nodes() if node["Alive"]}
        if self._refused and alive <= set(self._refused):
            machines = ", ".join(sorted(self._refused.values()))
            message = f"no machine has the same version of Tumble as this one: {machines}"
            raise DistributedError(message, USAGE)

    def _collect(self) -> None:
        if not self._running:
            return
        # Querying thousands of tasks takes longer than running them, and the oldest usually end first.
        oldest = list(itertools.islice(self._running, _ASKED))
        ready, rest = self._ray.wait(oldest, num_returns=1, timeout=0.05, fetch_local=False)
        if ready and rest:
            ready += self._ray.wait(rest, num_returns=len(rest), timeout=0, fetch_local=False)[0]
        if not ready:
            every = list(self._running)
            ready, _ = self._ray.wait(every, num_returns=1, timeout=0.5, fetch_local=False)
        crashes = (
            self._ray.exceptions.WorkerCrashedError,
            self._ray.exceptions.NodeDiedError,
            self._ray.exceptions.OutOfMemoryError,
            self._ray.exceptions.LocalRayletDiedError,
        )
        for reference in ready:
            task = self._running.pop(reference)
            try:
                reply = self._ray.get(reference)
            except crashes as error:
                self._crashed(task, str(error).strip().splitlines()[0])
            except self._ray.exceptions.RayTaskError as error:
                code = OUTPUT if isinstance(error.cause, OSError) else 1
                raise DistributedError(f"shard {task.shard}: {error.cause!r}", code) from error
            else:
                self._ended(task, reply)

    def _ended(self, task: Task, reply: Entry) -> None:
        machine = f"{reply['host']} ({reply['node'][:8]})"
        if "other_wheel" in reply:
            self._refused[reply["node"]] = f"{machine}: {reply['other_wheel']}"
            self._check_machines()
            self._todo.appendleft(task)
            return
        if "code" in reply:
            message = f"shard {task.shard} on {machine}: {reply['message']}"
            raise DistributedError(message, reply["code"] or DEVICE)
        self._workers.add((reply["node"], reply["pid"]))
        if task.is_trial:
            self._tried(task, is_sound=True)
            return
        self._made += reply["made"]
        self._skipped += reply["skipped"]
        self._progress.rotations += reply["rotations"]
        self._progress.failed += len(reply["failed"])
        self._progress.inputs_done += len(task.inputs) + len(task.refused)
        self._progress.shards_done += 1

    def _crashed(self, task: Task, why: str) -> None:
        """Ray tries the task of a worker that ended again, a few times. A task that ends every worker is
        halved, down to the inputs that cause it; each of these is tried on the CPU."""
        if not task.is_trial:
            self._retried += 1
            apart = self._apart.setdefault(task.shard, _Apart(self._inputs(task.shard)))
            apart.rounds += 1
            if apart.rounds > _ROUNDS:
                message = f"shard {task.shard} crashes every worker, but none of its inputs does so alone: {why}"
                raise DistributedError(message, 1)
            left_out = {path for path, _ in task.refused}
            inputs = tuple(item for item in apart.inputs if item.path not in left_out)
            apart.waiting += 1
            self._todo.appendleft(Task(task.shard, inputs, True, task.device))
            return
        if len(task.inputs) > 1:
            middle = len(task.inputs) // 2
            self._apart[task.shard].waiting += 1
            for half in (task.inputs[middle:], task.inputs[:middle]):
                self._todo.appendleft(Task(task.shard, half, True, task.device))
            return
        if not self._is_last(task):
            self._todo.appendleft(Task(task.shard, task.inputs, True, "cpu"))
            return
        path = task.inputs[0].path
        message = f"{path}: ends the process that evaluates it, alone and on the CPU: {why}"
        self._apart[task.shard].guilty.append((path, message))
        self._tried(task, is_sound=False)

    def _is_last(self, task: Task) -> bool:
        """One input, on the CPU: nothing else is left to try."""
        return len(task.inputs) == 1 and (task.device or self._job.device) == "cpu"

    def _tried(self, task: Task, *, is_sound: bool) -> None:
        apart = self._apart[task.shard]
        apart.waiting -= 1
        apart.needs_cpu |= is_sound and task.device == "cpu"
        if apart.waiting:
            return
        guilty = {path for path, _ in apart.guilty}
        inputs = tuple(item for item in apart.inputs if item.path not in guilty)
        device = "cpu" if apart.needs_cpu else None
        self._todo.appendleft(Task(task.shard, inputs, False, device, tuple(apart.guilty)))
