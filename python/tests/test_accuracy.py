"""Against SciPy, in float64: slerp within 4e-7 rad, c2 within 1e-6 rad of `RotationSpline`."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import unit
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import tumble


def angle(found, expected):
    """The largest angle between rotations, rad; sines, because cosines lose what is small."""
    difference = Rotation.from_quat(np.asarray(found, np.float64)).inv() * expected
    return difference.magnitude().max()


def walk(rng, tracks, keys, max_angle):
    """Keys that turn by at most `max_angle` radians from each to the next, with signs at random."""
    found = np.empty((tracks, keys, 4))
    for track in range(tracks):
        rotation = Rotation.random(rng=rng)
        for key in range(keys):
            found[track, key] = rotation.as_quat() * rng.choice([-1, 1])
            axis = rng.normal(size=3)
            axis *= max_angle * rng.uniform(0, 1) ** 0.25 / np.linalg.norm(axis)
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
    "very uneven steps": (20, 30, 0.02, 1000.0, 0.0),
    "very uneven steps of large turns": (20, 8, 0.5, 30.0, 0.0),
    "a day later": (10, 30, 1.5, 4.0, 86400.0),
    "two keys": (20, 2, 3.0, 1.0, 0.0),
    "many keys": (2, 2000, 1.0, 2.0, -50.0),
}


def made(case):
    tracks, keys, max_angle, ratio, start = SETS[case]
    rng = np.random.default_rng(sorted(SETS).index(case))
    times = start + uneven(rng, keys, ratio)
    at = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 4000)]))
    return times, walk(rng, tracks, keys, max_angle), at


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
    found = tumble.evaluate(times, keys, at=at, method="c2")
    compared, worst = 0, 0.0
    for track in range(len(keys)):
        spline = Converged(times, Rotation.from_quat(keys[track]))
        if whirls(spline, times):
            continue
        compared += 1
        worst = max(worst, angle(found[track], spline(at)))
    assert worst <= 1e-6
    assert compared >= 0.2 * len(keys), f"only {compared} of {len(keys)} were compared"


class Converged(RotationSpline):
    """SciPy stops after ten rounds, with errors of up to 2e-4 rad where turns are large."""

    MAX_ITER = 2000
    TOL = 1e-13


def whirls(spline, times):
    """Whether a key is passed faster than one turn per interval, as where a short interval lies
    beside a long one: there c2 gives up the continuous acceleration, and goes another way."""
    rates = np.linalg.norm(spline(times, 1), axis=1)
    return (rates[1:] * np.diff(times)).max() > 0.9 * 2 * np.pi


def test_keys_are_met_bit_for_bit(rng):
    times, keys = uneven(rng, 50, 10), unit(rng, 5, 50)
    for method in ["slerp", "c2", "bessel-overhauser", "catmull-rom"]:
        found = tumble.evaluate(times, keys, at=times, method=method)
        signs = np.sign((found * keys).sum(axis=-1, keepdims=True))
        assert np.array_equal(found * signs, keys)
