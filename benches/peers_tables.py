#!/usr/bin/env python3
"""Tumble beside pyarrow and NumPy, in one run, in turns: the same clips of 22 joints and 240 frames
are read from NPZ, Parquet and Arrow, beside reading their bytes alone. The peers' result is arrays;
Tumble's is tracks, checked and normalised. All files are in the system's cache.

    pip install numpy pyarrow ./python
    python3 benches/peers_tables.py
"""

import argparse
import pathlib
import statistics
import tempfile
import time

import numpy
import pyarrow
import pyarrow.parquet
import tumble

JOINTS, FRAMES, RATE = 22, 240, 30
COLUMNS = ["time", "track", "x", "y", "z", "w", "tx", "ty", "tz"]


def clip(random, path):
    """An NPZ clip: joints on random walks of up to 3 degrees a frame, and where they are."""
    steps = numpy.radians(random.uniform(-3, 3, (JOINTS, FRAMES, 4)))
    walk = numpy.cumsum(steps, 1) + random.standard_normal((JOINTS, 1, 4))
    keys = walk / numpy.linalg.norm(walk, axis=2, keepdims=True)
    translations = numpy.cumsum(random.uniform(-0.1, 0.1, (JOINTS, FRAMES, 3)), 1)
    numpy.savez(
        path,
        rotations=keys.astype(numpy.float32),
        translations=translations.astype(numpy.float32),
        times=numpy.arange(FRAMES) / RATE,
        names=numpy.array([f"joint{joint}" for joint in range(JOINTS)]),
    )


def arrays(table):
    return [column.combine_chunks() if name == "track" else column.to_numpy()
            for name, column in zip(table.column_names, table.columns)]


def from_parquet(path):
    return arrays(pyarrow.parquet.read_table(path, columns=COLUMNS))


def from_arrow(path):
    with pyarrow.OSFile(str(path)) as file:
        return arrays(pyarrow.ipc.open_file(file).read_all())


def from_npz(path):
    with numpy.load(path) as archive:
        return [archive[name] for name in archive.files]


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("--clips", type=int, default=20)
parser.add_argument("--rounds", type=int, default=20)
arguments = parser.parse_args()

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    random = numpy.random.default_rng(1)
    names = [folder / f"clip{number}" for number in range(arguments.clips)]
    for name in names:
        clip(random, name.with_suffix(".npz"))
        for ending in [".parquet", ".arrow"]:
            tumble.save(name.with_suffix(ending), tumble.load(name.with_suffix(".npz")).clip)
    print(f"{arguments.clips} clips; medians of {arguments.rounds}, a clip")
    for ending, peer, read in [
        (".npz", "NumPy", from_npz),
        (".parquet", "pyarrow", from_parquet),
        (".arrow", "pyarrow", from_arrow),
    ]:
        paths = [name.with_suffix(ending) for name in names]
        contestants = {
            "bytes": pathlib.Path.read_bytes,
            f"{peer}, to arrays": read,
            "tumble.load": tumble.load,
        }
        seconds = {name: [] for name in contestants}
        for iteration in range(arguments.rounds + 1):
            for name, work in contestants.items():
                started = time.perf_counter()
                for path in paths:
                    work(path)
                if iteration > 0:
                    seconds[name].append((time.perf_counter() - started) / len(paths))
        medians = {name: statistics.median(times) for name, times in seconds.items()}
        for name, median in medians.items():
            print(f"{ending[1:]:8} {name:20} {1e6 * median:8.0f} us  {median / medians['bytes']:6.1f} x")
