"""Robots: bodies of configurations, and motions of joints with their bodies."""

import pickle

import numpy as np
import pytest
import tumble

ARM = """<mujoco model="arm"><worldbody>
  <body name="base" pos="0 0 1"><freejoint name="root"/><inertial pos="0 0 0.5" mass="1"/>
    <body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" range="-90 90"/><inertial pos="0 0 0.5" mass="1"/>
      <body name="hand" pos="0 0 1"><joint name="wrist" axis="0 0 1"/><inertial pos="0.5 0 0" mass="1"/></body></body>
    <body name="head" pos="0 1 0"><inertial pos="0 0 0" mass="1"/></body></body>
</worldbody></mujoco>"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return tumble.Robot.load(path)


def test_robots_say_their_joints_and_bodies(arm):
    assert repr(arm) == "Robot('arm', 4 bodies, 3 joints)".replace("'", '"')
    assert (arm.name, arm.joint_names, arm.root_names, arm.ball_names) == ("arm", ["shoulder", "wrist"], ["root"], [])
    assert arm.body_names() == ["base", "upper", "hand", "head"]
    assert arm.body_names("breadth-first") == ["base", "upper", "head", "hand"]
    np.testing.assert_allclose(arm.limits, [[-np.pi / 2, np.pi / 2], [-np.inf, np.inf]])
    again = pickle.loads(pickle.dumps(arm))
    assert again.body_names() == arm.body_names()
    with pytest.raises(tumble.InputError, match="depth-first, breadth-first"):
        arm.body_names("by-name")
    with pytest.raises(tumble.MissingFileError):
        tumble.Robot.load("missing.xml")


def test_bodies_follow_from_joints(arm):
    quarter = np.sqrt(0.5)
    found = arm.forward([np.pi / 2, 0.0], [1, 2, 3], [quarter, 0, 0, quarter], order="wxyz", joint_vel=[2.0, 0.0])
    # The shoulder's axis, turned about z with the root, is -x.
    np.testing.assert_allclose(found["body_pos_w"], [[1, 2, 3], [1, 2, 4], [1, 3, 4], [0, 2, 3]], atol=1e-15)
    np.testing.assert_allclose(found["body_lin_vel_w"][2], [0, 0, -2], atol=1e-15)
    np.testing.assert_allclose(found["body_ang_vel_w"][3], [0, 0, 0])
    at_mass = arm.forward([0.0, 0.0], order="wxyz", joint_vel=[0.0, 3.0], velocity_at="mass")
    np.testing.assert_allclose(at_mass["body_lin_vel_w"][2], [0, 1.5, 0], atol=1e-15)
    # If the root pose is not passed, it is that of the file.
    np.testing.assert_allclose(at_mass["body_pos_w"][0], [0, 0, 1])
    many = arm.forward(np.zeros((5, 2, 2)), order="xyzw", body_order="breadth-first")
    assert many["body_pos_w"].shape == (5, 2, 4, 3)
    assert "body_lin_vel_w" not in many
    np.testing.assert_array_equal(many["body_quat_w"][..., 3], 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.0],), r"joint_pos: its shape is \(1,\); give \(…, 2\)"),
        (([[0.0, 0.0]], [0, 0, 0]), r"root_pos: its shape is \(3,\); give \(1, 3\)"),
        (([0.0, np.nan],), "scalar 1 is NaN"),
    ],
)
def test_what_does_not_fit_is_refused(arm, arguments, message):
    with pytest.raises(tumble.InputError, match=message):
        arm.forward(*arguments, order="wxyz")


def test_quaternions_of_no_stated_order_are_refused(arm):
    with pytest.raises(TypeError, match="order"):
        arm.forward([0.0, 0.0])


def test_motions_are_interpolated_in_joints(arm):
    engine = tumble.Engine("cpu")
    # The wrist has no limits, so its angle continues beyond half a turn.
    keys = [[0.0, 3.0], [0.2, 3.4 - 2 * np.pi], [0.4, 3.8 - 2 * np.pi]]
    root = [[0, 0, 1], [1, 0, 1], [2, 0, 1]]
    still = np.tile([1, 0, 0, 0], (3, 1))
    found = engine.bodies(arm, keys, root, still, order="wxyz", source_fps=10, fps=20, method="slerp")
    np.testing.assert_allclose(found["joint_pos"][:, 1], [3.0, 3.2, 3.4, 3.6, 3.8], rtol=1e-6)
    np.testing.assert_allclose(found["joint_vel"], np.tile([2, 4], (5, 1)), rtol=1e-5)
    np.testing.assert_allclose(found["body_lin_vel_w"][:, 0], np.tile([10, 0, 0], (5, 1)), rtol=1e-5)
    expected = arm.forward(found["joint_pos"], [[x, 0, 1] for x in (0, 0.5, 1, 1.5, 2)], np.tile([1, 0, 0, 0], (5, 1)), order="wxyz")
    np.testing.assert_allclose(found["body_pos_w"], expected["body_pos_w"], atol=1e-6)
    # Columns by name, in another order.
    named = engine.bodies(
        arm, np.flip(keys, 1), root, still, order="wxyz", joint_names=["wrist", "shoulder"], source_fps=10, fps=20, method="slerp"
    )
    for name, values in found.items():
        np.testing.assert_array_equal(named[name], values)
    with pytest.warns(tumble.InputWarning, match="joints without keys stay where the file has them: root, wrist"):
        engine.bodies(arm, [[0.0], [1.0]], order="wxyz", joint_names=["shoulder"], source_fps=10, fps=20)
    with pytest.warns(tumble.InputWarning, match="`shoulder` leaves its limits by up to 0.4292"):
        engine.bodies(arm, [[0.0, 0.0], [2.0, 0.0]], root[:2], still[:2], order="wxyz", source_fps=10, fps=10)
    with pytest.raises(tumble.InputError, match="no joint `wirst`.*did you mean `wrist`"):
        engine.bodies(arm, [[0.0]], order="wxyz", joint_names=["wirst"], source_fps=10, fps=10)
    with pytest.raises(tumble.InputError, match="give `source_fps`"):
        engine.bodies(arm, [[0.0, 0.0]], order="wxyz", fps=10)


def test_bodies_are_those_of_mujoco(shared):
    robot = tumble.Robot.load(shared / "robots" / "robots" / "pico.xml")
    arrays = np.load(shared / "robots" / "fk" / "pico.npz")
    rotation = arrays["qpos"][:, 3:7]
    turn = [rotated(q, v) for q, v in zip(rotation, arrays["qvel"][:, 3:6])]
    for order, index in [("depth-first", "order_depth_first"), ("breadth-first", "order_breadth_first")]:
        found = robot.forward(
            arrays["qpos"][:, 7:], arrays["qpos"][:, :3], rotation, order="wxyz", joint_vel=arrays["qvel"][:, 6:],
            root_lin_vel=arrays["qvel"][:, :3], root_ang_vel=turn, body_order=order,
        )
        for name in ["body_pos_w", "body_lin_vel_w", "body_ang_vel_w"]:
            np.testing.assert_allclose(found[name], arrays[name][:, arrays[index]], atol=1e-12)
        dots = np.sum(found["body_quat_w"] * arrays["body_quat_w"][:, arrays[index]], -1)
        np.testing.assert_allclose(np.abs(dots), 1.0, atol=1e-13)


def test_robots_without_a_free_joint_move_with_their_root(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(
        '<robot name="arm"><link name="base"><inertial><mass value="1"/></inertial></link>'
        '<link name="hand"><inertial><mass value="1"/></inertial></link><link name="tip"><inertial><mass value="3"/></inertial></link>'
        '<joint name="elbow" type="continuous"><parent link="base"/><child link="hand"/><origin xyz="0 0 1"/></joint>'
        '<joint name="mount" type="fixed"><parent link="hand"/><child link="tip"/><origin xyz="0 0.4 0"/></joint></robot>'
    )
    robot = tumble.Robot.load(path)
    half = np.sqrt(0.5)
    joints, root = [[0.0], [0.5]], ([[1, 2, 3], [2, 2, 3]], [[half, half, 0, 0]] * 2)
    found = tumble.Engine("cpu").bodies(robot, joints, *root, order="wxyz", source_fps=1, fps=1)
    expected = robot.forward(joints, *root, order="wxyz")
    np.testing.assert_allclose(found["body_pos_w"], expected["body_pos_w"], atol=1e-6)
    # The root's quarter turn about x takes the hand from z to -y.
    np.testing.assert_allclose(found["body_pos_w"][0, 1], [1, 1, 3], atol=1e-6)
    np.testing.assert_allclose(found["body_lin_vel_w"][0, 0], [1, 0, 0], atol=1e-6)
    still = tumble.Engine("cpu").bodies(robot, joints, root[0], order="wxyz", source_fps=1, fps=1)
    np.testing.assert_allclose(still["body_pos_w"][:, 1], np.add(root[0], [0, 0, 1]), atol=1e-6)
    merged = tumble.Robot.load(path, fixed_bodies="merge")
    assert merged.body_names() == ["base", "hand"]
    assert pickle.loads(pickle.dumps(merged)).body_names() == ["base", "hand"]
    # About x, the common centre of mass is 0.3 m away from the elbow.
    for of, body, velocity in [(robot, 2, 0.8), (merged, 1, 0.6)]:
        moving = of.forward([0.0], order="wxyz", joint_vel=[2.0], velocity_at="mass")
        np.testing.assert_allclose(moving["body_lin_vel_w"][body], [0, 0, velocity], atol=1e-15)


def rotated(quaternion, vector):
    """MuJoCo's angular velocities are in the body's axes."""
    w, v = quaternion[0], quaternion[1:]
    return vector + 2 * np.cross(v, np.cross(v, vector) + w * vector)


@pytest.mark.parametrize("rate", [30, 50])
def test_resampled_motions_are_those_that_are_expected(shared, rate):
    robot = tumble.Robot.load(shared / "robots" / "robots" / "pico.xml")
    expected = np.load(shared / "robots" / "layouts" / "expected.npz")
    assert list(expected["joint_names"]) == robot.joint_names
    keys = [expected[name] for name in ("joint_pos", "root_pos", "root_quat_wxyz")]
    found = tumble.Engine("cpu").bodies(robot, *keys, order="wxyz", source_fps=30, fps=rate, method="slerp")
    for name in ["joint_pos", "joint_vel", "body_pos_w", "body_lin_vel_w", "body_ang_vel_w"]:
        np.testing.assert_allclose(found[name], expected[f"exact{rate}_{name}"], atol=1e-5, rtol=1e-5)
    dots = np.sum(found["body_quat_w"] * expected[f"exact{rate}_body_quat_w"], -1)
    np.testing.assert_allclose(np.abs(dots), 1.0, atol=1e-6)
    at_mass = tumble.Engine("cpu").bodies(
        robot, *keys, order="wxyz", source_fps=30, fps=rate, method="slerp", velocity_at="mass"
    )
    np.testing.assert_allclose(at_mass["body_lin_vel_w"], expected[f"exact{rate}_body_com_lin_vel_w"], atol=1e-5, rtol=1e-5)


def test_scalars_are_evaluated_and_kept():
    half = np.sqrt(0.5)
    keys = {"knee": ([0.0, 0.5, 1.0], [0.1, 0.4, 0.2]), "grip": ([0.0, 1.0], [0.0, 1.0])}
    clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, half, half]], names=["root"], scalars=keys)
    assert list(clip.scalars) == ["knee", "grip"]
    for name, (times, values) in keys.items():
        np.testing.assert_array_equal(clip.scalars[name][0], times)
        np.testing.assert_array_equal(clip.scalars[name][1], np.float32(values))
    engine = tumble.Engine("cpu")
    found = engine.scalars(clip, fps=4, method="slerp")
    np.testing.assert_allclose(found, [[0.1, 0.25, 0.4, 0.3, 0.2], [0, 0.25, 0.5, 0.75, 1]], rtol=1e-6)
    assert found.dtype == np.float32
    rates = engine.scalars(clip, at=[0.0, 0.5, 1.0], method="slerp", quantity="velocity", names=["knee"], layout="frame")
    # At a key, the rate of the interval after it; at the last key, that of the last interval.
    np.testing.assert_allclose(rates, [[0.6], [-0.4], [-0.4]], rtol=1e-6)
    np.testing.assert_array_equal(engine.scalars(clip, fps=4, quantity="acceleration", method="slerp"), 0)
    again = pickle.loads(pickle.dumps(clip))
    assert again == clip
    np.testing.assert_array_equal(engine.scalars(again, fps=50), engine.scalars(clip, fps=50))
    with pytest.raises(tumble.InputError, match="has no scalar `knees`"):
        engine.scalars(clip, fps=4, names=["knees"])
    with pytest.raises(tumble.InputError, match="value, velocity, acceleration"):
        engine.scalars(clip, fps=4, quantity="speed")
    with pytest.raises(tumble.InputError, match="give a pair"):
        tumble.Clip([0.0], [[0, 0, 0, 1]], scalars={"knee": [0.0, 1.0]})
    with pytest.raises(tumble.InputError, match="does not come after"):
        tumble.Clip([0.0], [[0, 0, 0, 1]], scalars={"knee": ([1.0, 0.0], [0.0, 1.0])})


def test_clips_of_robots_files_have_their_scalars(tmp_path):
    rows = "".join(f"{k / 30},0,1,0,0,0,1,{k * 0.01},{-k * 0.02}\n" for k in range(31))
    (tmp_path / "take.csv").write_text(rows)
    with pytest.warns(UserWarning):
        clip = tumble.load(tmp_path / "take.csv").clip
    assert list(clip.scalars) == ["joint_0", "joint_1"]
    np.testing.assert_allclose(tumble.Engine().scalars(clip, fps=60)[0, :3], [0, 0.005, 0.01], atol=1e-6)
