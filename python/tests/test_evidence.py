"""The figures of docs/robots-evidence.md: formulas of other programs, restated in NumPy, beside Tumble's results.

The motion is analytic, so that the right values are known. `UPDATE_EXPECTED=1` writes the table of the page.
"""

import os

import numpy as np
import tumble
from conftest import ROOT

PAGE = ROOT / "docs/robots-evidence.md"
BEGIN, END = "<!-- figures: written by python/tests/test_evidence.py -->\n", "<!-- end of figures -->\n"
JOINTS, FRAMES, SOURCE, TARGET = 13, 31, 30, 50
INDEX = np.arange(JOINTS)

ROBOT = """<mujoco model="two arms"><compiler angle="radian"/><worldbody><body name="chest" pos="0 0 1"><freejoint name="free"/>
  <body name="left_upper" pos="0 0.2 0.3"><joint name="left_shoulder" axis="0 1 0"/>
    <body name="left_lower" pos="0 0.1 -0.3"><joint name="left_elbow" axis="1 0 0"/></body></body>
  <body name="right_upper" pos="0 -0.2 0.3"><joint name="right_shoulder" axis="0 1 0"/>
    <body name="right_lower" pos="0 -0.1 -0.3"><joint name="right_elbow" axis="1 0 0"/></body></body>
</body></worldbody></mujoco>"""


def angles(times):
    phase = 2 * np.pi * (0.5 + 0.07 * INDEX) * times[:, None] + 0.3 * INDEX
    return 0.4 * np.sin(phase) - 0.05 * INDEX


def velocities(times):
    rate = 2 * np.pi * (0.5 + 0.07 * INDEX)
    return 0.4 * rate * np.cos(rate * times[:, None] + 0.3 * INDEX)


def linear(keys, times):
    """Samples on straight lines between the keys, as csv_to_npz of mjlab and BeyondMimic computes them."""
    before = np.minimum((times * SOURCE + 1e-9).astype(int), FRAMES - 2)
    part = times[:, None] * SOURCE - before[:, None]
    return keys[before] * (1 - part) + keys[before + 1] * part


