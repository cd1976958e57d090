//! Features of motions for learning, in f64 and with the same bits on every processor: rotations as six numbers,
//! headings, root motion, contacts, mirrored poses, the 263 numbers of HumanML3D, and Kimodo's.
//! [docs/features.md](https://github.com/tumble-rs/tumble/blob/main/docs/features.md) has the formulas and their sources.

mod contacts;
pub(crate) mod heading;
mod heading_frame;
mod humanml3d;
mod kimodo;
mod mirror;
mod mirrored;
pub(crate) mod root_motion;
mod sets;
mod six;

pub use contacts::{ContactLimits, contacts, majority};
pub use heading::{Ground, facing, forward_heading, twist_heading};
pub use heading_frame::HeadingFrame;
pub use humanml3d::{
    HUMANML3D_JOINTS, HUMANML3D_NUMBERS, Humanml3dError, humanml3d, positions_of_humanml3d,
};
pub use kimodo::{KIMODO_NUMBERS, KimodoError, kimodo};
pub use mirror::{mirror_pairs, mirrored_point, mirrored_rotation, without_partner};
pub use mirrored::{Mirror, MirrorError, MirrorReport, mirrored};
pub use root_motion::{HeadingSource, RootMotion};
pub use sets::{
    FeatureArray, FeatureError, FeatureRequest, FeatureSet, WorldFrames, feature_arrays,
    write_features,
};
pub use six::{SixOrder, rotation_of_six, six};

use glam::{DQuat, DVec3};

/// The smallest rotation from one direction to another; about any axis across if they are opposite.
pub(crate) fn rotation_between(from: DVec3, to: DVec3) -> DQuat {
    let w = libm::sqrt(from.length_squared() * to.length_squared()) + from.dot(to);
    let axis = from.cross(to);
    let rotation = DQuat::from_xyzw(axis.x, axis.y, axis.z, w);
    // The square of 1e-8 of the product of the lengths: less is rounding.
    if rotation.length_squared() > 1e-16 * from.length_squared() * to.length_squared() {
        return rotation.normalize();
    }
    let across = from.any_orthogonal_vector().normalize();
    DQuat::from_xyzw(across.x, across.y, across.z, 0.0)
}
