"""The whole way of a trainer of humanoids, with the guide alone: 1 000 files like those of AMASS, a library of
them, the workers of a DataLoader, and 4 096 environments that step 1 000 times with velocities, on one thread and
on two, and on a Vulkan device, with the contacts of the feet; then the same instances as a crowd. All are to have the
same bits.
With --figures, beside NumPy, and torch and roma where they are installed: the time of a step and of windows, of reading
the files, and the memory of 300 clips. Every time is the shortest of several runs.

    python training.py --figures [--files 1000] [--steps 1000] [--environments 4096]
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import os
import pathlib
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import tumble
from tumble.features import contacts

STEP = 1 / 60
PARENTS = [None, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
OFFSETS = np.random.default_rng(3).normal(scale=0.1, size=(len(PARENTS), 3))
SAMPLED = ("rotations", "positions", "velocities", "angular_velocities")


def write_files(folder: pathlib.Path, files: int) -> None:
    """Swinging bodies of 22 joints, 60 to 600 frames at 30 Hz."""
    rng = np.random.default_rng(1)
    for index in range(files):
        frames = int(rng.integers(60, 600))
        poses = np.cumsum(0.02 * rng.normal(size=(frames, 3 * len(PARENTS))), axis=0)
        trans = np.cumsum(0.01 * rng.normal(size=(frames, 3)), axis=0)
        np.savez(folder / f"{index:04}.npz", poses=poses, trans=trans, mocap_framerate=np.float64(30))


def run(library: tumble.MotionLibrary[Any], steps: int, environments: int) -> tuple[float, str]:
    """Seconds a step, and a sum of all bits. A library on a device makes new arrays at every step, which NumPy has by
    DLPack; others fill the same arrays."""
    rng = np.random.default_rng(2)
    ids = rng.integers(0, len(library), environments)
    times = library.sample_times(ids, rng)
    state: Any = library.sample(ids, times, arrays=SAMPLED)
    fills = library.device == "CPU"
    bits, spent = hashlib.sha256(), 0.0
    for _ in range(steps):
        times += STEP
        over = times > library.lengths[ids]
        ids[over] = rng.integers(0, len(library), int(over.sum()))
        times[over] = 0.0
        started = time.perf_counter()
        state = library.sample(ids, times, out=state) if fills else library.sample(ids, times, arrays=SAMPLED)
        arrays = {name: np.from_dlpack(getattr(state, name)) for name in SAMPLED}
        spent += time.perf_counter() - started
        touching = contacts(arrays["positions"], arrays["velocities"], up="y", height=0.1, speed=0.15)
        for array in (*arrays.values(), touching):
            bits.update(np.ascontiguousarray(array).data)
    return spent / steps, bits.hexdigest()


class Windows:
    """A data set for a DataLoader: windows of 64 frames of clips."""

    def __init__(self, library: tumble.MotionLibrary) -> None:
        self.library = library

    def __len__(self) -> int:
        return len(self.library)

    def __getitem__(self, index: int) -> np.ndarray[Any, Any]:
        times = np.minimum(np.arange(64) / 30, self.library.lengths[index])
        found = self.library.sample(np.full(64, index), times, arrays=["rotations"]).rotations
        assert found is not None
        return found


WINDOWS: Windows | None = None


def window(index: int) -> np.ndarray[Any, Any]:
    assert WINDOWS is not None
    return WINDOWS[index]


def load_in_workers(library: tumble.MotionLibrary) -> tuple[str, float, str]:
    """All windows by two forked workers: by whom, seconds, and the sum of their bits."""
    global WINDOWS
    windows = WINDOWS = Windows(library)
    bits = hashlib.sha256()
    started = time.perf_counter()
    try:
        from torch.utils.data import DataLoader
    except ImportError:
        with multiprocessing.get_context("fork").Pool(2) as pool:
            for one in pool.imap(window, range(len(windows)), chunksize=16):
                bits.update(one.data)
        return "multiprocessing.Pool", time.perf_counter() - started, bits.hexdigest()
    loader = DataLoader(windows, batch_size=16, num_workers=2, multiprocessing_context="fork")
    for batch in loader:
        bits.update(batch.numpy().data)
    return "torch's DataLoader", time.perf_counter() - started, bits.hexdigest()


@dataclass(frozen=True)
class Cost:
    """Seconds that something took, and seconds of processors in all threads, which other programs disturb less."""

    wall: float
    processors: float


def shortest(work: Callable[[], Any], runs: int = 20) -> Cost:
    costs = []
    for _ in range(runs):
        started, used = time.perf_counter(), time.process_time()
        work()
        costs.append(Cost(time.perf_counter() - started, time.process_time() - used))
    return Cost(min(cost.wall for cost in costs), min(cost.processors for cost in costs))


class Tables:
    """Five arrays as other motion libraries keep and sample them: a row for each frame of rotations relative to parents
    and in the world, positions and both velocities. Between two rows rotations are slerped, the rest is lerped."""

    def __init__(self, library: tumble.MotionLibrary) -> None:
        self.counts = np.round(library.lengths * library.rates).astype(int) + 1
        ids = np.repeat(np.arange(len(library)), self.counts)
        self.starts = np.cumsum(self.counts) - self.counts
        state = library.sample(ids, (np.arange(len(ids)) - self.starts[ids]) / library.rates[ids])
        self.turned = [state.rotations, state.world_rotations]
        self.moved = [state.positions, state.velocities, state.angular_velocities]

    def sample(self, module: Any, turned: Any, moved: Any, first: Any, t: Any) -> list[Any]:
        """By NumPy or torch, whose functions have the same names."""
        s, found = t[:, None, None], []
        for table in turned:
            a, b = table[first], table[first + 1]
            cosine = (a * b).sum(-1)[..., None]
            b, half = module.where(cosine < 0, -b, b), module.arccos(module.clip(abs(cosine), None, 1.0))
            sine = module.sin(half)
            q = (module.sin((1 - s) * half) * a + module.sin(s * half) * b) / sine
            found.append(module.where(sine < 1e-3, a * (1 - s) + b * s, q))
        return found + [table[first] * (1 - s) + table[first + 1] * s for table in moved]


def others(library: tumble.MotionLibrary, tables: Tables, ids: Any, times: Any) -> dict[str, Cost]:
    """Seconds of rotations alone and of five arrays in NumPy, and with torch and roma if they are installed."""
    place = np.clip(times, 0, library.lengths[ids]) * library.rates[ids]
    frame = np.minimum(place.astype(int), tables.counts[ids] - 2)
    first, t = tables.starts[ids] + frame, (place - frame).astype(np.float32)

    def by(module: Any, turned: Any, moved: Any, first: Any, t: Any) -> dict[str, Callable[[], Any]]:
        return {
            "rotations": lambda: tables.sample(module, turned[:1], [], first, t),
            "five arrays": lambda: tables.sample(module, turned, moved, first, t),
        }

    found = {}
    with np.errstate(divide="ignore", invalid="ignore"):
        for name, work in by(np, tables.turned, tables.moved, first, t).items():
            found[f"{name}: NumPy"] = shortest(work)
    try:
        import roma
        import torch
    except ImportError:
        return found
    turned, moved = ([torch.from_numpy(table) for table in of] for of in (tables.turned, tables.moved))
    rows, steps = torch.from_numpy(first), torch.from_numpy(t)

    def by_roma() -> Any:
        # Each environment needs one step of its clip. roma's slerp would compute every step for every environment.
        a, b = turned[0][rows], turned[0][rows + 1]
        arc = roma.unitquat_to_rotvec(roma.quat_product(roma.quat_conjugation(a), b))
        return roma.quat_product(a, roma.rotvec_to_unitquat(steps[:, None, None] * arc))

    for threads in (1, 2):
        torch.set_num_threads(threads)
        on = f"{threads} thread{'s' if threads > 1 else ''}"
        for name, work in by(torch, turned, moved, rows, steps).items():
            found[f"{name}: torch, {on}"] = shortest(work)
        found[f"rotations: roma, {on}"] = shortest(by_roma)
    return found


def of_instances(library: tumble.MotionLibrary, ids: Any, times: Any) -> dict[str, Cost]:
    """Seconds of the library for the same, and with other options."""
    found: dict[str, Cost] = {}

    def add(name: str, **options: Any) -> None:
        state: Any = library.sample(ids, times, **options)
        again = {option: value for option, value in options.items() if option != "arrays"}
        found[name] = shortest(lambda: library.sample(ids, times, out=state, **again))

    add("rotations: tumble", arrays=["rotations"])
    for kind in ("matrix", "6d", "rotvec"):
        add(f"rotations: tumble, {kind}", arrays=["rotations"], rotations=kind)
    add("rotations: tumble, wxyz", arrays=["rotations"], order="wxyz")
    add("five arrays: tumble", arrays=None)
    add("five arrays: tumble, finite=True", finite=True)
    return found


def smooth(clips: list[tumble.Clip], ids: Any, times: Any) -> dict[str, Cost]:
    """Seconds of five arrays of libraries whose method is smooth."""
    found = {}
    for method in ("bessel-overhauser", "c2"):
        library = tumble.MotionLibrary(clips, method=method, skeleton=(PARENTS, OFFSETS))
        of = ids % len(library)
        at = np.minimum(times, library.lengths[of])
        state = library.sample(of, at)
        found[f"five arrays of {len(clips)} clips: {method}"] = shortest(lambda: library.sample(of, at, out=state))
    return found


def reading(folder: pathlib.Path) -> dict[str, Cost]:
    """Seconds of reading all files: their arrays alone, and a library."""
    paths = sorted(folder.glob("[0-9]*.npz"))

    def arrays() -> None:
        for path in paths:
            with np.load(path) as file:
                dict(file)

    def library() -> None:
        tumble.MotionLibrary.load(paths, skeleton=(PARENTS, OFFSETS))

    return {
        f"{len(paths)} files: np.load": shortest(arrays, 3),
        f"{len(paths)} files: tumble.MotionLibrary.load": shortest(library, 3),
    }


def resident() -> int:
    """Bytes of memory that this process has."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def grown(folder: pathlib.Path, kind: str) -> int:
    """Bytes by which a process grows that loads tables, or a library of the first 300 clips, and samples each."""
    warm = tumble.MotionLibrary.load(folder / "0000.npz", skeleton=(PARENTS, OFFSETS))
    warm.sample(0, 0.0)
    before = resident()
    if kind == "tables":
        with np.load(folder / "tables.npz") as file:
            kept: Any = dict(file)
    else:
        kept = tumble.MotionLibrary.load(
            sorted(folder.glob("[0-9]*.npz"))[:300], skeleton=(PARENTS, OFFSETS), packed=kind == "packed"
        )
        kept.sample(np.arange(len(kept)), 0.5)
    after = resident()
    del kept
    return after - before


