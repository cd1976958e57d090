"""Synthetic takes of a humanoid with 29 hinges, as BONES-SEED's CSV have them: 120 frames a second, centimetres, degrees.

    python takes.py FOLDER [COUNT]     # FOLDER/robot.xml, FOLDER/takes/0000.csv …; 1000 takes of 876 frames

Numbers of frames and columns are those of the 142 000 takes of 288 h: 876 frames each, 36 columns, about 330 bytes a row.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

JOINTS = 29
FRAMES = 876

LIMB = '<body name="{0}" pos="0 0 -0.1"><joint name="{0}" axis="{1}"/><inertial pos="0 0 -0.05" mass="1" diaginertia="0.01 0.01 0.01"/>'
AXES = ["1 0 0", "0 1 0", "0 0 1"]


def robot() -> str:
    """A waist and four limbs on a pelvis that moves freely, MJCF."""
    limbs = []
    joint = 0
    for length in (6, 6, 3, 7, 7):
        chain = "".join(LIMB.format(f"joint_{joint + i}", AXES[(joint + i) % 3]) for i in range(length))
        limbs.append(chain + "</body>" * length)
        joint += length
    return (
        '<mujoco model="takes"><compiler angle="radian"/><worldbody><body name="pelvis" pos="0 0 0.8">'
        f'<freejoint name="root"/><inertial pos="0 0 0" mass="9" diaginertia="0.1 0.1 0.1"/>{"".join(limbs)}</body></worldbody></mujoco>'
    )


def take(seed: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The rows of a take: sums of three sines for each number."""
    random = np.random.default_rng(seed)
    t = np.arange(FRAMES)[:, None, None] / 120
    columns = 6 + JOINTS
    rates = random.uniform(0.1, 2, (columns, 3))
    waves = np.sin(2 * np.pi * (rates * t + random.uniform(0, 1, (columns, 3)))).sum(-1)
    sizes = np.r_[[40, 40, 3, 5, 5, 60], np.full(JOINTS, 15)]
    return np.concatenate([np.arange(FRAMES)[:, None], [0, 0, 80, 0, 0, 0] + [0] * JOINTS + sizes * waves], 1)


def main() -> None:
    folder, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    (folder / "takes").mkdir(parents=True, exist_ok=True)
    (folder / "robot.xml").write_text(robot())
    root = [f"root_{part}{axis}" for part in ("translate", "rotate") for axis in "XYZ"]
    head = ",".join(["Frame", *root, *(f"joint_{i}_dof" for i in range(JOINTS))])
    for seed in range(count):
        rows = take(seed)
        lines = [f"{int(row[0])}," + ",".join(f"{number:.6f}" for number in row[1:]) for row in rows]
        (folder / "takes" / f"{seed:04}.csv").write_text("\n".join([head, *lines]) + "\n")


if __name__ == "__main__":
    main()
