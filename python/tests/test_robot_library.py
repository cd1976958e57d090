"""Motion libraries of a robot: the joints and bodies of `Engine.bodies` at any times, and the CPU's bits on devices."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import tumble

ARM = """<mujoco model="arm"><worldbody>
  <body name="base" pos="0 0 1"><freejoint name="pelvis"/><inertial pos="0 0 0.5" mass="1"/>
    <body name="upper" pos="0 0 0.4"><joint name="shoulder" axis="0 1 0" pos="0 0 0.1" ref="20"/><inertial pos="0 0 0.5" mass="1"/>
      <body name="hand" pos="0 0 0.3"><joint name="wrist" axis="0 0 1"/><joint name="rail" type="slide" axis="1 0 0"/>
        <inertial pos="0.5 0 0" mass="1"/></body></body>
    <body name="head" pos="0 0.3 0" euler="0 30 0"><joint name="neck" axis="1 0 0"/><inertial pos="0 0 0" mass="1"/></body></body>
</worldbody></mujoco>"""
JOINTS = ["shoulder", "wrist", "rail", "neck"]
NAMES = ("joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w")
ORDERS = {"order": "wxyz", "body_order": "breadth-first", "velocity_at": "mass"}


@pytest.fixture
def arm(tmp_path) -> tumble.Robot:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return tumble.Robot.load(path)


def keys(rng: np.random.Generator, frames: int) -> tuple[np.ndarray, ...]:
    """Joints, positions of the root and its rotations, w first."""
    joints = np.cumsum(0.2 * rng.normal(size=(frames, 4)), axis=0)
    root = np.cumsum(0.05 * rng.normal(size=(frames, 3)), axis=0)
    half = np.cumsum(0.1 * rng.normal(size=frames))
    rotations = np.stack([np.cos(half), 0 * half, np.sin(half) * 0.6, np.sin(half) * 0.8], axis=1)
    return joints, root, rotations


def clip(motion: tuple[np.ndarray, ...], rate: float = 30, names: list[str] = JOINTS) -> tumble.Clip:
    joints, root, rotations = motion
    times = np.arange(len(root)) / rate
    scalars = {name: (times, joints[:, JOINTS.index(name)]) for name in names}
    return tumble.Clip(
        times, np.roll(rotations, -1, axis=1)[None], layout="track", names=["root"], translations=[root], scalars=scalars
    )


@pytest.mark.parametrize("method", ["slerp", "bessel-overhauser"])
def test_joints_and_bodies_are_those_of_the_engine(arm, rng, method):
    motions = [keys(rng, 20), keys(rng, 31)]
    library = tumble.MotionLibrary([clip(motion) for motion in motions], robot=arm, method=method, **ORDERS)
    assert library.joint_names == arm.joint_names == JOINTS and library.joints == 4
    assert library.body_names == arm.body_names("breadth-first") and library.dof_names == []
    for index, motion in enumerate(motions):
        expected = tumble.Engine("cpu").bodies(arm, *motion, source_fps=30, fps=50, method=method, **ORDERS)
        found = library.sample(index, np.arange(len(expected["joint_pos"])) / 50)
        np.testing.assert_allclose(found.joint_pos, expected["joint_pos"], atol=5e-7)
        np.testing.assert_allclose(found.body_pos_w, expected["body_pos_w"], atol=2e-6)
        dots = np.sum(found.body_quat_w.astype(float) * expected["body_quat_w"], axis=-1)
        np.testing.assert_allclose(np.abs(dots), 1.0, atol=1e-6)
        for name in ("joint_vel", "body_lin_vel_w", "body_ang_vel_w"):
            np.testing.assert_allclose(getattr(found, name), expected[name], rtol=1e-4, atol=1e-4)


def test_velocities_of_frames_windows_and_arrays(arm, rng):
    motion = keys(rng, 30)
    library = tumble.MotionLibrary([clip(motion)], robot=arm, order="xyzw")
    at = [[0.1, 0.35]]
    finite = library.sample(0, at, finite=True)
    frames = [library.sample(0, [[np.floor(t * 30 + 1e-6 + step) / 30 for t in at[0]]]) for step in (0, 1)]
    for name, of in (("joint_vel", "joint_pos"), ("body_lin_vel_w", "body_pos_w")):
        difference = (getattr(frames[1], of) - getattr(frames[0], of)) * 30
        np.testing.assert_allclose(getattr(finite, name), difference, atol=2e-5)
    window = library.sample_windows(0, [0.1], 3, fps=30, arrays=["body_pos_w", "joint_vel"])
    assert window.body_pos_w.shape == (1, 3, 4, 3) and window.joint_vel.shape == (1, 3, 4) and window.body_quat_w is None
    same = library.sample(0, [[0.1, 0.1 + 1 / 30, 0.1 + 2 / 30]], out=window)
    assert same is window
    np.testing.assert_array_equal(window.body_pos_w, library.sample(0, [[0.1, 0.1 + 1 / 30, 0.1 + 2 / 30]]).body_pos_w)


def test_copies_and_shards_have_the_robot(arm, rng, tmp_path):
    library = tumble.MotionLibrary([clip(keys(rng, 9)) for _ in range(3)], robot=arm, **ORDERS)
    expected = library.sample([0, 2], [0.1, 0.2])
    library.save(tmp_path / "robot.npz")
    opened = tumble.MotionLibrary.open(tmp_path / "robot.npz")
    for other in (opened, pickle.loads(pickle.dumps(library)), pickle.loads(pickle.dumps(opened))):
        assert other.sample([0, 2], [0.1, 0.2]) == expected
        assert (other.body_names, other.joint_names) == (library.body_names, JOINTS)
    shard = pickle.loads(pickle.dumps(library.shard(0, 2)))
    assert shard.sample([0, 1], [0.1, 0.2]) == expected
    arrays = dict(np.load(tmp_path / "robot.npz"))
    arrays["tree_frames"][1, 3] = 1
    np.savez(tmp_path / "broken.npz", **arrays)
    with pytest.raises(tumble.InputError):
        tumble.MotionLibrary.open(tmp_path / "broken.npz")


def test_joints_without_keys_rest_and_others_are_refused(arm, rng):
    motion = keys(rng, 5)
    some = clip(motion, names=["neck", "shoulder"])
    with pytest.warns(tumble.InputWarning, match="joints without keys stay where the robot's file has them: wrist, rail"):
        library = tumble.MotionLibrary([some, clip(motion)], robot=arm, order="wxyz")
    still = library.sample([0, 1], 0.1, arrays=["joint_pos"]).joint_pos
    assert (still[0] == [still[1, 0], 0, 0, still[1, 3]]).all()
    other = tumble.Clip([0.0], [[0, 0, 0, 1]], names=["root"], scalars={"elbow": ([0.0], [0.0])})
    with pytest.raises(tumble.InputError, match="clips\\[0\\].*no joint `elbow`") as raised:
        tumble.MotionLibrary([other], robot=arm, order="wxyz")
    assert raised.value.code == "E904"
    left = tumble.MotionLibrary([clip(motion), other], robot=arm, order="wxyz", on_error="skip")
    assert len(left) == 1 and "elbow" in left.skipped[0].message
    turned = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1]] * 2, names=["root"], scalars={"wrist": ([0.0, 1.0], [0.0, 5000.0])})
    with pytest.warns(tumble.InputWarning), pytest.raises(tumble.InputError, match="`wrist` reaches 5000.0 rad.*4096"):
        tumble.MotionLibrary([turned], robot=arm, order="wxyz")


def test_what_does_not_belong_to_a_robot_is_refused(arm, rng):
    good = clip(keys(rng, 5))
    for options, message in [
        ({"robot": arm}, "order: give"),
        ({"robot": arm, "order": "zyx"}, "zyx"),
        ({"robot": arm, "order": "wxyz", "body_order": "by-name"}, "depth-first, breadth-first"),
        ({"robot": arm, "order": "wxyz", "skeleton": good}, "give one of the two"),
        ({"order": "wxyz", "siblings": "file"}, "order, siblings: of a robot's bodies"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            tumble.MotionLibrary([good], **options)
    library = tumble.MotionLibrary([good], robot=arm, order="wxyz")
    for options, message in [
        ({"arrays": ["positions"]}, "no positions"),
        ({"arrays": ["dofs"]}, "no dofs"),
        ({"order": "xyzw"}, "order, rotations and heading"),
        ({"out": tumble.MotionState(positions=np.zeros((4, 3), np.float32))}, "no positions"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            library.sample(0, 0.0, **options)
    plain = tumble.MotionLibrary([tumble.Clip([0.0], [[0, 0, 0, 1]], parents=[None])])
    with pytest.raises(tumble.InputError, match="make the library with `robot`"):
        plain.sample(0, 0.0, arrays=["body_pos_w"])


@pytest.mark.parametrize("name", [name for name in tumble.devices() if name != "CPU"])
def test_arrays_of_a_device_have_the_bits_of_the_cpu(arm, rng, name):
    clips = [clip(keys(rng, frames)) for frames in (2, 30)]
    cpu, library = (tumble.MotionLibrary(clips, robot=arm, device=where, **ORDERS) for where in (None, name))
    ids, at = cpu.draw(100, rng)
    for finite in (False, True):
        expected, found = (one.sample(ids, at, finite=finite) for one in (cpu, library))
        for array in NAMES:
            values = getattr(found, array)
            assert isinstance(values, tumble.DeviceArray) and values.shape == getattr(expected, array).shape
            assert (values.numpy().view(np.uint32) == getattr(expected, array).view(np.uint32)).all(), array
    some = library.sample(1, [0.5], arrays=["joint_vel", "body_quat_w"])
    assert some.body_pos_w is None and some.joint_vel.shape == (1, 4) and some.body_quat_w.shape == (1, 4, 4)
