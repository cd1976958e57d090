"""Samples clips as a trainer of humanoids does, without the training: 4 096 environments, each at a time of
its own in a clip of its own, step after step. Prints how long a step takes, and a sum of all bits of the
results, which is the same on every machine.

    python steps.py [motions.npz] [--steps 300]
"""

from __future__ import annotations

import argparse
import hashlib
import time

import numpy as np

import tumble

ENVIRONMENTS = 4096
STEP = 1 / 60


def invented(clips: int = 200, joints: int = 24) -> tumble.MotionLibrary:
    """A library of clips that stand for recorded ones: swinging joints. No function that platforms round differently
    is used, so that the keys are the same everywhere."""
    rng = np.random.default_rng(1)
    parents = [None, *(int(rng.integers(0, joint)) for joint in range(1, joints))]
    offsets = rng.integers(-8, 9, (joints, 3)) / 16
    made = []
    for _ in range(clips):
        frames = int(rng.integers(40, 400))
        walk = np.cumsum(rng.integers(-2, 3, (joints, frames, 3)), axis=1) / 64
        keys = np.concatenate([walk, np.ones((joints, frames, 1))], axis=-1)
        x, y, z, w = np.moveaxis(keys, -1, 0)
        keys /= np.sqrt(((x * x + y * y) + z * z) + w * w)[..., None]
        root = np.cumsum(rng.integers(-2, 3, (frames, 3)), axis=0) / 256
        made.append(
            tumble.Clip(
                np.arange(frames) / 32,
                keys,
                parents=parents,
                offsets=offsets,
                translations=[root, *[None] * (joints - 1)],
            )
        )
    return tumble.MotionLibrary(made)


def run(library: tumble.MotionLibrary, steps: int, environments: int = ENVIRONMENTS) -> tuple[float, str]:
    """Seconds a step, and the sum."""
    rng = np.random.default_rng(2)
    ids = rng.integers(0, len(library), environments)
    times = library.lengths[ids] * rng.random(environments)
    state = library.sample(ids, times)
    bits = hashlib.sha256()
    spent = 0.0
    for _ in range(steps):
        times += STEP
        over = times > library.lengths[ids]
        # When an episode ends, the environment continues in another clip.
        ids[over] = rng.integers(0, len(library), int(over.sum()))
        times[over] = 0.0
        started = time.perf_counter()
        library.sample(ids, times, out=state)
        spent += time.perf_counter() - started
        for array in (state.rotations, state.positions, state.velocities, state.angular_velocities):
            assert array is not None
            bits.update(array.tobytes())
    return spent / steps, bits.hexdigest()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("library", nargs="?", help="what MotionLibrary.save wrote")
    parser.add_argument("--steps", type=int, default=300)
    arguments = parser.parse_args()
    library = tumble.MotionLibrary.open(arguments.library) if arguments.library else invented()
    seconds, bits = run(library, arguments.steps)
    print(f"{ENVIRONMENTS} environments of {library}: {1e3 * seconds:.2f} ms a step, sha256 {bits}")


if __name__ == "__main__":
    main()
