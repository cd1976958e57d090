"""Arrays of robots' motion as programs name them: names of joints in a file, and arrays that do not fit each other."""

import pickle
import warnings

import numpy as np
import pytest

import tumble


def gmr(frames=3, **more):
    """GMR's arrays of three frames and two joints; `frames` is the number of the joints' frames."""
    return {
        "fps": 30.0,
        "root_pos": np.full((3, 3), 0.5),
        "root_rot": np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)),
        "dof_pos": np.full((frames, 2), 0.25),
        **more,
    }


@pytest.mark.parametrize("name", ["joint_names", "dof_names"])
def test_joints_have_the_names_of_the_file(tmp_path, name):
    file = tmp_path / "named.npz"
    np.savez(file, **gmr(**{name: np.array(["knee", "ankle"])}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clip = tumble.load(file)
    out = tmp_path / "out.npz"
    tumble.save(out, clip, fps=30)
    assert list(np.load(out)["scalar_names"]) == ["knee", "ankle"]


def test_arrays_of_other_lengths_are_named(tmp_path):
    file = tmp_path / "longer.pkl"
    file.write_bytes(pickle.dumps(gmr(frames=4)))
    with pytest.raises(ValueError, match=r"gmr have different numbers of frames: .*`dof_pos` \[4, 2\]"):
        tumble.load(file)


def test_wrapped_angles_are_noticed(tmp_path):
    file = tmp_path / "wrapped.npz"
    angles = np.array([[6.0, 0.0], [0.2, 0.1], [0.6, 0.2]])
    np.savez(file, **gmr(dof_pos=angles, joint_names=np.array(["wheel", "ankle"])))
    with pytest.warns(tumble.InputWarning, match=r"W915.*`wheel` changes by -332° between its keys at 0 and 0.0333"):
        tumble.load(file)
