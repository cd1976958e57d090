"""The cost of a library over processes and machines: measured here, and modelled for a cluster.

    python benches/distributed.py measure --tumble target/release/tumble 200 2000 20000
    python benches/distributed.py simulate --clips 1000000 --nodes 100 --cores 16

`measure` wants the Python package and Ray; it makes clips of 22 tracks of 120 random keys, four seconds,
whose 241 frames at 60 a second are 85 kB of NPY, and evaluates them by one process, by two that divide the
shards, and by a Ray cluster of two nodes of one processor. `simulate` plays a run through, event by event,
with constants that `measure` gave; docs/distributed.md has the results.
"""

from __future__ import annotations

import argparse
import heapq
import pathlib
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time


# More clips than these are links to them.
DIFFERENT = 200


def make(folder: pathlib.Path, clips: int) -> None:
    import numpy as np

    rng = np.random.default_rng(1)
    for i in range(clips):
        path = folder / f"{i % 100:02}" / f"{i:06}.dat"
        path.parent.mkdir(parents=True, exist_ok=True)
        if i >= DIFFERENT:
            path.hardlink_to(folder / f"{i % 100:02}" / f"{i % DIFFERENT:06}.dat")
            continue
        keys = rng.normal(size=(120, 22, 4))
        keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
        times = np.linspace(0, 4, 120)
        rows = (" ".join(f"{x:.6f}" for x in [t, *row]) for t, row in zip(times, keys.reshape(120, -1)))
        path.write_text("# 22 1\n" + "\n".join(rows) + "\n")


def measure(program: str, counts: list[int], work: str | None) -> None:
    """Milliseconds a clip while working, and seconds of the whole run."""
    from ray.cluster_utils import Cluster

    import tumble.distributed

    def run(command: str, folder: pathlib.Path) -> float:
        started = time.perf_counter()
        subprocess.run(command, shell=True, check=True, cwd=folder, stderr=subprocess.DEVNULL)
        return time.perf_counter() - started

    with tempfile.TemporaryDirectory(dir=work) as temporary:
        folder = pathlib.Path(temporary)
        made = 0
        options = "--fps 60 -m bessel-overhauser --device cpu"
        for count in counts:
            if made < count:
                shutil.rmtree(folder / "clips", ignore_errors=True)
                make(folder / "clips", count)
                made = count
            seconds = {}
            seconds["tumble eval"] = run(f"{program} eval clips -o one {options}", folder)
            parts = 2
            seconds["two processes"] = run(
                f"seq {parts} | xargs -P2 -I{{}} {program} eval clips -o two {options} --shard {{}}/{parts}"
                f" && {program} merge two",
                folder,
            )
            cluster = Cluster(
                initialize_head=True,
                head_node_args={"num_cpus": 1, "object_store_memory": 80 << 20, "include_dashboard": False},
            )
            cluster.add_node(num_cpus=1, object_store_memory=80 << 20)
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            started = time.perf_counter()
            first: list[float] = []

            def progress(_: object) -> None:
                if not first:
                    first.append(time.perf_counter())

            report = tumble.distributed.evaluate(
                str(folder / "clips"), folder / "ray", fps=60, method="bessel-overhauser",
                address=cluster.address, resume=False, progress=progress,
            )
            seconds["Ray"] = time.perf_counter() - started
            cluster.shutdown()
            after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            for name, whole in seconds.items():
                print(f"{count:7} clips, {name:14} {whole:7.2f} s, {1e3 * whole / count:6.2f} ms a clip")
            print(f"        of Ray's, {report.seconds:.2f} s planning, working and merging;"
                  f" {report.shards} shards; driver {before / 1024:.0f} MB before, {after / 1024:.0f} at most")
            manifest = folder / "ray" / "manifest.jsonl"
            manifest.write_text(manifest.read_text().replace(f'"input":"{folder}/', '"input":"'))
            for other in ("two", "ray"):
                subprocess.run(["diff", "-rq", "one", other], check=True, cwd=folder)
                shutil.rmtree(folder / other)
            shutil.rmtree(folder / "one")