def gauss(values, sigma):
    """scipy.ndimage.gaussian_filter1d(mode="nearest"), as ASAP, PHC and GR00T smooth velocities."""
    radius = int(4 * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    weights /= weights.sum()
    padded = np.concatenate([np.repeat(values[:1], radius, 0), values, np.repeat(values[-1:], radius, 0)])
    return np.stack([(weights[:, None] * padded[k : k + 2 * radius + 1]).sum(0) for k in range(len(values))])


def by_tumble(keys, method, ends=None):
    times = np.arange(FRAMES) / SOURCE
    clip = tumble.Clip([0.0], [[0, 0, 0, 1]], scalars={f"j{j}": (times, keys[:, j]) for j in INDEX})
    engine = tumble.Engine("cpu")
    how = dict(fps=TARGET, method=method, layout="frame", **({} if ends is None else {"ends": ends}))
    return engine.scalars(clip, quantity="velocity", **how)


def velocity_rows():
    keys = angles(np.arange(FRAMES) / SOURCE).astype(np.float32).astype(float)
    times = np.arange(TARGET * (FRAMES - 1) // SOURCE + 1) / TARGET
    truth = velocities(times)
    sampled = linear(keys, times)
    differences = np.gradient(sampled, 1 / TARGET, axis=0)
    found = {
        "central differences of linear samples (mjlab, BeyondMimic)": differences,
        "`np.gradient`, then a Gaussian of 2 frames (ASAP, PHC, GR00T)": gauss(differences, 2),
        "derivatives of linear curves (`-m slerp`)": by_tumble(keys, "slerp"),
        "derivatives of Bessel-Overhauser curves, the default": by_tumble(keys, "bessel-overhauser"),
        "derivatives of `c2` curves with parabolic ends": by_tumble(keys, "c2", "parabolic"),
    }
    for name, values in found.items():
        off = values - truth
        yield f"| {name} | {np.sqrt((off**2).mean()):.3f} | {np.abs(off).max():.3f} |"


def end_row():
    duration = (FRAMES - 1) / SOURCE
    torch = len(np.arange(0, np.float32(duration), np.float32(1 / TARGET), dtype=np.float32))
    clip = tumble.Clip(np.arange(FRAMES) / SOURCE, np.tile([0, 0, 0, 1.0], (FRAMES, 1)))
    ours = clip.evaluate(fps=TARGET).shape[1]
    return f"| frames of {FRAMES} keys at {SOURCE} fps, at {TARGET} fps | `arange(0, duration, dt)`: {torch} | {ours} |"


def stride_row():
    """GR00T's converter takes every int(120 / 50)th frame, and says 50."""
    source, jump = 120, int(120 / TARGET)
    played = source / jump
    return (
        f"| a second of 120 fps at {TARGET} fps | every {jump}nd frame: {source // jump} frames, "
        f"{source / jump / TARGET:.2f} s when played | {TARGET} frames, 1.00 s |"
    ), played


def rounding_row():
    """IsaacLab's AMP loader rounds the frame that a time follows, so that the part between two frames may be negative."""
    times = np.random.default_rng(1).uniform(0, (FRAMES - 1) / SOURCE, 10_000)
    part = times * SOURCE - np.round(times * SOURCE)
    return f"| samples between two frames, AMP's loader | {100 * (part < 0).mean():.0f} % are extrapolated | none |"


def order_rows(folder):
    path = folder / "arms.xml"
    path.write_text(ROBOT)
    robot = tumble.Robot.load(path)
    values = np.array([0.6, -0.4, -0.5, 0.8])
    # left_shoulder, right_shoulder, left_elbow, right_elbow: breadth first, read as depth first.
    depth = robot.forward(values, order="wxyz")["body_pos_w"]
    mistaken = robot.forward(values[[0, 2, 1, 3]], order="wxyz")["body_pos_w"]
    off = np.linalg.norm(depth - mistaken, axis=-1).max()
    yield f"| joints breadth first, read depth first | a hand is {100 * off:.0f} cm away (two arms of 60 cm) | E907, or E904 by name |"
    tilt = np.array([np.cos(0.05), np.sin(0.05), 0, 0])
    turned = tilt[[1, 2, 3, 0]]
    angle = np.degrees(2 * np.arccos(min(1.0, abs(turned[0]))))
    yield f"| w x y z read as x y z w, of a robot tilted by 6° | it is turned by {angle:.0f}° | E907, if the file has the poses of bodies |"


def hips_row():
    """HumanML3D's facing direction with the hips the other way round, for hips that are turned against the shoulders."""
    def across(half_width, degrees):
        angle = np.radians(degrees)
        return 2 * half_width * np.array([np.cos(angle), -np.sin(angle)])

    shoulders, hips = across(0.18, -10), across(0.06, 10)
    right, swapped = shoulders + hips, shoulders - hips
    cosine = right @ swapped / np.linalg.norm(right) / np.linalg.norm(swapped)
    return (
        f"| facing direction of HumanML3D, hips 20° against shoulders | {np.degrees(np.arccos(cosine)):.0f}° off, "
        "which is part of the format | the same numbers |"
    )


def table(folder):
    lines = ["| joint velocities, rad/s | rms error | largest error |", "|---|---|---|", *velocity_rows(), ""]
    lines += ["| | others | Tumble |", "|---|---|---|", end_row(), stride_row()[0], rounding_row()]
    return "\n".join([*lines, *order_rows(folder), hips_row()]) + "\n"


def test_the_figures_of_the_page_are_those_of_the_formulas(tmp_path):
    text = PAGE.read_text()
    before, rest = text.split(BEGIN)
    shown, after = rest.split(END)
    found = table(tmp_path)
    if os.environ.get("UPDATE_EXPECTED"):
        PAGE.write_text(before + BEGIN + found + END + after)
        return
    assert shown == found, "UPDATE_EXPECTED=1 writes the figures"


def test_ours_are_nearer_than_differences():
    rows = [[float(cell) for cell in row.split("|")[2:4]] for row in velocity_rows()]
    peers, smoothed, lines, default, c2 = rows
    assert c2[0] < default[0] < peers[0] / 3 and default[1] < peers[1] / 3
    # Linear curves have larger errors than the default, and so does smoothing.
    assert lines[0] > peers[0] and smoothed[0] > peers[0]
    assert stride_row()[1] == 60
