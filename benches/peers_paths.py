#!/usr/bin/env python3
"""Tumble's `follow` and `smooth` beside what else there is, on one machine, one after another.

* Frames along paths: double reflection (Wang et al. 2008) in NumPy, over all paths at once, and
  `Curve.computeFrenetFrames` of three.js, in node. Both give frames at evenly spaced parameters
  and err with their step; Tumble's are curves, right at every time.
* Smoothing: SciPy's `convolve1d`, which filters numbers: three to a vector. Beside rotations it does
  no work that counts; nothing there filters rotations.

    pip install numpy scipy
    npm install --prefix target/three three
    cargo build --release
    python3 benches/peers_paths.py
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import time

import numpy
from scipy.ndimage import convolve1d

ROOT = pathlib.Path(__file__).resolve().parent.parent
SAMPLES = 60

THREE = """
const { CatmullRomCurve3, Vector3 } = require('three');
const paths = +process.argv[1], samples = +process.argv[2];
let seed = 1;
const unit = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
const all = Array.from({ length: paths }, () => {
  const place = new Vector3(), way = new Vector3(1, 0, 0);
  const points = Array.from({ length: 6 }, () => {
    way.add(new Vector3(unit() - 0.5, unit() - 0.5, unit() - 0.5)).normalize();
    return place.add(way).clone();
  });
  return new CatmullRomCurve3(points, false, 'catmullrom');
});
const times = [];
for (let turn = 0; turn < 4; turn++) {
  const started = process.hrtime.bigint();
  for (const path of all) {
    path.needsUpdate = true;
    const frames = path.computeFrenetFrames(samples - 1, false);
    path.getPoints(samples - 1);
    if (frames.normals.length !== samples) throw new Error();
  }
  times.push(Number(process.hrtime.bigint() - started) / 1e6);
}
console.log(JSON.stringify(times.slice(1)));
"""


def unit(vectors):
    return vectors / numpy.maximum(numpy.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def paths(random, count):
    """Paths of six points, (count, 6, 3), float32."""
    direction, point = numpy.tile([1.0, 0.0, 0.0], (count, 1)), numpy.zeros((count, 3))
    points = []
    for _ in range(6):
        direction = unit(direction + random.uniform(-0.5, 0.5, (count, 3)))
        point = point + direction
        points.append(point)
    return numpy.stack(points, 1).astype(numpy.float32)


def double_reflection(points):
    """Positions and frames, (paths, samples, 3) and (paths, samples, 3, 3)."""
    inner = (points[:, 2:] - points[:, :-2]) / 2
    first = 2 * (points[:, 1:2] - points[:, :1]) - inner[:, :1]
    last = 2 * (points[:, -1:] - points[:, -2:-1]) - inner[:, -1:]
    slopes = numpy.concatenate([first, inner, last], 1)
    at = numpy.arange(SAMPLES, dtype=numpy.float32) / 12
    i = numpy.minimum(at.astype(int), 4)
    t = (at - i)[:, None].astype(numpy.float32)
    p0, p1, m0, m1 = points[:, i], points[:, i + 1], slopes[:, i], slopes[:, i + 1]
    positions = p0 * (2 * t**3 - 3 * t**2 + 1) + m0 * (t**3 - 2 * t**2 + t)
    positions = positions + p1 * (3 * t**2 - 2 * t**3) + m1 * (t**3 - t**2)
    tangents = (p1 - p0) * (6 * t - 6 * t**2) + m0 * (3 * t**2 - 4 * t + 1) + m1 * (3 * t**2 - 2 * t)
    tangents = unit(tangents)
    ups = numpy.empty_like(tangents)
    up = numpy.cross(tangents[:, 0], numpy.cross([0, 1, 0], tangents[:, 0]))
    ups[:, 0] = up = unit(up)

    def reflected(vector, normal):
        square = numpy.maximum((normal * normal).sum(-1, keepdims=True), 1e-30)
        return vector - normal * (2 * (normal * vector).sum(-1, keepdims=True) / square)

    for sample in range(1, SAMPLES):
        chord = positions[:, sample] - positions[:, sample - 1]
        up, tangent = reflected(up, chord), reflected(tangents[:, sample - 1], chord)
        ups[:, sample] = up = reflected(up, tangents[:, sample] - tangent)
    return positions, numpy.stack([numpy.cross(ups, tangents), ups, tangents], -1)


def milliseconds(work, rounds):
    work()
    times = []
    for _ in range(rounds):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return statistics.median(times)


def tumble(kind, shrink, rounds):
    """Milliseconds of each row of `tumble bench`."""
    program = ROOT / "target/release/tumble"
    line = [program, "bench", kind, "--cpu-only", "--json"]
    line += ["--shrink", str(shrink), "--rounds", str(rounds)]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    sections = json.loads(done.stdout)["sections"]
    return [(s["method"], r["name"], r["milliseconds"]) for s in sections for r in s["rows"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shrink", type=int, default=1, help="divides every workload")
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    shrink, rounds = arguments.shrink, arguments.rounds
    random = numpy.random.default_rng(1)

    count = 100_000 // shrink
    print(f"{count} paths of 6 points, {SAMPLES} samples each: ms")
    for _, name, time_of in tumble("follow", shrink, rounds):
        print(f"  tumble bench: {name:34} {time_of:10.1f}")
    points = paths(random, count)
    numpys = milliseconds(lambda: double_reflection(points), rounds)
    print(f"  NumPy, double reflection                         {numpys:10.1f}")
    three = ROOT / "target/three"
    if (three / "node_modules/three").exists():
        path_count = max(count // 100, 1)
        line = ["node", "-e", THREE, str(path_count), str(SAMPLES)]
        done = subprocess.run(line, cwd=three, capture_output=True, text=True, check=True)
        theirs = statistics.median(json.loads(done.stdout)) * count / path_count
        print(f"  three.js, computeFrenetFrames, of {path_count} paths        {theirs:10.1f}")

    samples = 1_000_000 // shrink
    print(f"64 tracks of {samples} samples, smoothed: ms")
    for kernel, name, time_of in tumble("smooth", shrink, rounds):
        print(f"  tumble bench: {kernel:12} {name:30} {time_of:10.1f}")
    values = random.random((64, samples, 3), dtype=numpy.float32)
    gauss = numpy.exp(-0.125 * numpy.arange(-8, 9) ** 2)
    for name, weights in ("linear", [0.25, 0.5, 0.25]), ("gaussian:2", gauss / gauss.sum()):
        # SciPy is fastest if time is the last axis and each component is a separate row.
        rows = numpy.ascontiguousarray(values.transpose(0, 2, 1))
        scipys = milliseconds(lambda: convolve1d(rows, weights, axis=-1), min(rounds, 3))
        print(f"  SciPy, convolve1d: {name:12} vectors              {scipys:10.1f}")


if __name__ == "__main__":
    main()
