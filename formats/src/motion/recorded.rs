//! The robot as a file of its motion describes it, in addition to the keys of its root and its joints.

use glam::DVec3;

use crate::quaternion::ComponentOrder;

/// A robot as a file of its motion has it. The root is the first track of the clip, and the joints are its scalars.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRobot {
    /// The dialect of the file.
    pub dialect: &'static str,
    /// Whether the file names the joints. Otherwise the scalars are numbered.
    pub names_joints: bool,
    /// The poses of all bodies at some of the keys, with which the order of bodies and joints is checked.
    pub bodies: Option<RecordedBodies>,
}

/// The bodies of a robot at some keys.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedBodies {
    /// The name of the array with their positions.
    pub positions: String,
    /// The name of the array with their rotations.
    pub rotations: String,
    /// The order of the components of these, as the dialect has it.
    pub order: ComponentOrder,
    /// The name of each body, or empty.
    pub names: Vec<String>,
    /// How many bodies there are.
    pub count: usize,
    /// The bodies at some keys.
    pub samples: Vec<RecordedSample>,
}

/// The bodies of a robot at a key.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedSample {
    /// The number of the key in the clip.
    pub key: usize,
    /// The position of each body in the world.
    pub positions: Vec<DVec3>,
    /// The components of the first body's rotation, as stored.
    pub root: [f64; 4],
}
