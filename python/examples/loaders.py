"""How right is a loader of motion? A motion that is known at every time is stored as 61 frames at 30 Hz, as files store
it, and read between its frames: by the formulas of loaders that are in use, written in NumPy, and by Tumble. Printed are
the largest and the mean error of a joint's rotation relative to its parent, and of positions along the skeleton. The
table stands in docs/loaders.md.

    python loaders.py
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import tumble

FPS, FRAMES, SAMPLES = 30, 61, 6007
PARENTS = [None, 0, 1, 2, 3, 4]
OFFSETS = np.array([[0, 0, 1.0], [0, 0, 0.25], [0, 0, 0.25], [0.18, 0, 0.1], [0.28, 0, 0], [0.26, 0, 0]])
AXES = np.array([[0, 0, 1.0], [0, 1, 0], [1, 0, 0], [0, 0.6, 0.8], [0.6, 0.8, 0], [0.8, 0, 0.6]])
# Amplitudes in radians and frequencies in hertz: a body that turns about, and an arm that swings.
AMPLITUDES = np.array([2.0, 0.3, 0.2, 1.2, 1.0, 0.8])
FREQUENCIES = np.array([0.5, 1.0, 1.5, 1.6, 2.1, 2.6])

Array = np.ndarray[Any, np.dtype[np.float64]]
Motion = tuple[Array, Array]


def product(a: Array, b: Array) -> Array:
    """Of quaternions x y z w."""
    vector = a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3] + np.cross(a[..., :3], b[..., :3])
    return np.concatenate([vector, a[..., 3:] * b[..., 3:] - (a[..., :3] * b[..., :3]).sum(-1, keepdims=True)], -1)


def motion(times: Array) -> Motion:
    """The rotations of all joints relative to their parents, with w of 0 or more as files have them, and the root."""
    angles = AMPLITUDES * np.sin(2 * np.pi * FREQUENCIES * times[:, None] + np.arange(6)) + [2.2, 0, 0, 0, 0, 0]
    half = angles[..., None] / 2
    q = np.concatenate([AXES * np.sin(half), np.cos(half)], axis=-1)
    root = np.stack([1.5 * times, 0.3 * np.sin(3 * times), 0.05 * np.cos(9 * times)], axis=-1)
    return np.where(q[..., 3:] < 0, -q, q), root


def positions(q: Array, root: Array) -> Array:
    """Of all joints, along the skeleton."""
    world, points = q[:, 0], [root]
    for joint in range(1, len(PARENTS)):
        arm = np.broadcast_to([*OFFSETS[joint], 0.0], world.shape)
        points.append(points[-1] + product(product(world, arm), world * [-1, -1, -1, 1])[:, :3])
        world = product(world, q[:, joint])
    return np.stack(points, axis=1)


def nearest(keys: Motion, times: Array) -> Motion:
    frame = np.round(times * FPS).astype(int)
    return keys[0][frame], keys[1][frame]


def floored(keys: Motion, times: Array) -> Motion:
    frame = np.minimum((times * FPS).astype(int), FRAMES - 1)
    return keys[0][frame], keys[1][frame]


def blended(blend: Callable[[Array, Array, Array], Array], seconds: float) -> Callable[[Motion, Array], Motion]:
    """Between the frames around a time. `seconds`: the length that the loader takes a clip to have."""

    def sample(keys: Motion, times: Array) -> Motion:
        place = np.clip(times / seconds, 0, 1) * (FRAMES - 1)
        frame = np.minimum(place.astype(int), FRAMES - 2)
        t = (place - frame)[:, None]
        q = blend(keys[0][frame], keys[0][frame + 1], t[..., None])
        return q, keys[1][frame] * (1 - t) + keys[1][frame + 1] * t

    return sample


def lerp(a: Array, b: Array, t: Array) -> Array:
    q = a * (1 - t) + b * t
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def nlerp(a: Array, b: Array, t: Array) -> Array:
    return lerp(a, np.where((a * b).sum(-1, keepdims=True) < 0, -b, b), t)


def slerp(a: Array, b: Array, t: Array) -> Array:
    cosine = (a * b).sum(-1, keepdims=True)
    b, half = np.where(cosine < 0, -b, b), np.arccos(np.clip(np.abs(cosine), -1, 1))
    sine = np.sin(half)
    with np.errstate(divide="ignore", invalid="ignore"):
        q = (np.sin((1 - t) * half) * a + np.sin(t * half) * b) / sine
    return np.where(sine < 1e-3, a * (1 - t) + b * t, q)


def by_tumble(method: str) -> Callable[[Motion, Array], Motion]:
    def sample(keys: Motion, times: Array) -> Motion:
        moved = [keys[1], *[None] * (len(PARENTS) - 1)]
        seconds, turned = np.arange(FRAMES) / FPS, keys[0].swapaxes(0, 1)
        clip = tumble.Clip(seconds, turned, parents=PARENTS, offsets=OFFSETS, translations=moved)
        state = tumble.MotionLibrary([clip], method=method).sample(0, times)
        return state.rotations.astype(np.float64), state.positions[:, 0].astype(np.float64)

    return sample


def without_last(keys: Motion, times: Array) -> Motion:
    last = (FRAMES - 2) / FPS
    return blended(slerp, LENGTH)(keys, np.minimum(times, last))


LENGTH = (FRAMES - 1) / FPS
LOADERS: dict[str, Callable[[Motion, Array], Motion]] = {
    "the frame before the time (index rounded down)": floored,
    "the nearest frame": nearest,
    "components interpolated, signs as stored": blended(lerp, LENGTH),
    "slerp, where n frames last n / fps": blended(slerp, FRAMES / FPS),
    "slerp, the last frame dropped": without_last,
    "components interpolated, nearer sign (nlerp)": blended(nlerp, LENGTH),
    "slerp in float64": blended(slerp, LENGTH),
    'Tumble, `method="slerp"`': by_tumble("slerp"),
    'Tumble, `method="bessel-overhauser"`': by_tumble("bessel-overhauser"),
    'Tumble, `method="c2"`': by_tumble("c2"),
}


def errors(loader: Callable[[Motion, Array], Motion]) -> tuple[Array, Array]:
    """In degrees and in metres, for each joint at each time."""
    times = np.linspace(0.0, LENGTH, SAMPLES)
    (q, root), (found, moved) = motion(times), loader(motion(np.arange(FRAMES) / FPS), times)
    # The chord is exact for small angles, where the arc cosine is not.
    chord = np.minimum(np.linalg.norm(found - q, axis=-1), np.linalg.norm(found + q, axis=-1))
    angle = np.degrees(4 * np.arcsin(np.minimum(chord / 2, 1.0)))
    return angle, np.linalg.norm(positions(found, moved) - positions(q, root), axis=-1)


def table() -> str:
    lines = [
        "| loader | largest, degrees | mean, degrees | largest, m | mean, m |",
        "|---|---|---|---|---|",
    ]
    for name, loader in LOADERS.items():
        angle, distance = errors(loader)
        numbers = [angle.max(), angle.mean(), distance.max(), distance.mean()]
        shown = [np.format_float_positional(float(f"{number:.2g}"), trim="-") for number in numbers]
        lines.append(" | ".join([f"| {name}", *shown]) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
