"""Compares the bodies of random configurations of a robot with MuJoCo's: forward.py ROBOT.xml [COUNT]

The robot has one free joint and hinges. Needs `pip install mujoco`. Prints the largest difference in metres, rad, and of the
velocities, relative to the largest of the same configuration.
"""

import sys

import mujoco
import numpy as np
import tumble

path, count = sys.argv[1], int((sys.argv[2:] or [10_000])[0])
model = mujoco.MjModel.from_xml_path(path)
data = mujoco.MjData(model)
rng = np.random.default_rng(11)
qpos = rng.uniform(-3, 3, (count, model.nq))
qpos[:, 3:7] = rng.normal(size=(count, 4))
qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
qvel = rng.normal(0, 2, (count, model.nv))

bodies = range(1, model.nbody)
position, rotation, velocity, root_turn = [], [], [], []
for at, rate in zip(qpos, qvel):
    data.qpos, data.qvel = at, rate
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    six = np.zeros((model.nbody, 6))
    for body in bodies:
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, six[body], 0)
    position.append(data.xpos[1:].copy())
    rotation.append(data.xquat[1:].copy())
    velocity.append(six[1:])
    # MuJoCo's angular velocity of a free joint is in the body's axes.
    root_turn.append(data.xmat[1].reshape(3, 3) @ rate[3:6])
velocity = np.array(velocity)

robot = tumble.Robot.load(path)
keys = (qpos[:, 7:], qpos[:, :3], qpos[:, 3:7])
exact = robot.forward(*keys, order="wxyz", joint_vel=qvel[:, 6:], root_lin_vel=qvel[:, :3], root_ang_vel=root_turn)
single = tumble.Engine("cpu").bodies(robot, *keys, order="wxyz", source_fps=30, fps=30, method="slerp")
for label, found in [("f64", exact), ("f32", single)]:
    print(label, "positions, m", np.abs(found["body_pos_w"] - position).max())
    # The length of the difference of two quaternions of either sign is half the angle between them.
    apart = [np.linalg.norm(found["body_quat_w"] - sign * np.array(rotation), axis=-1) for sign in (1, -1)]
    print(label, "rotations, rad", 2 * np.minimum(*apart).max())
for name, expected in [("body_lin_vel_w", velocity[..., 3:]), ("body_ang_vel_w", velocity[..., :3])]:
    largest = np.linalg.norm(expected, axis=-1).max(axis=1, keepdims=True)
    print("f64", name, (np.linalg.norm(exact[name] - expected, axis=-1) / largest).max())
