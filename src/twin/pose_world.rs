//! Twin of `shaders/poses/world.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::product;
use crate::shader::{Link, ROOT};
use crate::twin::quaternion::{normalised, rotated};

/// One frame: from each track's rotation in its parent's frame to its rotation and its position in
/// the world. `links` lists parents before their children.
#[inline(always)]
pub(crate) fn pose(local: &[[f32; 4]], links: &[Link], world: &mut [[f32; 4]]) {
    for link in links {
        let local_rotation = local[link.track as usize];
        let mut rotation = local_rotation;
        let mut position = link.offset;
        if link.parent != ROOT {
            let parent = 2 * link.parent as usize;
            let parent_rotation = world[parent];
            rotation = normalised(product(parent_rotation, local_rotation));
            let rotated_offset = rotated(parent_rotation, link.offset);
            position = std::array::from_fn(|c| world[parent + 1][c] + rotated_offset[c]);
        }
        let output = 2 * link.track as usize;
        let [x, y, z] = position;
        world[output] = rotation.map(canonical);
        world[output + 1] = [x, y, z, 0.0].map(canonical);
    }
}
