"""Numbers that are not ours: every curve and every output that SciPy or the package
`splines` has too, compared with what the program writes.

    python3 check.py TUMBLE FOLDER

`splines` 0.3.3 has ends of its own ("natural", by another formula) and no closed curves
for all, so of its curves the segments are compared whose two keys are both inner ones.
"""

import pathlib
import subprocess
import sys

import numpy as np
import splines.quaternion as peer
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

TUMBLE, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
FPS = 31
worst = {}


def generate(name, *options):
    path = FOLDER / f"{name}.dat"
    command = [TUMBLE, "generate", "--keys", "12", "--seconds", "9", *options, "-o", path, "--overwrite"]
    subprocess.run(command, check=True, capture_output=True)
    table = np.loadtxt(path)
    return path, table[:, 0], table[:, 1:].reshape(len(table), -1, 4)


def evaluate(path, *options):
    out = FOLDER / "out.npy"
    command = [TUMBLE, "eval", path, "-o", out, "--overwrite", "--fps", str(FPS), *options]
    subprocess.run(command, check=True, capture_output=True)
    return np.load(out).astype(float)


def xyzw(wxyz):
    return np.roll(wxyz, -1, axis=-1)


def angles(found, expected):
    """Between rotations, radians: by the chord, which loses nothing where it is small."""
    found = found / np.linalg.norm(found, axis=-1, keepdims=True)
    expected = expected / np.linalg.norm(expected, axis=-1, keepdims=True)
    chord = np.minimum(
        np.linalg.norm(found - expected, axis=-1), np.linalg.norm(found + expected, axis=-1)
    )
    return 4 * np.arcsin(np.minimum(chord / 2, 1))


def check(what, error, bound):
    error = float(np.max(error))
    worst[what] = max(worst.get(what, 0), error)
    if not error <= bound:
        sys.exit(f"{what}: {error:.3e} is more than {bound:.0e}")


def keys_of(path, times, keys):
    """The keys as f32, normalised, with which the program computes."""
    keys = keys.astype(np.float32).astype(float)
    return keys / np.linalg.norm(keys, axis=-1, keepdims=True)


def unit(wxyz):
    return peer.UnitQuaternion.from_unit_xyzw(tuple(xyzw(wxyz)))


def evaluated(curve, at):
    return np.array([curve.evaluate(t).xyzw for t in at])


def shoemake(keys, times):
    """Shoemake 1985, as a curve of `splines`; its keys' signs are aligned."""
    quats = list(peer.canonicalized([unit(key) for key in keys]))
    q = np.array([quat.wxyz for quat in quats])

    def double(p, q):
        return 2 * np.dot(p, q) * q - p

    def bisect(p, q):
        return (p + q) / np.linalg.norm(p + q)

    a, b = {}, {}
    for i in range(1, len(q) - 1):
        inner = peer.slerp(quats[i], unit(bisect(double(q[i - 1], q[i]), q[i + 1])), 1 / 3)
        a[i] = inner
        b[i] = unit(double(np.array(inner.wxyz), q[i]))
    segments = [(quats[i], a[i], b[i + 1], quats[i + 1]) for i in range(1, len(q) - 2)]
    return peer.DeCasteljau(segments, times[1:-1])


for name, options in [("even", ["--uniform"]), ("uneven", ["--random", "--seed", "5"])]:
    path, times, raw = generate(name, *options)
    frames = evaluate(path, "-m", "slerp").shape[1]
    at = np.minimum(times[0] + np.arange(frames) / FPS, times[-1])
    inner = (at >= times[1]) & (at <= times[-2])
    found = {m: evaluate(path, "-m", m) for m in ["slerp", "c2", "shoemake-1985", "bessel-overhauser-mean"]}
    tcb = (0.3, -0.4, 0.5)
    given = [f"--{word}={value}" for word, value in zip(["tension", "continuity", "bias"], tcb)]
    found["kochanek-bartels"] = evaluate(path, "-m", "kochanek-bartels", *given)
    rates = {w: evaluate(path, "-m", "c2", "--quantity", w) for w in ["velocity", "acceleration"]}
    for track in range(raw.shape[1]):
        keys = keys_of(path, times, raw[:, track])
        rotations = Rotation.from_quat(xyzw(keys))
        expected = Slerp(times, rotations)(at).as_quat()
        check(f"slerp, {name}", angles(found["slerp"][track], expected), 1e-6)
        spline = RotationSpline(times, rotations)
        check(f"c2, {name}", angles(found["c2"][track], spline(at).as_quat()), 1e-6)
        for order, what in [(1, "velocity"), (2, "acceleration")]:
            expected = spline(at, order)
            error = np.linalg.norm(rates[what][track] - expected, axis=-1)
            check(f"c2's {what}, {name}", error / np.abs(expected).max(), 1e-6)
        quats = [unit(key) for key in keys]
        curves = {
            "bessel-overhauser-mean": peer.CatmullRom(quats, list(times)),
            "kochanek-bartels": peer.KochanekBartels(quats, list(times), tcb=tcb),
            "shoemake-1985": shoemake(keys, list(times)),
        }
        for method, curve in curves.items():
            expected = evaluated(curve, at[inner])
            check(f"{method}, {name}", angles(found[method][track][inner], expected), 1e-6)

