"""Features of arrays."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble
from tumble import features


@pytest.mark.parametrize("kind", ["six-columns", "six-rows", "six-interleaved"])
def test_six_numbers_are_those_of_scipys_matrices(kind):
    rotations = Rotation.random(12, random_state=4)
    matrices = rotations.as_matrix()
    expected = {
        "six-columns": np.concatenate([matrices[..., 0], matrices[..., 1]], -1),
        "six-rows": np.concatenate([matrices[:, 0], matrices[:, 1]], -1),
        "six-interleaved": matrices[..., :2].reshape(12, 6),
    }[kind]
    quaternions = rotations.as_quat()
    for order, components in [("xyzw", quaternions), ("wxyz", np.roll(quaternions, 1, -1))]:
        found = features.six(components.reshape(3, 4, 4), kind, order=order)
        np.testing.assert_allclose(found.reshape(12, 6), expected, atol=1e-15)
        back = features.rotations_of_six(2 * found, kind, order=order)
        np.testing.assert_allclose(np.abs((back.reshape(12, 4) * components).sum(-1)), 1, atol=1e-14)


def test_what_is_no_rotation_is_refused():
    with pytest.raises(tumble.InputError, match="there is no `six`.*six-columns, six-rows, six-interleaved"):
        features.six([0, 0, 0, 1.0], "six", order="xyzw")
    with pytest.raises(TypeError, match="order"):
        features.six([0, 0, 0, 1.0], "six-rows")
    with pytest.raises(tumble.InputError, match="number 1, are no rotation"):
        features.rotations_of_six([[1, 0, 0, 0, 1, 0], [0.0] * 6], "six-rows", order="xyzw")
    with pytest.raises(tumble.InputError, match="number 0 has the norm 0"):
        features.heading([[0, 0, 0, 0.0]], order="xyzw", up="z")
    with pytest.raises(tumble.InputError, match=r"its shape is \(5,\); the last axis has 6 numbers"):
        features.rotations_of_six([0.0] * 5, "six-rows", order="xyzw")


def test_headings_contacts_and_mirrors(shared):
    expected = json.loads((shared / "robots" / "features" / "features.json").read_text())
    arrays = np.load(shared / "robots" / "layouts" / "expected.npz")
    root = arrays["exact30_root_quat_wxyz"]
    headings = np.array(expected["heading_of_root"]["values"])
    np.testing.assert_allclose(features.heading(root, order="wxyz", up="z"), headings[:, 0], atol=1e-12)
    np.testing.assert_allclose(features.heading(root, order="wxyz", up="z", axis="x"), headings[:, 1], atol=1e-12)
    at, rates = arrays["exact30_body_pos_w"], arrays["exact30_body_lin_vel_w"]
    touching = features.contacts(at, rates, up="z", height=0.2, speed=1.0)
    np.testing.assert_array_equal(touching, expected["contacts"]["1.0/0.2"])
    filtered = features.contacts(at, rates, up="z", height=0.2, speed=1.0, window=3)
    middle = touching[:-2].astype(int) + touching[1:-1] + touching[2:]
    np.testing.assert_array_equal(filtered[1:-1], middle >= 2)
    names = list(arrays["body_names"])
    pairs = features.mirror_pairs(names)
    assert [names[partner] for partner in pairs] == [
        name.replace("left", "?").replace("right", "left").replace("?", "right") for name in names
    ]
    mirrored = features.mirrored_positions(at, axis="y", pairs=pairs)
    np.testing.assert_array_equal(mirrored, at[:, pairs] * [1, -1, 1])
    again = features.mirrored_positions(mirrored, axis="y", pairs=pairs)
    np.testing.assert_array_equal(again, at)
    quaternions = arrays["exact30_body_quat_w"]
    turned = features.mirrored_rotations(quaternions, order="wxyz", axis="y", pairs=pairs)
    np.testing.assert_allclose(turned, quaternions[:, pairs] * [1, -1, 1, -1], atol=1e-15)
    with pytest.raises(tumble.InputError, match="2 indices for 17 bodies"):
        features.mirrored_positions(at, axis="y", pairs=[1, 0])


def test_features_of_humanml3d(shared):
    arrays = np.load(shared / "robots" / "features" / "humanml3d.npz")
    found = features.humanml3d(arrays["joints"])
    np.testing.assert_allclose(found, arrays["features"], atol=1e-12)
    back = features.positions_of_humanml3d(found)
    np.testing.assert_allclose(back, arrays["positions"][:-1], atol=1e-12)
    with pytest.raises(tumble.InputError, match="hips and shoulders are one above the other"):
        features.humanml3d(np.zeros((3, 22, 3)))
    with pytest.raises(tumble.InputError, match=r"give \(frames, 22, 3\)"):
        features.humanml3d(np.zeros((3, 21, 3)))


def walk(frames=31):
    """A root that walks a curve and turns, z up."""
    t = np.linspace(0, 2, frames)
    positions = np.stack([np.sin(t), t**2, 0.9 + 0.05 * np.sin(9 * t)], -1)
    turns = Rotation.from_euler("z", 2.5 + 2 * t[:, None]) * Rotation.from_rotvec([0.1, -0.2, 0.0])
    return positions, turns


@pytest.mark.parametrize("axis", [None, "x"])
def test_root_motion_and_the_rest_are_the_motion(axis):
    positions, rotations = walk()
    places, headings, still, upright = features.root_motion(
        positions, rotations.as_quat(), order="xyzw", up="z", axis=axis
    )
    np.testing.assert_array_equal(places, positions * [1, 1, 0])
    np.testing.assert_allclose(still, positions * [0, 0, 1], atol=1e-15)
    back = Rotation.from_euler("z", headings[:, None])
    np.testing.assert_allclose(places + back.apply(still), positions, atol=1e-14)
    assert (back * Rotation.from_quat(upright) * rotations.inv()).magnitude().max() < 1e-14
    left = features.heading(upright, order="xyzw", up="z", axis=axis)
    np.testing.assert_allclose(left, 0, atol=1e-14)
    assert np.abs(np.diff(headings)).max() < 0.3  # whole turns are counted
    # Computed loop by loop, for comparison.
    step = Rotation.from_euler("z", headings[-1] - headings[0])
    expected = places
    for loops in range(1, 6):
        expected = places[-1] + step.apply(expected - places[0])
        found, turned = features.root_after_loops(places, headings, loops, up="z")
        np.testing.assert_allclose(found, expected, atol=1e-12)
        np.testing.assert_allclose(turned, headings + loops * (headings[-1] - headings[0]), atol=1e-12)


def test_root_motion_of_other_shapes_is_refused():
    positions, rotations = walk()
    with pytest.raises(tumble.InputError, match=r"quaternions: its shape is \(30, 4\), not \(31, 4\)"):
        features.root_motion(positions, rotations.as_quat()[:30], order="xyzw", up="z")
    with pytest.raises(tumble.InputError, match=r"\(31, 3\) and \(30,\)"):
        features.root_after_loops(positions, np.zeros(30), 2, up="z")


def test_clips_stay_in_place_or_are_carried():
    positions, rotations = walk()
    times = np.arange(31) / 30
    clip = tumble.Clip(times, rotations.as_quat(), translations=positions, scalars={"grip": ([0.0], [0.5])})
    still = clip.root_motion("in-place", up="z")
    np.testing.assert_allclose(still.translations(0)[1], positions * [0, 0, 1], atol=1e-6)
    assert still.scalars["grip"][1] == [0.5]
    carried = clip.root_motion("extract", up="z")
    assert carried.names[0] == "root_motion"
    assert carried.parents == [None, 0]
    np.testing.assert_array_equal(carried.keys(1), still.keys(0))
    ground, rest = [Rotation.from_quat(carried.keys(track)) for track in (0, 1)]
    assert (ground * rest * rotations.inv()).magnitude().max() < 6e-7
    points = carried.translations(0)[1] + ground.apply(carried.translations(1)[1])
    np.testing.assert_allclose(points, positions, atol=2e-6)
    with pytest.raises(tumble.InputError, match="no joint is called `head`"):
        clip.root_motion("in-place", joint="head")


def test_contacts_are_filtered_along_the_time_of_each_item():
    """Of windows of a batch, as `sample_windows` gives them: each as if it were alone."""
    rng = np.random.default_rng(5)
    positions, velocities = rng.uniform(0, 0.2, (3, 4, 9, 2, 3)), rng.uniform(0, 0.5, (3, 4, 9, 2, 3))
    limits = {"up": "z", "height": 0.1, "speed": 0.5, "window": 3}
    found = features.contacts(positions, velocities, **limits)
    touching = features.contacts(positions, velocities, up="z", height=0.1, speed=0.5)
    middle = touching[..., :-2, :].astype(int) + touching[..., 1:-1, :] + touching[..., 2:, :]
    np.testing.assert_array_equal(found[..., 1:-1, :], middle >= 2)
    for item in np.ndindex(3, 4):
        np.testing.assert_array_equal(found[item], features.contacts(positions[item], velocities[item], **limits))
        one = features.contacts(positions[item][:, 1], velocities[item][:, 1], **limits)
        np.testing.assert_array_equal(found[item][:, 1], one)
    for wrong, error, words in [
        ({"window": 4}, tumble.InputError, "window: 4 is even"),
        ({"window": -1}, ValueError, "window: -1"),
        ({"window": 2.5}, TypeError, "window: 2.5"),
        ({"window": True}, TypeError, "window: True"),
        ({"height": float("nan")}, ValueError, "height: it is not a number"),
    ]:
        with pytest.raises(error, match=words):
            features.contacts(positions, velocities, **{**limits, **wrong})
