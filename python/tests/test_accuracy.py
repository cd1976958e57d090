"""Against SciPy, in float64: slerp within 4e-7 rad, c2 within 1e-6 rad of `RotationSpline`."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import unit
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import tumble


def angle(found, expected):
    """The largest angle between rotations, rad; sines, because cosines lose what is small."""
    turn = Rotation.from_quat(np.asarray(found, np.float64)).inv() * expected
    return turn.magnitude().max()


def walk(rng, tracks, keys, most):
    """Keys that turn by at most `most` radians from each to the next, with signs at random."""
    found = np.empty((tracks, keys, 4))
    for track in range(tracks):
        rotation = Rotation.random(rng=rng)
        for key in range(keys):
            found[track, key] = rotation.as_quat() * rng.choice([-1, 1])
            axis = rng.normal(size=3)
            axis *= most * rng.uniform(0, 1) ** 0.25 / np.linalg.norm(axis)
            rotation = rotation * Rotation.from_rotvec(axis)
    return found.astype(np.float32)


def uneven(rng, keys, ratio):
    """Times whose steps differ by up to `ratio`."""
    return np.concatenate([[0.0], np.cumsum(ratio ** rng.uniform(-0.5, 0.5, keys - 1))])


# Tracks, keys, the largest turn, the ratio of steps, where time starts.
SETS = {
    "small turns": (20, 30, 0.2, 1.0, 0.0),
    "any turns": (20, 30, 3.0, 1.0, 0.0),
    "nearly half turns": (20, 30, 3.1415, 1.0, 0.0),
    "tiny turns": (20, 30, 1e-4, 1.0, 0.0),
    "uneven steps": (20, 30, 1.0, 10.0, 0.0),
    "very uneven steps": (20, 30, 2.0, 1000.0, 0.0),
    "a day later": (10, 30, 1.5, 4.0, 86400.0),
    "two keys": (20, 2, 3.0, 1.0, 0.0),
    "many keys": (2, 2000, 2.0, 4.0, -50.0),
}


def made(case):
    tracks, keys, most, ratio, start = SETS[case]
    rng = np.random.default_rng(sorted(SETS).index(case))
    times = start + uneven(rng, keys, ratio)
    at = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 4000)]))
    return times, walk(rng, tracks, keys, most), at


@pytest.mark.parametrize("case", SETS)
def test_slerp(case):
    times, keys, at = made(case)
    found = tumble.evaluate(times, keys, at=at, method="slerp")
    worst = max(
        angle(found[track], Slerp(times, Rotation.from_quat(keys[track]))(at))
        for track in range(len(keys))
    )
    assert worst <= 4e-7


@pytest.mark.parametrize("case", SETS)
def test_rotation_spline(case):
    times, keys, at = made(case)
    # SciPy's iteration stops after ten rounds; where turns are large and steps very uneven it has
    # not arrived by then, and says so nowhere.
    tracks, _, most, ratio, _ = SETS[case]
    found = tumble.evaluate(times, keys, at=at, method="c2")
    worst = max(
        angle(found[track], RotationSpline(times, Rotation.from_quat(keys[track]))(at))
        for track in range(len(keys))
    )
    assert worst <= 1e-6


def test_keys_are_met_bit_for_bit(rng):
    times, keys = uneven(rng, 50, 10), unit(rng, 5, 50)
    for method in ["slerp", "c2", "bessel-overhauser", "catmull-rom"]:
        found = tumble.evaluate(times, keys, at=times, method=method)
        signs = np.sign((found * keys).sum(axis=-1, keepdims=True))
        assert np.array_equal(found * signs, keys)
