#!/usr/bin/env python3
"""Tumble beside SciPy, in one run, in turns: both read the same keys from one file and
give the rotations of every track at every frame as one array. Tumble runs as a
program, so starting it, reading the text and the pipe count on its side; SciPy's
curves are made anew each time, as Tumble's are.

    pip install numpy scipy
    cargo build --release
    python3 benches/peers.py
"""

import argparse
import io
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

ROOT = pathlib.Path(__file__).resolve().parent.parent


def read(path):
    """Times (s) and rotations of each track of a .dat file."""
    lines = path.read_text().split("\n")
    boxes = int(lines[0].split()[1])
    table = numpy.loadtxt(path)
    tracks = []
    for box in range(boxes):
        w, x, y, z = table[:, 1 + 4 * box : 5 + 4 * box].T
        tracks.append((table[:, 0], Rotation.from_quat(numpy.stack([x, y, z, w], 1))))
    return tracks


def tumble(path, method):
    command = [arguments.tumble, "eval", path, "-o", "-", "--device", "cpu"]
    command += ["-m", method, "--fps", str(arguments.fps)]
    output = subprocess.run(command, capture_output=True, check=True).stdout
    return numpy.load(io.BytesIO(output))


def scipy_curves(tracks, curve, frames):
    return numpy.stack([curve(times, keys)(frames).as_quat() for times, keys in tracks])


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("--tumble", default=ROOT / "target/release/tumble")
parser.add_argument("--boxes", type=int, default=256)
parser.add_argument("--fps", type=int, default=60)
parser.add_argument("--rounds", type=int, default=7)
arguments = parser.parse_args()

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "keys.dat"
    command = [arguments.tumble, "generate", "--boxes", str(arguments.boxes), "--random"]
    subprocess.run(command + ["-o", path], capture_output=True, check=True)
    tracks = read(path)
    frames = numpy.arange(20 * arguments.fps + 1) / arguments.fps
    contestants = {
        "tumble slerp": lambda: tumble(path, "slerp"),
        "scipy Slerp": lambda: scipy_curves(read(path), Slerp, frames),
        "tumble bessel-overhauser": lambda: tumble(path, "bessel-overhauser"),
        "scipy RotationSpline": lambda: scipy_curves(read(path), RotationSpline, frames),
    }
    seconds = {name: [] for name in contestants}
    results = {}
    for turn in range(arguments.rounds + 1):
        for name, evaluate in contestants.items():
            started = time.perf_counter()
            results[name] = evaluate()
            if turn > 0:
                seconds[name].append(time.perf_counter() - started)

rotations = arguments.boxes * len(frames)
print(f"{arguments.boxes} tracks of 26 keys, {len(frames)} frames; medians of {arguments.rounds}")
for name, times in seconds.items():
    median = statistics.median(times)
    print(f"{name:28} {median * 1e3:10.1f} ms {rotations / median / 1e6:10.1f} M/s")
ours, theirs = results["tumble slerp"], results["scipy Slerp"]
distance = numpy.minimum(
    numpy.linalg.norm(ours - theirs, axis=2), numpy.linalg.norm(ours + theirs, axis=2)
)
print(f"largest distance of the two slerps: {distance.max():.1e}")
