"""Motions on other skeletons."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble

PARENTS = [None, 0, 1, 2, 0]
NAMES = ["Hips", "Arm", "Elbow", "Hand", "Leg"]
OFFSETS = np.array([[0, 1.0, 0], [0.2, 0.5, 0], [0.3, 0, 0], [0.3, 0, 0], [0, -0.9, 0]])


def clip(names, offsets, rng):
    keys = Rotation.random(5 * 6, random_state=3).as_quat().reshape(5, 6, 4)
    root = np.cumsum(rng.normal(size=(6, 3)), axis=0) + offsets[0]
    return tumble.Clip(
        np.arange(6) / 30, keys, layout="track", names=names, parents=PARENTS, offsets=offsets,
        translations=[root, None, None, None, None],
    )


def test_motions_keep_their_rotations_and_times(rng):
    source = clip(NAMES, OFFSETS, rng)
    target = clip([name.lower() for name in NAMES], 2 * OFFSETS, rng)
    bones = {name.lower(): name for name in NAMES}
    found, report = tumble.retarget(source, target, bones=bones)
    assert report["pairs"] == bones and report["resting"] == report["dropped"] == []
    assert report["scale"] == pytest.approx(2) and report["axes_assumed"]
    for track, name in enumerate(NAMES):
        np.testing.assert_array_equal(found.times(track), source.times(track))
        dots = (found.keys(name.lower()) * source.keys(name)).sum(-1)
        np.testing.assert_allclose(np.abs(dots), 1, atol=1e-6)
    here, there = (tumble.Engine("cpu").world(it, fps=30, method="slerp")[0] for it in (found, source))
    np.testing.assert_allclose(here, 2 * there, atol=1e-4)
    assert report["largest_difference"] < 1e-6 and report["ends"] == {} and report["below_ground"] == 0
    # At the frame that defines the rest pose, the target is in its rest pose.
    found, _ = tumble.retarget(source, target, bones=bones, rest="same", rest_frame=2)
    np.testing.assert_allclose(np.abs(found.keys("arm")[2]), [0, 0, 0, 1], atol=1e-6)
    with pytest.raises(tumble.InputError, match="no frame 6; the source has 6"):
        tumble.retarget(source, target, bones=bones, rest_frame=6)
    # Joints without a partner keep their rest rotations.
    found, report = tumble.retarget(source, target, bones={"hips": "Hips"}, scale=1.0)
    assert report["resting"] == ["arm", "elbow", "hand", "leg"] and report["dropped"] == NAMES[1:]
    np.testing.assert_allclose(np.abs(found.keys("arm")), [[0, 0, 0, 1]])


def test_what_does_not_fit_is_refused(rng):
    source = clip(NAMES, OFFSETS, rng)
    with pytest.raises(tumble.InputError, match="not those of a known human skeleton.*pair them by `bones`"):
        tumble.retarget(source, source)
    with pytest.raises(tumble.InputError, match="the target has no joint `tail`"):
        tumble.retarget(source, source, bones={"tail": "Hips"})
    with pytest.raises(tumble.InputError, match="scale: -1 is not a number greater than 0"):
        tumble.retarget(source, source, bones={"Hips": "Hips"}, scale=-1.0)
    with pytest.raises(tumble.InputError, match="there is no `t-pose`"):
        tumble.retarget(source, source, bones={"Hips": "Hips"}, rest="t-pose")
    with pytest.raises(tumble.InputError, match="source has no skeleton"):
        tumble.retarget(tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]]), source)
