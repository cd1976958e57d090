"""Bulk interpolation of rotations on Vulkan and the CPU, with the same bits from both.

Keys go in as arrays or files, rotations come out as float32 arrays of NumPy's:

>>> import numpy as np, tumble
>>> half = np.sqrt(0.5)
>>> keys = [[0, 0, 0, 1], [0, 0, half, half]]                    # x y z w
>>> tumble.evaluate([0.0, 1.0], keys, fps=2, method="slerp").round(4)
array([[0.    , 0.    , 0.    , 1.    ],
       [0.    , 0.    , 0.3827, 0.9239],
       [0.    , 0.    , 0.7071, 0.7071]], dtype=float32)

`load` and `save` read and write motion files, `Clip` holds tracks of keys, `Engine` is a device
that is kept open. Quaternions are x y z w unless you pass `order="wxyz"`; times are seconds; angular
velocities are rad/s.
"""

from __future__ import annotations

import sys as _sys

from tumble import _notebook, _tumble, features
from tumble._errors import (
    DeviceError,
    Error,
    InputError,
    InputWarning,
    MissingFileError,
    OutputError,
)
from tumble._motion import MotionLibrary, MotionState, Skipped
from tumble._tumble import (
    ArrayDifference,
    ChannelDifference,
    Chunk,
    Chunks,
    Clip,
    ClipDifference,
    ClipEvent,
    Crowd,
    DeviceArray,
    Engine,
    File,
    JointDifference,
    PassedEvent,
    PathErrors,
    PathStatistics,
    Reduction,
    Robot,
    Route,
    Sampler,
    Spread,
    Surface,
    Verification,
    Walk,
    compare,
    devices,
    encodings,
    evaluate,
    load,
    methods,
    path_errors,
    reduce,
    retarget,
    save,
    walk,
)

read = load
write = save

__version__: str = _tumble.__version__

__all__ = [
    "ArrayDifference",
    "ChannelDifference",
    "Chunk",
    "Chunks",
    "Clip",
    "ClipDifference",
    "ClipEvent",
    "Crowd",
    "DeviceArray",
    "DeviceError",
    "Engine",
    "Error",
    "File",
    "InputError",
    "InputWarning",
    "JointDifference",
    "MissingFileError",
    "MotionLibrary",
    "MotionState",
    "OutputError",
    "PassedEvent",
    "PathErrors",
    "PathStatistics",
    "Reduction",
    "Robot",
    "Route",
    "Sampler",
    "Skipped",
    "Spread",
    "Surface",
    "Verification",
    "Walk",
    "compare",
    "devices",
    "encodings",
    "evaluate",
    "features",
    "load",
    "methods",
    "path_errors",
    "read",
    "reduce",
    "retarget",
    "save",
    "walk",
    "write",
]

# A Vulkan driver may end the process that loads it. Therefore a separate process loads the drivers first: this
# interpreter, with only the extension module.
_LOAD_DRIVERS = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("tumble._tumble", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
module.load_drivers()
"""
if _sys.executable and _tumble.__file__:
    _tumble.set_probe([_sys.executable, "-I", "-S", "-c", _LOAD_DRIVERS, _tumble.__file__])