def simulate(model: argparse.Namespace) -> None:
    """One driver hands shards to workers; workers read and write one storage; nodes are lost at times."""
    chance = random.Random(1)
    shards = -(-model.clips // model.shard)
    workers = model.nodes * model.cores
    storage = 0.0  # when it has done all that it was given
    driver = 0.0
    free = [(model.start, worker) for worker in range(workers)]
    heapq.heapify(free)
    lost = sorted(chance.uniform(0, model.horizon) for _ in range(model.losses))
    again = finished = 0
    end = 0.0
    todo = shards
    while todo:
        ready, worker = heapq.heappop(free)
        # A task is handed out as soon as the driver reaches it: with 32 tasks per core in flight, the driver
        # never waits for a worker.
        driver += model.task / 1e3
        begin = max(ready, driver)
        work = model.shard * model.clip / 1e3 * chance.uniform(0.9, 1.1)
        done = begin + work
        moved = model.shard * (model.read + model.written) / 1e3 / model.rate  # kB over MB/s
        storage = max(storage, begin) + moved
        done = max(done, storage)
        if lost and lost[0] < done:
            lost.pop(0)
            # The shards that the node's workers had begun are done again by other workers. This entry
            # stands for all workers of the node; it returns later.
            again += model.cores
            todo += model.cores - 1
            heapq.heappush(free, (done + model.back, worker))
            continue
        todo -= 1
        finished += 1
        end = max(end, done)
        heapq.heappush(free, (done, worker))
    merge = model.clips * model.merge / 1e6
    total = model.plan * model.clips / 1e6 + end + merge
    ideal = model.clips * model.clip / 1e3 / workers
    print(f"{model.clips} clips of {model.clip} ms in {shards} shards on {workers} workers:")
    print(f"  planned in {model.plan * model.clips / 1e6:.1f} s, worked {end:.1f} s, merged {merge:.1f} s: {total:.1f} s")
    print(f"  the clips alone {ideal:.1f} s; driver busy {shards * model.task / 1e3:.1f} s, "
          f"storage {finished * model.shard * (model.read + model.written) / 1e3 / model.rate:.1f} s; "
          f"{again} shards done again")
    print(f"  manifest {model.clips * model.line / 1e6:.0f} MB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, dest="command")
    measured = commands.add_parser("measure")
    measured.add_argument("counts", nargs="+", type=int)
    measured.add_argument("--tumble", default=f"{sys.executable} -m tumble")
    measured.add_argument("--work", help="where to make clips and results")
    model = commands.add_parser("simulate")
    number = {"type": float}
    model.add_argument("--clips", type=int, default=1_000_000)
    model.add_argument("--shard", type=int, default=256, help="clips")
    model.add_argument("--nodes", type=int, default=100)
    model.add_argument("--cores", type=int, default=16)
    model.add_argument("--clip", **number, default=0.94, help="ms of one core")
    model.add_argument("--task", **number, default=1.2, help="ms of the driver for a shard")
    model.add_argument("--start", **number, default=1.9, help="s until workers run")
    model.add_argument("--read", **number, default=105, help="kB of a clip")
    model.add_argument("--written", **number, default=85, help="kB of a result")
    model.add_argument("--rate", **number, default=5000, help="MB/s of the storage, all in all")
    model.add_argument("--plan", **number, default=7.0, help="s for 10^6 clips")
    model.add_argument("--merge", **number, default=7.6, help="s for 10^6 lines")
    model.add_argument("--line", **number, default=512, help="bytes of the manifest for a clip")
    model.add_argument("--losses", type=int, default=0, help="nodes lost")
    model.add_argument("--horizon", **number, default=60, help="s in which they are lost")
    model.add_argument("--back", **number, default=30, help="s until one is back")
    arguments = parser.parse_args()
    if arguments.command == "measure":
        measure(arguments.tumble, arguments.counts, arguments.work)
    else:
        simulate(arguments)


if __name__ == "__main__":
    main()