def print_memory(folder: pathlib.Path, tables: Tables) -> None:
    """Bytes of 300 clips, each in a process of its own. Only Linux says them."""
    if not os.path.exists("/proc/self/statm"):
        return
    rows = int(tables.counts[:300].sum())
    arrays = [table[:rows] for table in tables.turned + tables.moved]
    np.savez(folder / "tables.npz", *arrays)
    first = 0
    for kind in ("tables", "library", "packed"):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            grew = pool.apply(grown, (folder, kind))
        first = first or grew
        print(f"  {f'300 clips: {kind}':46} {grew / 1e6:9.2f} MB {grew / first:7.2f} ×")


def print_figures(figures: dict[str, Cost]) -> None:
    """Figures, and how many times the first of their group each is."""
    bases: dict[str, Cost] = {}
    for name, cost in figures.items():
        base = bases.setdefault(name.split(":")[0], cost)
        wall = f"{1e3 * cost.wall:9.2f} ms {cost.wall / base.wall:7.2f} ×"
        processors = f"{1e3 * cost.processors:9.2f} ms of processors {cost.processors / base.processors:7.2f} ×"
        print(f"  {name:46} {wall} {processors}")


def print_all_figures(
    library: tumble.MotionLibrary, clips: list[tumble.Clip], folder: pathlib.Path, ids: Any, times: Any
) -> None:
    """Everything that the top of this file names."""
    tables = Tables(library)
    print(f"{len(ids)} environments, and 512 windows of 10 states")
    print_figures(others(library, tables, ids, times) | of_instances(library, ids, times))
    starts = np.repeat(times[:512], 10) + np.tile(np.arange(10) / 30, 512)
    in_windows = others(library, tables, np.repeat(ids[:512], 10), starts)
    windows = library.sample_windows(ids[:512], times[:512], 10, fps=30)
    in_windows["five arrays: tumble"] = shortest(
        lambda: library.sample_windows(ids[:512], times[:512], 10, fps=30, out=windows)
    )
    print_figures({f"windows, {name}": figure for name, figure in in_windows.items()})
    print_figures(smooth(clips[:200], ids, times))
    print_figures(reading(folder))
    print_memory(folder, tables)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--figures", action="store_true")
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--environments", type=int, default=4096)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        write_files(folder, options.files)
        started = time.perf_counter()
        skeleton = (PARENTS, OFFSETS)
        library = tumble.MotionLibrary.load(folder / "*.npz", skeleton=skeleton)
        print(f"{library} of {options.files} files in {time.perf_counter() - started:.2f} s")
        library.save(folder / "motions.npz")
        library = tumble.MotionLibrary.open(folder / "motions.npz")

        by, seconds, bits = load_in_workers(library)
        alone = hashlib.sha256()
        for index in range(len(library)):
            alone.update(window(index).data)
        same = bits == alone.hexdigest()
        print(f"{len(library)} windows by two forked workers ({by}): {seconds:.2f} s, the same bits: {same}")

        clips = [tumble.load(path).clip for path in sorted(folder.glob("[0-9]*.npz"))]
        rng = np.random.default_rng(4)
        ids = rng.integers(0, len(library), options.environments)
        times = library.sample_times(ids, rng)
        if options.figures:
            print_all_figures(library, clips, folder, ids, times)

        devices = {"one thread": tumble.Engine("cpu", threads=1), "two threads": tumble.Engine("cpu", threads=2)}
        try:
            devices["Vulkan"] = tumble.Engine("vulkan")
        except tumble.DeviceError as error:
            print(f"  no Vulkan device: {error}")
        sums = set()
        for name, engine in devices.items():
            device = engine if name == "Vulkan" else None
            opened: Any = tumble.MotionLibrary.open(folder / "motions.npz", engine=engine, device=device)
            seconds, bits = run(opened, options.steps, options.environments)
            sums.add(bits)
            print(
                f"  {options.steps} steps, {name} ({engine.device}): {1e3 * seconds:.2f} ms a step, sha256 {bits[:16]}…"
            )
        crowds = set()
        some = clips[:200]  # as many as the buffers of small devices hold
        for name, engine in devices.items():
            crowd = tumble.Crowd(some, options.environments, parents=PARENTS, offsets=OFFSETS, engine=engine)
            crowd.set(np.arange(options.environments), ids % len(some), time=times, wrap="hold")
            bits = hashlib.sha256(crowd.evaluate().data).hexdigest()
            crowds.add(bits)
            print(f"  a crowd of them, {name} ({engine.device}): sha256 {bits[:16]}…")
        assert len(sums) == len(crowds) == 1 and same, "the bits differ"
        print("all have the same bits")


if __name__ == "__main__":
    main()
