"""Features for learning, computed from arrays: rotations as six numbers, headings, root motion, contacts, mirrored poses,
and the 263 numbers of HumanML3D. All are computed in float64, with the same bits on every processor.

>>> import tumble
>>> tumble.features.mirror_pairs(["left_foot", "right_foot"])
[1, 0]
"""

from tumble._tumble import (
    contacts,
    heading,
    humanml3d,
    mirror_pairs,
    mirrored_positions,
    mirrored_rotations,
    positions_of_humanml3d,
    root_after_loops,
    root_motion,
    rotations_of_six,
    six,
)

__all__ = [
    "contacts",
    "heading",
    "humanml3d",
    "mirror_pairs",
    "mirrored_positions",
    "mirrored_rotations",
    "positions_of_humanml3d",
    "root_after_loops",
    "root_motion",
    "rotations_of_six",
    "six",
]
