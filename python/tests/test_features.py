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
