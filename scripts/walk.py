#!/usr/bin/env python3
"""Writes data/walk.bvh: two seconds of a walk, computed from sines. It is nobody's recording, so anybody may use it.

    scripts/walk.py > data/walk.bvh

Metres, y up, walking towards +z; 17 joints, 61 frames at 30 a second; the motion repeats after a second, but for the
way that the hips have gone.
"""

import math

# Name, offset from the parent, children. Arms turn about x last, so that they swing forwards when they hang down.
LEGS = [
    (f"{side}UpLeg", (0.09 * x, -0.05, 0), [(f"{side}Leg", (0, -0.44, 0), [(f"{side}Foot", (0, -0.41, 0), (0, -0.06, 0.14))])])
    for side, x in [("Left", 1), ("Right", -1)]
]
ARMS = [
    (
        f"{side}Arm",
        (0.18 * x, 0.12, 0),
        [(f"{side}ForeArm", (0.28 * x, 0, 0), [(f"{side}Hand", (0.25 * x, 0, 0), (0.09 * x, 0, 0))])],
    )
    for side, x in [("Left", 1), ("Right", -1)]
]
HEAD = ("Neck", (0, 0.2, 0), [("Head", (0, 0.1, 0), (0, 0.18, 0))])
ROOT = ("Hips", (0, 0.95, 0), [("Spine", (0, 0.1, 0), [("Chest", (0, 0.18, 0), [HEAD, *ARMS])]), *LEGS])

FRAMES, RATE, SPEED = 61, 30, 1.25


def numbers(values):
    return " ".join(f"{value + 0.0:.4f}" for value in values)


def hierarchy(joint, depth, names):
    name, offset, children = joint
    space = "  " * depth
    order = "XYZ" if "Arm" in name else "ZXY"
    rotations = " ".join(f"{axis}rotation" for axis in order)
    channels = f"6 Xposition Yposition Zposition {rotations}" if depth == 0 else f"3 {rotations}"
    names.append(name)
    print(f"{space}{'JOINT' if depth else 'ROOT'} {name}\n{space}{{")
    print(f"{space}  OFFSET {numbers(offset)}\n{space}  CHANNELS {channels}")
    if isinstance(children, tuple):
        print(f"{space}  End Site\n{space}  {{\n{space}    OFFSET {numbers(children)}\n{space}  }}")
    else:
        for child in children:
            hierarchy(child, depth + 1, names)
    print(f"{space}}}")


def angles(name, phase):
    """Degrees, in the order of the joint's channels."""
    left = name.startswith("Left")
    side = 1 if left else -1
    step = phase if left else phase + math.pi
    swing, forward = math.sin(step), math.cos(step)
    if name.endswith("UpLeg"):
        return 0, -4 - 24 * swing, 0
    if name.endswith("Leg"):
        return 0, 8 + 46 * max(0.0, math.cos(step + 0.4)) ** 2, 0
    if name.endswith("Foot"):
        return 0, 6 * swing - 10 * max(0.0, -forward), 0
    if name.endswith("ForeArm"):
        return 0, -side * (22 - 10 * swing), 0
    if name.endswith("Arm"):
        return 20 * swing, 0, -side * 76
    return {
        "Hips": (2 * math.cos(phase), 3, -5 * math.sin(phase)),
        "Spine": (-1.5 * math.cos(phase), 1, 4 * math.sin(phase)),
        "Chest": (-1 * math.cos(phase), 1, 5 * math.sin(phase)),
        "Neck": (0, -3, -2 * math.sin(phase)),
        "Head": (0, 1.5 * math.cos(2 * phase), -2 * math.sin(phase)),
    }.get(name, (0, 0, 0))


print("HIERARCHY")
joints: list[str] = []
hierarchy(ROOT, 0, joints)
print(f"MOTION\nFrames: {FRAMES}\nFrame Time: {1 / RATE:.6f}")
for frame in range(FRAMES):
    time = frame / RATE
    phase = 2 * math.pi * time
    hips = (0.015 * math.sin(phase), 0.93 + 0.02 * math.cos(2 * phase), SPEED * time)
    print(numbers([*hips, *(angle for name in joints for angle in angles(name, phase))]))
