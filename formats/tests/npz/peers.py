"""The samples as NumPy reads them and SciPy turns them, beside what we wrote of them."""

import sys

import numpy as np
from scipy.spatial.transform import Rotation

samples, written = sys.argv[1:]
for name in ["smplh_like.npz", "smplx_like.npz"]:
    given = np.load(f"{samples}/{name}")
    own = np.load(f"{written}/own_{name}")
    kept = np.load(f"{written}/kept_{name}")
    frames = len(given["poses"])
    joints = given["poses"].shape[1] // 3
    expected = Rotation.from_rotvec(given["poses"].reshape(-1, 3))
    rotations = own["rotations"]
    assert rotations.dtype == "<f4" and rotations.shape == (joints, frames, 4)
    found = Rotation.from_quat(np.swapaxes(rotations, 0, 1).reshape(-1, 4))
    apart = (found.inv() * expected).magnitude().max()
    assert (np.einsum("tfc,tfc->tf", rotations[:, 1:], rotations[:, :-1]) >= 0).all()
    assert np.array_equal(own["times"], np.arange(frames) / 120)
    assert own["fps"] == 120 and own["parents"][0] == -1 and own["names"][1] == "left_hip"

    # The file keeps its layout. Signs and lengths of rotation vectors may differ, the rotations are
    # the same.
    assert kept["poses"].dtype == given["poses"].dtype
    again = Rotation.from_rotvec(kept["poses"].reshape(-1, 3))
    apart = max(apart, (again.inv() * expected).magnitude().max())
    assert apart < 5e-7, apart
    steps = np.linalg.norm(np.diff(kept["poses"].reshape(frames, joints, 3), axis=0), axis=-1)
    print(f"{name}: {apart:.2e} rad apart; neighbouring vectors {steps.max():.2f} apart")
    assert steps.max() < np.pi, steps.max()
    same = [key for key in given.files if given[key].ndim == 0 or key == "betas"]
    for key in [key for key in same if "rate" not in key]:
        assert given[key].dtype == kept[key].dtype and np.array_equal(given[key], kept[key]), key
    for key in kept.files:
        assert kept[key].shape == given[key].shape, key
