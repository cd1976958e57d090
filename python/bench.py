"""How fast the package is, beside SciPy and beside the engine called from Rust.

    ./scripts/wheel.sh && pip install target/wheels/*.whl scipy && python python/bench.py

Each figure is the shortest of several runs; Rust's is that of `examples/into_memory.rs`.
"""

from __future__ import annotations

import gc
import os
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

import tumble

TRACKS, KEYS, FRAMES = 4096, 26, 1200
ROOT = pathlib.Path(__file__).parents[1]


def shortest(work: Callable[[], Any], runs: int) -> float:
    """Seconds."""
    work()
    best = float("inf")
    for _ in range(runs):
        started = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - started)
    return best


def unit(rng: np.random.Generator, *shape: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    keys = rng.normal(size=(*shape, 4))
    return (keys / np.linalg.norm(keys, axis=-1, keepdims=True)).astype(np.float32)


def keys_of_the_example() -> np.ndarray[Any, np.dtype[np.float32]]:
    """The keys of `examples/into_memory.rs`: how long slerp takes depends on how far keys turn."""
    place = np.arange(TRACKS * KEYS, dtype=np.float32)
    axes = np.stack([np.sin(place * 0.7), np.cos(place * 1.3), np.ones_like(place)], axis=-1)
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    half = place * 0.55
    keys = np.concatenate([axes * np.sin(half)[:, None], np.cos(half)[:, None]], axis=-1)
    return keys.astype(np.float32).reshape(TRACKS, KEYS, 4)


def resident() -> int:
    """Bytes of memory that this process has."""
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def rust() -> float:
    """Seconds of the same work by the engine, called from Rust, into memory that exists."""
    command = ["cargo", "run", "--release", "--quiet", "-p", "tumble", "--example", "into_memory"]
    arguments = ["--", *map(str, (TRACKS, KEYS, FRAMES))]
    done = subprocess.run(command + arguments, cwd=ROOT, capture_output=True, text=True, check=True)
    return float(done.stdout)


def few(rng: np.random.Generator) -> None:
    """A few samples of long tracks."""
    tracks, count = 24, 100_000
    keys = np.concatenate(
        [0.1 * rng.normal(size=(tracks, count, 3)), np.ones((tracks, count, 1))], axis=-1
    )
    keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
    moved = [rng.normal(size=(count, 3)), *[None] * (tracks - 1)]
    clip = tumble.Clip(np.arange(count) / 60, keys, translations=moved)
    engine, at = tumble.Engine("cpu"), rng.uniform(0.0, count / 60, 64)
    works: dict[str, Callable[[], Any]] = {
        "rotations, by track": lambda: engine.evaluate(clip, at=at, method="slerp"),
        "rotations, by frame": lambda: engine.evaluate(clip, at=at, method="slerp", layout="frame"),
        "rotations, looped": lambda: engine.evaluate(clip, at=at, method="slerp", after="loop"),
        "poses": lambda: engine.poses(clip, at=at, method="slerp"),
        "velocities": lambda: engine.velocity(clip, at=at, method="slerp"),
        "accelerations": lambda: engine.acceleration(clip, at=at, method="slerp"),
        "rotations, smooth": lambda: engine.evaluate(clip, at=at, method="bessel-overhauser"),
        "velocities, smooth": lambda: engine.velocity(clip, at=at, method="bessel-overhauser"),
    }
    print(f"64 times of {tracks} tracks x {count} keys; velocities are to take 3 x as long as rotations at the most")
    rotations = 0.0
    for name, work in works.items():
        seconds = shortest(work, 20)
        if name.startswith("rotations") and "looped" not in name and "frame" not in name:
            rotations = seconds
        print(f"  {name:26s}  {1e3 * seconds:9.2f} ms   {seconds / rotations:5.1f} x rotations")


def motions(rng: np.random.Generator) -> None:
    """4 096 instances of 1 000 clips with 24 joints, as they are asked for in every step of training."""
    clips, joints, pairs = 1000, 24, 4096
    frames = rng.integers(60, 600, clips)
    # All clips have one skeleton.
    parents = [None, *rng.integers(0, np.arange(1, joints))]
    made = []
    for count in frames:
        turn = np.cumsum(0.02 * rng.normal(size=(joints, count, 3)), axis=1)
        angle = np.linalg.norm(turn, axis=-1, keepdims=True)
        axis = turn / np.maximum(angle, 1e-9)
        keys = np.concatenate([axis * np.sin(angle / 2), np.cos(angle / 2)], axis=-1)
        root = np.cumsum(0.01 * rng.normal(size=(count, 3)), axis=0)
        made.append(
            tumble.Clip(
                np.arange(count) / 30,
                keys,
                parents=parents,
                offsets=0.1 * rng.normal(size=(joints, 3)),
                translations=[root, *[None] * (joints - 1)],
            )
        )
    library = tumble.MotionLibrary(made, skeleton=made[0])
    flat = np.concatenate(
        [np.stack([clip.keys(joint) for joint in range(joints)], axis=1) for clip in made]
    )
    starts = np.cumsum(frames) - frames
    ids = rng.integers(0, clips, pairs)
    times = library.sample_times(ids, rng)

    def gathered(ids: Any, times: Any) -> Any:
        """As the libraries of training projects have it."""
        place = np.minimum((times * 30).astype(int), frames[ids] - 2)
        t = (times * 30 - place).astype(np.float32)[:, None, None]
        a, b = flat[starts[ids] + place], flat[starts[ids] + place + 1]
        cosine = (a * b).sum(axis=-1, keepdims=True)
        b, cosine = np.where(cosine < 0, -b, b), np.abs(cosine)
        half = np.arccos(np.clip(cosine, -1, 1))
        sine = np.sin(half)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = (np.sin((1 - t) * half) * a + np.sin(t * half) * b) / sine
        return np.where(sine < 1e-3, a * (1 - t) + b * t, found)

    def loop() -> None:
        for place in range(pairs):
            gathered(ids[place : place + 1], times[place : place + 1])

    out = library.sample(ids, times)
    rotations = library.sample(ids, times, arrays=["rotations"])
    theirs = shortest(lambda: gathered(ids, times), 10)
    ours = shortest(lambda: library.sample(ids, times, out=rotations), 30)
    all_five = shortest(lambda: library.sample(ids, times, out=out), 30)
    one_by_one = shortest(loop, 1)
    print(f"{pairs} instances of {clips} clips x {joints} joints")
    print(f"  NumPy, gathered, rotations  {1e3 * theirs:9.2f} ms")
    print(f"  a loop over the instances   {1e3 * one_by_one:9.2f} ms")
    print(f"  rotations                   {1e3 * ours:9.2f} ms   {ours / theirs:.2f} x as long")
    print(f"  all five arrays             {1e3 * all_five:9.2f} ms   {all_five / theirs:.2f} x as long")
    bodies = 30
    robot = robots(rng, bodies, frames)
    state = robot.sample(ids, times)
    of_robot = shortest(lambda: robot.sample(ids, times, out=state), 30)
    each, of_joints = (1e9 * seconds / pairs for seconds in (of_robot / bodies, all_five / joints))
    print(f"  a robot of {bodies} bodies, all    {1e3 * of_robot:9.2f} ms   {each:.0f} ns a body; {of_joints:.0f} ns a joint above")


def robots(rng: np.random.Generator, bodies: int, frames: Any) -> tumble.MotionLibrary:
    """As many clips of a robot whose bodies have a hinge each, but the root."""
    axes = ["1 0 0", "0 1 0", "0 0 1"]
    open_bodies, text = 1, '<body name="b0"><freejoint name="root"/>'
    for body in range(1, bodies):
        # Chains of six bodies, from the root on.
        if open_bodies == 7:
            text, open_bodies = text + "</body>" * 6, 1
        text += f'<body name="b{body}" pos="0 0 0.1"><joint name="j{body}" axis="{axes[body % 3]}"/>'
        open_bodies += 1
    file = pathlib.Path(tempfile.mkdtemp(), "robot.xml")
    file.write_text(f"<mujoco><worldbody>{text}{'</body>' * open_bodies}</worldbody></mujoco>")
    made = []
    for count in frames:
        angles = np.cumsum(0.02 * rng.normal(size=(bodies - 1, count)), axis=1)
        half = np.cumsum(0.01 * rng.normal(size=count))
        keys = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
        root = np.cumsum(0.01 * rng.normal(size=(count, 3)), axis=0)
        at = np.arange(count) / 30
        scalars = {f"j{index + 1}": (at, angles[index]) for index in range(bodies - 1)}
        made.append(tumble.Clip(at, keys[None], layout="track", names=["root"], translations=[root], scalars=scalars))
    return tumble.MotionLibrary(made, robot=tumble.Robot.load(file), order="wxyz")


def main() -> None:
    rng = np.random.default_rng(1)
    times = np.linspace(0.0, 20.0, KEYS)
    keys = keys_of_the_example()
    clip, engine = tumble.Clip(times, keys), tumble.Engine("cpu")
    at = np.linspace(0.0, 20.0, FRAMES)
    fps = f"{FRAMES - 1}/20"
    out = np.empty((TRACKS, FRAMES, 4), np.float32)
    assert clip.frames(fps) == FRAMES

    def into() -> None:
        engine.evaluate(clip, fps=fps, method="slerp", out=out)

    ours = shortest(into, 20)
    fresh = shortest(lambda: engine.evaluate(clip, fps=fps, method="slerp"), 10)
    explicit = shortest(lambda: engine.evaluate(clip, at=at, method="slerp", out=out), 10)
    arrays = shortest(lambda: tumble.evaluate(times, keys, fps=fps, method="slerp", out=out), 10)
    some = 64

    def scipy() -> None:
        for track in range(some):
            Slerp(times, Rotation.from_quat(keys[track]))(at).as_quat()

    theirs = shortest(scipy, 3) * TRACKS / some
    native = rust()
    print(f"{TRACKS} tracks x {KEYS} keys x {FRAMES} frames, slerp")
    print(f"  into an array that exists   {1e3 * ours:9.2f} ms")
    print(f"  from Rust, likewise         {1e3 * native:9.2f} ms   {ours / native:.2f} x as long here")
    print(f"  into a fresh array          {1e3 * fresh:9.2f} ms")
    print(f"  at explicit times           {1e3 * explicit:9.2f} ms")
    print(f"  from arrays of keys         {1e3 * arrays:9.2f} ms")
    print(f"  SciPy, a loop over tracks   {1e3 * theirs:9.2f} ms   {theirs / ours:.0f} x as long")

    small_times, small_keys = np.linspace(0.0, 2.0, 8), unit(rng, 4, 8)
    small, small_at = tumble.Clip(small_times, small_keys), np.linspace(0.0, 2.0, 500)
    store = np.empty((4, 500, 4), np.float32)

    def many(work: Callable[[], Any]) -> float:
        def hundred() -> None:
            for _ in range(100):
                work()

        return shortest(hundred, 30) / 100

    by_clip = many(lambda: engine.evaluate(small, at=small_at, method="slerp", out=store))
    by_rate = many(lambda: engine.evaluate(small, fps=249.5, method="slerp", out=store))
    by_keys = many(lambda: tumble.evaluate(small_times, small_keys, at=small_at, method="slerp"))
    print("4 tracks x 500 frames, slerp")
    print(f"  of a clip, at times         {1e6 * by_clip:9.2f} us")
    print(f"  of a clip, at a rate        {1e6 * by_rate:9.2f} us")
    print(f"  from arrays                 {1e6 * by_keys:9.2f} us")

    pose = many(lambda: engine.evaluate(clip, at=7.7, method="slerp"))
    print(f"one pose of {TRACKS} tracks        {1e6 * pose:9.2f} us")
    one = many(lambda: engine.evaluate(small, at=0.7, method="slerp"))
    print(f"one pose of 4 tracks          {1e6 * one:9.2f} us")

    poses = rng.uniform(0.0, 20.0, 10_000)
    few(rng)
    motions(rng)

    grown = []
    for _ in range(3):
        before = resident()
        for moment in poses:
            engine.evaluate(small, at=moment, method="slerp")
        grown.append(resident() - before)
    print(f"ten thousand poses            {min(grown) / 1024:9.0f} KiB more memory")


if __name__ == "__main__":
    main()
