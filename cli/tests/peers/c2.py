"""The method c2 beside SciPy's `RotationSpline`, on random keys.

    python3 c2.py TUMBLE FOLDER SETS

Steps of 0.3 to 2 radians, intervals up to 100 : 1 apart. Where SciPy's acceleration is continuous, as SciPy
comes (ten rounds) or iterated until it converges, so is c2's, and the curve is the same to 1e-6 rad; everywhere else
it is continuous, or the program warns. Whether c2's is continuous follows here from its velocities at the keys.
"""

import pathlib
import subprocess
import sys

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

TUMBLE, FOLDER, SETS = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
# Keys lie on every second frame.
KEYS_PER_SECOND, FPS = 40, 80
ITERATED = 60
rng = np.random.default_rng(20)


def random_set(path):
    """Writes a set of one track; its key times, and its keys as the program has them."""
    keys = rng.integers(4, 18)
    ratio = 100 ** rng.uniform()
    gaps = np.maximum(np.round(ratio ** rng.uniform(size=keys - 1)), 1)
    times = np.concatenate([[0], np.cumsum(gaps)]) / KEYS_PER_SECOND
    axes = rng.normal(size=(keys - 1, 3))
    vectors = axes / np.linalg.norm(axes, axis=1, keepdims=True) * rng.uniform(0.3, 2)
    rotations = [Rotation.random(random_state=int(rng.integers(1 << 30)))]
    for vector in vectors:
        rotations.append(rotations[-1] * Rotation.from_rotvec(vector))
    quats = np.array([rotation.as_quat() for rotation in rotations]).astype(np.float32)
    lines = [f"{time:.3f} {w!s} {x!s} {y!s} {z!s}" for time, (x, y, z, w) in zip(times, quats)]
    path.write_text("# 1 1.0\n" + "\n".join(lines) + "\n")
    return times, quats.astype(float)


def cross(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def accelerations(vector, h, start, end):
    """The coefficients of an interval whose rotation vector is a cubic, from the velocities at its two ends."""
    angle = np.linalg.norm(vector)
    v = cross(vector)
    k1, k2 = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    to_velocity = np.eye(3) - k1 * v + k2 * v @ v
    a, b = start * h, np.linalg.solve(to_velocity, end * h)
    # The second derivatives of the cubic, and at its end how `to_velocity` changes with the rate `b`.
    at_start = 6 * vector - 4 * a - 2 * b
    at_end = -6 * vector + 2 * a + 4 * b
    slope = vector @ b / angle
    d1 = (np.sin(angle) * angle - 2 * (1 - np.cos(angle))) / angle**3 * slope
    d2 = ((1 - np.cos(angle)) * angle - 3 * (angle - np.sin(angle))) / angle**4 * slope
    w = cross(b)
    change = -d1 * v - k1 * w + d2 * v @ v + k2 * (w @ v + v @ w)
    return at_start / h**2, (to_velocity @ at_end + change @ b) / h**2


def jump(times, rotations, velocities):
    """The largest jump of the acceleration at a key, relative to the largest acceleration there."""
    vectors = (rotations[:-1].inv() * rotations[1:]).as_rotvec()
    sides = [
        accelerations(vector, h, start, end)
        for vector, h, start, end in zip(vectors, np.diff(times), velocities, velocities[1:])
    ]
    worst = 0
    for (_, before), (behind, _), h, next_h, speed in zip(
        sides, sides[1:], np.diff(times), np.diff(times)[1:], np.linalg.norm(velocities[1:], axis=1)
    ):
        size = np.linalg.norm(before) + np.linalg.norm(behind) + speed * (1 / h + 1 / next_h)
        worst = max(worst, np.linalg.norm(before - behind) / size)
    return worst


def spline(times, rotations, rounds):
    RotationSpline.MAX_ITER = rounds
    with np.errstate(all="ignore"):
        try:
            curve = RotationSpline(times, rotations)
            velocities = curve(times, 1)
            # At the last key SciPy's velocity is that of its cubic's end.
            return curve, jump(times, rotations, velocities)
        except (ValueError, np.linalg.LinAlgError):
            return None, np.inf


def angles(found, expected):
    chord = np.minimum(
        np.linalg.norm(found - expected, axis=-1), np.linalg.norm(found + expected, axis=-1)
    )
    return 4 * np.arcsin(np.minimum(chord / 2, 1))


def evaluate(*options):
    out = FOLDER / "-".join(("out",) + options[1:])
    command = [TUMBLE, "eval", FOLDER / "sets", "-o", out, "--fps", str(FPS), "-m", "c2", "--device", "cpu"]
    run = subprocess.run(command + list(options), capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(run.stderr)
    return out, run.stderr


(FOLDER / "sets").mkdir()
sets = [random_set(FOLDER / "sets" / f"{index:05}.dat") for index in range(SETS)]
curves, said = evaluate()
rates, _ = evaluate("--quantity", "velocity")
counts = dict.fromkeys(
    ["sets", "c2 continuous", "warned", "SciPy continuous as it comes", "SciPy continuous iterated"], 0
)
farthest = steepest = 0
for index, (times, quats) in enumerate(sets):
    rotations = Rotation.from_quat(quats)
    found = np.load(curves / f"{index:05}.npy")[0].astype(float)
    velocities = np.load(rates / f"{index:05}.npy")[0].astype(float)
    assert velocities.shape[-1] == 3 and len(found) == len(velocities)
    frames = np.round(times * FPS).astype(int)
    our_jump = jump(times, rotations, velocities[frames])
    warned = f"{index:05}.dat:track" in said and "W014" in said
    counts["sets"] += 1
    counts["c2 continuous"] += our_jump < 1e-5
    counts["warned"] += warned
    if not (our_jump < 1e-5 or warned):
        sys.exit(f"set {index}: c2's acceleration jumps by {our_jump:.1e}, and nothing is said")
    if warned and our_jump < 1e-7:
        sys.exit(f"set {index}: a warning about a jump of {our_jump:.1e}")
    at = np.minimum(np.arange(len(found)) / FPS, times[-1])
    for rounds, name in [(10, "as it comes"), (ITERATED, "iterated")]:
        curve, theirs = spline(times, rotations, rounds)
        if theirs < 1e-9:
            counts[f"SciPy continuous {name}"] += 1
            if warned:
                sys.exit(f"set {index}: SciPy's acceleration is continuous, and c2's is not")
            apart = np.max(angles(found, curve(at).as_quat()))
            farthest = max(farthest, apart)
            if apart > 1e-6:
                sys.exit(f"set {index}: {apart:.1e} rad from SciPy's curve ({name})")
    steepest = max(steepest, 0 if warned else our_jump)
for name, count in counts.items():
    print(f"{name}: {count}")
print(f"the farthest from SciPy: {farthest:.1e} rad; c2's largest jump: {steepest:.1e}")
