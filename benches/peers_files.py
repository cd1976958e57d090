#!/usr/bin/env python3
"""Tumble beside Python's readers of BVH and SciPy, in one run, in turns: the same clips are read
and resampled to twice their rate. Tumble runs as a program, which also writes its results; the
others read (`bvh`, `bvhio`), and SciPy's Slerp resamples what `bvh` read.

    pip install numpy scipy bvh bvhio
    cargo build --release
    python3 benches/peers_files.py
"""

import argparse
import pathlib
import statistics
import subprocess
import tempfile
import time

import bvh
import bvhio
import numpy
from scipy.spatial.transform import Rotation, Slerp

ROOT = pathlib.Path(__file__).resolve().parent.parent
JOINTS, FRAMES, RATE = 22, 240, 30


def clip(random):
    """The text of a clip: a chain of joints, each on a random walk of up to 3 degrees a frame."""
    lines = ["HIERARCHY", "ROOT joint0", "{", "OFFSET 0 0 0"]
    lines.append("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation")
    for joint in range(1, JOINTS):
        lines += [f"JOINT joint{joint}", "{", "OFFSET 0 0.5 0"]
        lines.append("CHANNELS 3 Zrotation Xrotation Yrotation")
    lines += ["End Site", "{", "OFFSET 0 0.5 0", "}"] + ["}"] * JOINTS
    lines += ["MOTION", f"Frames: {FRAMES}", f"Frame Time: {1 / RATE:.7f}"]
    steps = random.uniform(-3, 3, (FRAMES, 3 + 3 * JOINTS))
    for row in numpy.cumsum(steps, 0):
        lines.append(" ".join(f"{value:.6f}" for value in row))
    return "\n".join(lines) + "\n"


def scipy_resampled(path):
    """Rotations of every joint at twice the rate."""
    with open(path) as file:
        mocap = bvh.Bvh(file.read())
    frames = numpy.array(mocap.frames, dtype=float)
    times = numpy.arange(len(frames)) * mocap.frame_time
    at = numpy.linspace(0, times[-1], 2 * len(frames) - 1)
    result = []
    for joint in range(JOINTS):
        angles = frames[:, 3 + 3 * joint : 6 + 3 * joint]
        keys = Rotation.from_euler("ZXY", angles, degrees=True)
        result.append(Slerp(times, keys)(at).as_quat())
    return numpy.stack(result)


def each(paths, read):
    return lambda: [read(path) for path in paths]


def tumble(paths, folder):
    command = [arguments.tumble, "eval", *paths, "-o", folder, "--overwrite"]
    command += ["--to", "npz", "--fps", str(2 * RATE), "--device", "cpu"]
    return lambda: subprocess.run(command, capture_output=True, check=True)


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("--tumble", default=ROOT / "target/release/tumble")
parser.add_argument("--clips", type=int, default=20)
parser.add_argument("--rounds", type=int, default=5)
arguments = parser.parse_args()

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    random = numpy.random.default_rng(1)
    paths = [folder / f"clip{number}.bvh" for number in range(arguments.clips)]
    for path in paths:
        path.write_text(clip(random))
    contestants = {
        "tumble eval, resampled and written": tumble(paths, folder / "out"),
        "bvh, read": each(paths, lambda path: bvh.Bvh(path.read_text())),
        "bvhio, read": each(paths, lambda path: bvhio.readAsHierarchy(str(path))),
        "bvh and SciPy, resampled": each(paths, scipy_resampled),
    }
    seconds = {name: [] for name in contestants}
    for iteration in range(arguments.rounds + 1):
        for name, work in contestants.items():
            started = time.perf_counter()
            work()
            if iteration > 0:
                seconds[name].append(time.perf_counter() - started)

medians = {name: statistics.median(times) for name, times in seconds.items()}
first = next(iter(medians.values()))
print(f"{arguments.clips} clips of {JOINTS} joints and {FRAMES} frames; medians of {arguments.rounds}")
for name, median in medians.items():
    print(f"{name:36} {1e3 * median:9.1f} ms  {median / first:7.1f} x")
