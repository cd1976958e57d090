#!/usr/bin/env python3
"""Python's contestants, on the keys that the others read: SciPy's Slerp and RotationSpline, a slerp of
NumPy's arrays as one would write it, and roma's (torch) where it is installed.

    scipy_peers.py KEYS FOLDER    called by race.py
"""

import json
import pathlib
import statistics
import struct
import sys
import time

import numpy
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

# How often a contestant is measured in one call of this program; the result is the median of
# several calls.
ROUNDS = 1
# SciPy makes a curve for each track in Python. Therefore at most so many tracks are measured, and the
# time is scaled to all of them.
MAX_TRACKS = 512


def read(path):
    data = path.read_bytes()
    tracks, keys, frames, rate = struct.unpack_from("<IIId", data)
    times = numpy.frombuffer(data, "<f8", tracks * keys, 20).reshape(tracks, keys)
    rotations = numpy.frombuffer(data, "<f4", tracks * keys * 4, 20 + times.nbytes)
    return times, rotations.reshape(tracks, keys, 4), numpy.arange(frames) / rate


def scipy(curve, times, keys, at):
    def run():
        rows = [curve(t, Rotation.from_quat(q))(at).as_quat() for t, q in zip(times, keys)]
        return numpy.stack(rows)

    return run


def intervals(times, at):
    """The interval of each sample of each track, and the part of the interval before it."""
    index = numpy.stack([numpy.searchsorted(row, at, side="right") for row in times]) - 1
    index = index.clip(0, times.shape[1] - 2)
    start, end = (numpy.take_along_axis(times, index + step, 1) for step in (0, 1))
    return index, ((at - start) / (end - start)).clip(0, 1).astype(numpy.float32)


def numpy_slerp(times, keys, at):
    def run():
        index, t = intervals(times, at)
        rows = numpy.arange(len(times))[:, None]
        a, b = keys[rows, index], keys[rows, index + 1]
        dot = numpy.einsum("tfc,tfc->tf", a, b)
        b = numpy.where(dot[..., None] < 0, -b, b)
        angle = numpy.arccos(numpy.abs(dot).clip(0, 1))
        # For equal keys, all weights give the same result.
        sine = numpy.where(angle < 1e-4, 1, numpy.sin(angle))
        wa = numpy.where(angle < 1e-4, 1 - t, numpy.sin((1 - t) * angle) / sine)
        wb = numpy.where(angle < 1e-4, t, numpy.sin(t * angle) / sine)
        return wa[..., None] * a + wb[..., None] * b

    return run


def roma_slerp(times, keys, at):
    import roma
    import torch

    keys = torch.from_numpy(keys.copy())

    def run():
        index, t = intervals(times, at)
        index, t = torch.from_numpy(index), torch.from_numpy(t)
        rows = torch.arange(len(times))[:, None]
        a, b = keys[rows, index], keys[rows, index + 1]
        b = torch.where((a * b).sum(-1, keepdim=True) < 0, -b, b)
        # This is roma's own formula, with a separate amount for each pair.
        difference = roma.unitquat_to_rotvec(roma.quat_product(roma.quat_conjugation(a), b))
        return roma.quat_product(a, roma.rotvec_to_unitquat(t[..., None] * difference)).numpy()

    return run


keys_path, folder = map(pathlib.Path, sys.argv[1:])
all_times, all_keys, at = read(keys_path)
contestants = [
    ("NumPy by hand", "slerp", len(all_times), numpy_slerp),
    ("SciPy Slerp", "slerp", MAX_TRACKS, lambda *keys: scipy(Slerp, *keys)),
    ("SciPy RotationSpline", "smooth", MAX_TRACKS, lambda *keys: scipy(RotationSpline, *keys)),
]
try:
    import roma  # noqa: F401

    contestants.append(("roma (torch)", "slerp", len(all_times), roma_slerp))
except ImportError:
    print(json.dumps({"missing": "roma (torch)", "why": "pip install roma"}))
for name, work, tracks, contestant in contestants:
    tracks = min(tracks, len(all_times))
    run = contestant(all_times[:tracks], all_keys[:tracks], at)
    seconds = []
    for iteration in range(ROUNDS + 1):
        started = time.perf_counter()
        result = run()
        if iteration > 0:
            seconds.append(time.perf_counter() - started)
    file = folder / f"{name}.f32"
    result[0].astype("<f4").tofile(file)
    milliseconds = 1e3 * statistics.median(seconds) * len(all_times) / tracks
    line = {"name": name, "work": work, "ms": milliseconds, "row": file.name, "threads": "as it likes"}
    line["threads"] = "1" if name.startswith(("SciPy", "NumPy")) else "all"
    print(json.dumps(line))