# `splines` closes every squad; on even keys its helpers are those of the textbook.
path, times, raw = generate("closed", "--uniform", "--seed", "9")
table = np.loadtxt(path)
table[-1, 1:] = table[0, 1:]
header = path.read_text().split("\n", 1)[0][2:]
np.savetxt(path, table, header=header, fmt="%.9g")
found = evaluate(path, "-m", "squad", "--ends", "loop")
at = np.minimum(times[0] + np.arange(found.shape[1]) / FPS, times[-1])
for track in range(raw.shape[1]):
    keys = keys_of(path, times, table[:, 1:].reshape(len(table), -1, 4)[:, track])
    curve = peer.Squad([unit(key) for key in keys[:-1]], list(times))
    check("squad, closed", angles(found[track], evaluated(curve, at)), 1e-6)

# Outputs, from the very quaternions that the program gives.
path, times, raw = generate("outputs", "--random", "--seed", "11")
quats = evaluate(path)
rotations = Rotation.from_quat(quats.reshape(-1, 4))
matrices = rotations.as_matrix().reshape(*quats.shape[:2], 3, 3)
check("matrix", np.abs(evaluate(path, "--quantity", "matrix") - matrices), 1e-6)
columns = evaluate(path, "--quantity", "matrix", "--major", "column")
check("matrix, columns", np.abs(np.swapaxes(columns, 2, 3) - matrices), 1e-6)
check("matrix-3x4", np.abs(evaluate(path, "--quantity", "matrix-3x4")[..., :3] - matrices), 1e-6)
turned = evaluate(path, "--quantity", "axis-angle")
vectors = turned[..., :3] * np.radians(turned[..., 3:])
back = Rotation.from_rotvec(vectors.reshape(-1, 3))
check("axis-angle", (back.inv() * rotations).magnitude(), 1.5e-6)
for letters in ["xyz", "XYZ"]:
    x, y, z = letters
    proper = [a + b + c for a in letters for b in letters for c in letters if a != b and b != c]
    for sequence in proper:
        found = evaluate(path, "--quantity", "euler", "--sequence", sequence)
        expected = rotations.as_euler(sequence, degrees=True).reshape(found.shape)
        apart = np.abs((found - expected + 180) % 360 - 180)
        # Near the gimbal the first and the third are only known together.
        middle = np.radians(expected[..., 1])
        lever = np.abs(np.sin(middle) if sequence[0] == sequence[2] else np.cos(middle))
        check(f"euler {sequence}", np.radians(apart) * np.minimum(1, lever)[..., None], 2e-6)

# The chain: each box hangs at the end of the one before it.
length = float(path.read_text().split("\n", 1)[0].split()[2])
world = evaluate(path, "--quantity", "world")
above, hung = Rotation.identity(len(world)), np.zeros((len(world), 3))
for track in range(raw.shape[1]):
    if track > 0:
        hung = hung + above.apply([0, -length, 0])
    above = above * Rotation.from_quat(quats[track])
    check("world, positions", np.abs(world[:, track, :3] - hung) / length, 3e-6)
    check("world, rotations", angles(world[:, track, 3:], above.as_quat()), 1e-6)

for what, error in worst.items():
    print(f"{what}: {error:.1e}")
