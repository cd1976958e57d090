"""Clips are combined by the names of their joints: the result is the same motion, or a refusal."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import warnings

import numpy as np
import pytest
from conftest import ROOT, unit
from scipy.spatial.transform import Rotation

import tumble

NAMES = ["hip", "left", "right", "left toe", "right toe"]
PARENTS = [None, 0, 0, 1, 2]
OFFSETS = np.array([[0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 2], [0, 0, 3]], np.float32)
ORDERS = [[0, 2, 1, 4, 3], [4, 3, 2, 1, 0], [1, 3, 0, 2, 4]]
TIMES = np.arange(4) / 30


def made(keys, order=range(5), times=TIMES, names=NAMES, parents=PARENTS, offsets=OFFSETS, root=None):
    """The clip with its joints in another order."""
    order = list(order)
    moved = {} if root is None else {"translations": [root if joint == 0 else None for joint in order]}
    return tumble.Clip(
        times,
        keys[order],
        names=None if names is None else [names[joint] for joint in order],
        parents=[None if parents[joint] is None else order.index(parents[joint]) for joint in order],
        offsets=None if offsets is None else offsets[order],
        **moved,
    )


@pytest.fixture
def keys(rng):
    return unit(rng, 5, 4)


def states(clips, times, **options):
    ids = np.repeat(np.arange(len(clips)), len(times))
    state = tumble.MotionLibrary(clips, **options).sample(ids, np.tile(times, len(clips)))
    return state.positions.reshape(len(clips), len(times), 5, 3), state.rotations.reshape(len(clips), len(times), 5, 4)


@pytest.mark.parametrize("order", ORDERS)
def test_other_orders_are_the_same_motion(keys, rng, order):
    root = rng.normal(size=(4, 3))
    first, other = made(keys, root=root), made(keys, order, root=root)
    times = np.linspace(0, 0.1, 7)
    positions, rotations = states([first, other], times)
    assert np.array_equal(positions[0], positions[1]) and np.array_equal(rotations[0], rotations[1])
    expected = tumble.Engine("cpu").world(first, at=times, layout="frame", method="slerp")[0]
    np.testing.assert_allclose(positions[0], expected, atol=2e-6)
    # The order of the result is that of the first clip, or of the skeleton.
    library = tumble.MotionLibrary([other, first])
    assert library.joint_names == other.names
    again = tumble.MotionLibrary([other], skeleton=first)
    assert again.joint_names == NAMES
    assert np.array_equal(again.sample([0] * 7, times).positions, positions[0])

    crowd = tumble.Crowd([first, other], 2)
    crowd.set([0, 1], [0, 1], time=0.05, wrap="hold")
    for values in ["model", "local", "rotations"]:
        a, b = crowd.evaluate(values)
        assert np.array_equal(a, b), values
    for world in [False, True]:
        found = tumble.compare(first, other, world=world)
        assert (found.tracks, found.missing) == (5, ([], [])) and found.rotation.largest == 0
        assert found.identical == found.tracks * found.samples


def test_other_clocks_and_rates_are_the_same_motion(keys):
    # The same keys on another clock, from the second at which it begins.
    first, later = made(keys), made(keys, ORDERS[1], times=TIMES + 1e9)
    coarse = made(keys[:, ::2], ORDERS[0], times=TIMES[::2])
    positions, rotations = states([first, later, coarse], [0.0, 2 / 30])
    np.testing.assert_allclose(positions[1], positions[0], atol=1e-5)
    assert np.array_equal(rotations[2], rotations[0]) and np.array_equal(positions[2], positions[0])
    crowd = tumble.Crowd([first, later, coarse], 3)
    crowd.set([0, 1, 2], [0, 1, 2], time=2 / 30, wrap="hold")
    a, b, c = crowd.evaluate("model")
    np.testing.assert_allclose(b, a, atol=1e-5)
    np.testing.assert_allclose(c, a, atol=1e-6)
    # The times are those of the first clip. The other clip is evaluated there.
    found = tumble.compare(coarse, first, at=TIMES[::2])
    assert (found.tracks, found.samples) == (5, 2) and found.rotation.largest < 1e-6


def test_clips_of_other_clocks_are_compared_where_both_have_keys(keys):
    first, shifted = made(keys), made(keys, ORDERS[0], times=TIMES + 1 / 30)
    found = tumble.compare(first, shifted)
    # Keys that are one frame late are a different motion.
    assert found.rotation.largest > 0.1
    with pytest.raises(tumble.InputError, match="no common time"):
        tumble.compare(first, made(keys, times=TIMES + 1e9))


@pytest.fixture
def rig(tmp_path):
    """A hip with a knee and a tail; the animations move different joints."""
    half = np.sqrt(0.5)
    arrays = [np.array([0, 1]), np.array([[0, 0, 0, 1], [half, 0, 0, half]]), np.array([[0, -0.5, 0], [0.25, -0.75, 0]])]
    data = [array.astype("<f4").tobytes() for array in arrays]
    starts = np.cumsum([0, *map(len, data)])
    moved = {"kick": [(1, "rotation")], "wag": [(2, "rotation")], "both": [(2, "rotation"), (1, "translation")]}
    animations = [
        {
            "name": name,
            "samplers": [{"input": 0, "output": 1 + (path == "translation")} for _, path in channels],
            "channels": [
                {"sampler": index, "target": {"node": node, "path": path}} for index, (node, path) in enumerate(channels)
            ],
        }
        for name, channels in moved.items()
    ]
    nodes = [
        {"name": "hip", "translation": [0, 1, 0], "children": [1, 2]},
        {"name": "knee", "translation": [0, -0.5, 0]},
        {"name": "tail", "translation": [0, 0, -1], "rotation": [0, half, 0, half]},
    ]
    file = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "animations": animations,
        "buffers": [{"uri": "rig.bin", "byteLength": int(starts[-1])}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(start), "byteLength": len(part)} for start, part in zip(starts, data)
        ],
        "accessors": [
            {"bufferView": index, "componentType": 5126, "count": 2, "type": kind}
            for index, kind in enumerate(["SCALAR", "VEC4", "VEC3"])
        ],
    }
    file["accessors"][0] |= {"min": [0], "max": [1]}
    (tmp_path / "rig.bin").write_bytes(b"".join(data))
    (tmp_path / "rig.gltf").write_text(json.dumps(file))
    return tumble.load(tmp_path / "rig.gltf")


def test_animations_of_a_file_may_move_different_joints(rig):
    """The joints are those of all of them; those that an animation lacks rest, as in C."""
    turned, at = Rotation.from_rotvec([np.pi / 4, 0, 0]), [0.5]
    tail = Rotation.from_quat([0, np.sqrt(0.5), 0, np.sqrt(0.5)])
    one = Rotation.identity()
    expected = {
        "kick": ([[0, 1, 0], [0, 0.5, 0], [0, 1, -1]], [one, turned, tail]),
        "wag": ([[0, 1, 0], [0, 0.5, 0], [0, 1, -1]], [one, one, turned]),
        "both": ([[0, 1, 0], [0.125, 0.375, 0], [0, 1, -1]], [one, one, turned]),
    }
    orders = [["kick", "wag", "both"], ["wag", "both", "kick"]]
    for order in orders:
        clips = [rig[name] for name in order]
        library = tumble.MotionLibrary(clips, method="slerp")
        assert sorted(library.joint_names) == ["hip", "knee", "tail"]
        joints = [["hip", "knee", "tail"].index(name) for name in library.joint_names]
        crowd = tumble.Crowd(clips, 3, method="slerp")
        crowd.set([0, 1, 2], [0, 1, 2], time=0.5, wrap="hold")
        model = crowd.evaluate("model")
        for index, name in enumerate(order):
            positions, rotations = expected[name]
            state = library.sample([index], at)
            np.testing.assert_allclose(state.positions[0], np.array(positions)[joints], atol=1e-6)
            np.testing.assert_allclose(model[index, ..., 3], np.array(positions)[joints], atol=1e-6)
            for joint, found in zip(joints, Rotation.from_quat(state.rotations[0])):
                assert (rotations[joint].inv() * found).magnitude() < 1e-6, (name, joint)
    # A clip made of arrays has no rest poses for the other joints.
    kick = rig["kick"]
    alone = tumble.Clip(
        [kick.times(name) for name in kick.names], [kick.keys(name) for name in kick.names], names=kick.names, parents=kick.parents,
        offsets=kick.offsets,
    )
    with pytest.raises(tumble.InputError, match="joint `tail`"):
        tumble.MotionLibrary([rig["both"], alone])


@pytest.mark.parametrize("ending", ["npz", "bvh", "glb", "gltf", "parquet"])
def test_a_clip_and_its_files_are_one_motion(keys, tmp_path, ending):
    shuffled = made(keys, ORDERS[1])
    path = tmp_path / f"clip.{ending}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tumble.save(path, shuffled, fps=30, method="slerp")
        found = tumble.load(path)[0]
        positions, rotations = states([shuffled, found], TIMES)
    np.testing.assert_allclose(positions[1], positions[0], atol=1e-5)
    assert np.abs((rotations[0] * rotations[1]).sum(-1)).min() > 1 - 1e-6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert tumble.compare(shuffled, found, at=TIMES).rotation.largest < 1e-3


def differing(keys):
    """Clips with other joints, and the messages about them."""
    return [
        (made(keys, names=["Hip", "Left", "Right", "Left_Toe", "Right_Toe"]), "`hip`.*`Hip`"),
        (made(keys, names=["rig:hip", *NAMES[1:]]), "joint `hip`.*`rig:hip` is near, but only equal names match"),
        (made(keys, parents=[None, 0, 0, 1, 0]), "`right toe` has the parent `right` in .*, but has the parent `hip`"),
        (made(keys, parents=[None, None, 0, 1, 2]), "`left` has the parent `hip` in .*, but is a root in "),
        (made(keys, parents=[1, None, 0, 1, 2]), "`hip` is a root in .*, but has the parent `left`"),
        (made(keys, names=["hip", "left", "left", "left toe", "right toe"]), "two joints `left`"),
        (made(keys, names=None), "names; joints are matched by name, or by index if neither clip has names|none of the same name"),
        (tumble.Clip(TIMES, keys[:1], names=["hip"], parents=[None]), "joint `left`.* none of that name$"),
    ]


def test_other_joints_are_refused(keys):
    first = made(keys)
    for other, words in differing(keys):
        for combine in [
            lambda: tumble.MotionLibrary([first, other]),
            lambda: tumble.MotionLibrary([other], skeleton=first),
            lambda: tumble.Crowd([first, other], 1),
        ]:
            with pytest.raises(tumble.InputError, match=words):
                combine()
        # Tracks that only one of the clips has are listed.
        if len(other) == 5 and "rig" not in words:
            with pytest.raises(tumble.InputError, match=words):
                tumble.compare(first, other)
    with pytest.raises(tumble.InputError, match=re.escape("joint `extra`")):
        more = tumble.Clip(
            TIMES, keys[[0, 1, 2, 3, 4, 0]], names=[*NAMES, "extra"], parents=[*PARENTS, 0], offsets=np.ones((6, 3))
        )
        tumble.MotionLibrary([first, more])
    # Two clips without names are matched by index, if they have equally many tracks.
    unnamed = made(keys, names=None)
    positions, _ = states([unnamed, made(keys, names=None)], TIMES)
    assert np.array_equal(positions[0], positions[1])
    with pytest.raises(tumble.InputError, match=re.escape("clips[1]: 4 tracks; the skeleton has 5 joints")):
        tumble.MotionLibrary([unnamed, tumble.Clip(TIMES, keys[:4], parents=[None, 0, 0, 1], offsets=OFFSETS[:4], layout="track")])
    # Rotations relative to other parents are compared in the world.
    other = made(keys, parents=[None, 0, 0, 1, 0])
    with pytest.raises(tumble.InputError, match="compare them in the world with world=True"):
        tumble.compare(first, other)
    assert tumble.compare(first, other, world=True).tracks == 5


def test_a_parent_is_a_track_or_none(keys):
    clip = made(keys)
    for wrong in [-2, 5]:
        parents = [None, 0, 0, 1, wrong]
        for call in [
            lambda: tumble.Clip(TIMES, keys, parents=parents),
            lambda: tumble.MotionLibrary([clip], skeleton=(parents, OFFSETS)),
            lambda: tumble.Crowd([clip], 1, parents=parents, offsets=OFFSETS),
            lambda: tumble.Engine("cpu").local_to_model(keys, parents),
        ]:
            with pytest.raises(tumble.InputError, match=f"track 4 cannot have the parent {wrong}; give the index of a track"):
                call()


def test_each_clip_keeps_its_offsets(keys):
    small, large = made(keys), made(keys, ORDERS[0], offsets=2 * OFFSETS)
    positions, _ = states([small, large], TIMES)
    np.testing.assert_allclose(positions[1], 2 * positions[0], atol=1e-5)
    crowd = tumble.Crowd([small, large], 2)
    crowd.set([0, 1], [0, 1])
    a, b = crowd.evaluate("model")[..., 3]
    np.testing.assert_allclose(b, 2 * a, atol=1e-5)
    # A given skeleton applies to all clips.
    for skeleton in [small, (PARENTS, OFFSETS)]:
        positions, _ = states([small, large], TIMES, skeleton=skeleton)
        np.testing.assert_allclose(positions[1], positions[0], atol=1e-6)
    with pytest.raises(tumble.InputError, match="`right toe` has the parent `hip` in the skeleton"):
        tumble.MotionLibrary([small], skeleton=([None, 0, 0, 1, 0], OFFSETS))
    scaled = tumble.Clip(TIMES, keys[:1], parents=[None], scales=[np.full((4, 3), 2.0)])
    with pytest.raises(tumble.InputError, match="scale keys"):
        tumble.MotionLibrary([scaled])


@pytest.fixture
def body(tmp_path):
    path = tmp_path / "body.npz"
    np.savez(path, poses=np.zeros((31, 156)), trans=np.tile([0.0, 1.0, 0.0], (31, 1)), mocap_framerate=30.0)
    return path


def test_joints_without_offsets_have_no_positions(body, keys, tmp_path):
    clip = tumble.load(body).clip
    unplaced = made(keys, offsets=None)
    for clip, words in [(clip, "body_model"), (unplaced, "give `offsets`")]:
        library = tumble.MotionLibrary([clip])
        library.save(tmp_path / "library.npz")
        for library in [library, tumble.MotionLibrary.open(tmp_path / "library.npz")]:
            for arrays in [["positions"], ["rotations", "velocities"], None]:
                with pytest.raises(tumble.InputError, match=words):
                    library.sample([0], [0.05], arrays=arrays)
            for finite in [False, True]:
                arrays = ["rotations", "world_rotations", "angular_velocities"]
                state = library.sample([0], [0.05], arrays=arrays, finite=finite)
                assert np.isfinite(state.angular_velocities).all() and state.positions is None
        crowd = tumble.Crowd([clip], 1)
        assert crowd.evaluate("rotations").shape == (1, len(clip), 4)
        for values in ["model", "local"]:
            with pytest.raises(tumble.InputError, match=words):
                crowd.evaluate(values)
        with pytest.raises(tumble.InputError, match="offsets"):
            tumble.Engine("cpu").world(clip, at=[0.0])
        for ending in ["bvh", "glb"]:
            with pytest.warns(tumble.InputWarning, match="W209.*all joints are written at their parents"):
                tumble.save(tmp_path / f"clip.{ending}", clip, fps=30, method="slerp")
        for ending in ["npz", "parquet"]:
            tumble.save(tmp_path / f"clip.{ending}", clip, fps=30, method="slerp")
            again = tumble.load(tmp_path / f"clip.{ending}").clip
            with pytest.raises(tumble.InputError, match="offsets"):
                tumble.Engine("cpu").world(again, at=[0.0])


def test_a_skeleton_places_the_joints_of_a_body(body):
    clip = tumble.load(body).clip
    offsets = np.arange(3.0 * len(clip)).reshape(-1, 3)
    placed = tumble.load(body, offsets=offsets).clip
    expected = tumble.Engine("cpu").world(placed, at=[0.0], layout="frame")[0]
    for skeleton in [placed, (clip.parents, offsets)]:
        found = tumble.MotionLibrary([clip], skeleton=skeleton).sample([0], [0.0]).positions
        np.testing.assert_allclose(found, expected, rtol=1e-6)
    crowd = tumble.Crowd([clip], 1, parents=clip.parents, offsets=offsets)
    np.testing.assert_allclose(crowd.evaluate("model")[..., 3], expected, rtol=1e-6)
    # If another clip has offsets, a clip without offsets still has no positions.
    library = tumble.MotionLibrary([placed, clip])
    np.testing.assert_allclose(library.sample([0], [0.0]).positions, expected, rtol=1e-6)
    with pytest.raises(tumble.InputError, match="body_model"):
        library.sample([0, 1], [0.0, 0.0])


def test_a_body_model_places_the_joints_of_its_body(tmp_path):
    """The same motion at another rate, and with its keys at times of another clock; another person has other bones."""
    folder = ROOT / "formats/tests/fixtures/body"
    model = folder / "models/SMPL_MALE.npz"
    poses = dict(np.load(folder / "male.npz"))
    slow = tmp_path / "slow.npz"
    np.savez(slow, **{**poses, "mocap_framerate": 15.0})
    male, twice = (tumble.load(path, body_model=model).clip for path in (folder / "male.npz", slow))
    assert np.array_equal(male.offsets, twice.offsets)
    state = tumble.MotionLibrary([male, twice]).sample([0, 1, 0, 1], [1 / 30, 2 / 30, 2 / 30, 4 / 30]).positions
    np.testing.assert_allclose(state[1::2], state[::2], atol=1e-5)
    female = tumble.load(folder / "female.npz", body_model=folder / "models/SMPL_FEMALE.npz").clip
    assert np.abs(female.offsets - male.offsets).max() > 0.01
    # Each clip keeps its bones; a given skeleton applies to both.
    own = tumble.MotionLibrary([male, female]).sample([1], [0.0]).positions
    expected = tumble.Engine("cpu").world(female, at=[0.0], layout="frame")[0]
    np.testing.assert_allclose(own, expected, atol=1e-5)
    chosen = tumble.MotionLibrary([female], skeleton=male).sample([0], [0.0]).positions
    assert np.abs(chosen - expected).max() > 0.01


def test_a_model_of_another_body_is_refused(body):
    model = ROOT / "formats/tests/fixtures/body/models"
    model = next(path for path in sorted(model.rglob("*.npz")))
    words = r"joint 23 \(`left_index2`\) of the motion has the parent 22 \(`left_index1`\), that of the model has the parent 21"
    with pytest.raises(tumble.InputError, match=words):
        tumble.load(body, body_model=model)


def test_offsets_with_names_are_matched_by_name(body, tmp_path):
    clip = tumble.load(body).clip
    offsets = np.arange(3.0 * len(clip)).reshape(-1, 3)
    lines = [f"{name} {x} {y} {z}" for name, (x, y, z) in zip(clip.names, offsets)]
    listed = tmp_path / "offsets.txt"
    result = tmp_path / "world.npy"
    listed.write_text("\n".join(reversed(lines)))
    line = ["eval", body, "--offsets", listed, "--quantity", "world", "-m", "slerp", "--fps", "30", "-o", result]
    subprocess.run([sys.executable, "-m", "tumble", *map(str, line)], check=True, timeout=300)
    expected = tumble.Engine("cpu").world(tumble.load(body, offsets=offsets).clip, fps=30, method="slerp", layout="frame")[0]
    found = np.load(result)
    assert found.shape == (31, len(clip), 7)
    np.testing.assert_allclose(found[..., :3], expected, rtol=1e-6, atol=1e-6)
    # The offsets of a dict are assigned by name, too.
    by_name = dict(zip(reversed(clip.names), offsets[::-1].tolist()))
    assert tumble.load(body, offsets=by_name).clip == tumble.load(body, offsets=offsets).clip
    by_name.pop(clip.names[3])
    with pytest.raises(tumble.InputError, match=f"`{clip.names[3]}`, the list of offsets has none of that name"):
        tumble.load(body, offsets=by_name)
    for wrong in [{"hip": 1.0}, {1: [0, 0, 0]}]:
        with pytest.raises(TypeError, match="give x, y, z for each name of a joint"):
            tumble.load(body, offsets=wrong)


def test_joints_of_one_name_are_told_to_be_matched_by_their_order(keys):
    """Names that were one in a file say nothing but the order of its joints."""
    beside = [tumble.Clip(TIMES, keys[:3], names=["hip", "leg", "leg#2"], parents=[None, 0, 0], offsets=OFFSETS[:3]) for _ in range(2)]
    words = "several joints are called `leg`; they are matched with those of other clips by their order"
    with pytest.warns(tumble.InputWarning, match=words):
        tumble.MotionLibrary(beside)
    with pytest.warns(tumble.InputWarning, match=words):
        tumble.Crowd(beside, 1)
    with pytest.warns(tumble.InputWarning, match=words):
        tumble.compare(*beside)
    # A clip with one track matches none; parents distinguish joints with equal names.
    chain = [tumble.Clip(TIMES, keys[:3], names=["hip", "leg", "leg#2"], parents=[None, 0, 1], offsets=OFFSETS[:3]) for _ in range(2)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tumble.MotionLibrary(beside[:1])
        tumble.MotionLibrary(chain)
