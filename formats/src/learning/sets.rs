//! Features of sampled poses as named arrays, which become an NPZ file.

use std::io::{self, Write};

use glam::{DQuat, DVec3};
use tumble::{FrameRate, names};

use crate::array::Element;
use crate::learning::contacts::{ContactLimits, contacts, majority};
use crate::learning::heading::{Ground, twist_heading};
use crate::learning::humanml3d::{HUMANML3D_JOINTS, HUMANML3D_NUMBERS, Humanml3dError, humanml3d};
use crate::learning::kimodo::{KIMODO_NUMBERS, KimodoError, kimodo};
use crate::learning::mirror::{mirror_pairs, mirrored_point, mirrored_rotation};
use crate::learning::six::{SixOrder, six};
use crate::npz::write::ArchiveWriter;

/// A set of features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeatureSet {
    /// `positions` (frames, joints, 3) and `velocities`, in the world.
    Positions,
    /// `six_columns` (frames, joints, 6) of the rotations in the world.
    SixColumns,
    /// `six_rows`.
    SixRows,
    /// `six_interleaved`.
    SixInterleaved,
    /// `heading` (frames) of the first joint in rad: its twist about the axis that points up.
    Heading,
    /// `contacts` (frames, joints), 0 or 1.
    Contacts,
    /// `mirrored_positions` and `mirrored_rotations` (x y z w), left and right exchanged, and `mirror_pairs`.
    Mirror,
    /// `humanml3d` (frames - 1, 263).
    Humanml3d,
    /// `kimodo` (frames, 273).
    Kimodo,
}

names! {
    FeatureSet, "set of features",
    Positions => "positions",
    SixColumns => "six-columns",
    SixRows => "six-rows",
    SixInterleaved => "six-interleaved",
    Heading => "heading",
    Contacts => "contacts",
    Mirror => "mirror",
    Humanml3d => "humanml3d",
    Kimodo => "kimodo",
}

/// Poses in the world, `[frame][joint]`.
#[derive(Debug, Clone, Default)]
pub struct WorldFrames {
    /// The name of each joint.
    pub names: Vec<String>,
    /// The time of each frame in seconds.
    pub times: Vec<f64>,
    /// Metres.
    pub positions: Vec<DVec3>,
    /// Unit quaternions.
    pub rotations: Vec<DQuat>,
    /// Metres a second.
    pub velocities: Vec<DVec3>,
}

/// How features are computed.
#[derive(Debug, Clone)]
pub struct FeatureRequest {
    /// The sets.
    pub sets: Vec<FeatureSet>,
    /// The axis that points up.
    pub ground: Ground,
    /// When a joint touches the ground.
    pub limits: ContactLimits,
    /// Over how many frames contacts are those of most frames; 1 for each by itself.
    pub window: usize,
    /// The axis across the mirror: 0 for x, 1 for y, 2 for z.
    pub mirror_axis: usize,
    /// The joints of HumanML3D, in its order, which are Kimodo's too; or why they are not known, as the end of a sentence.
    pub humanml3d_joints: Result<[usize; HUMANML3D_JOINTS], String>,
    /// How many frames there are in a second.
    pub rate: FrameRate,
}

impl FeatureRequest {
    /// The joints of SMPL that a set needs.
    fn joints_of(&self, set: FeatureSet) -> Result<[usize; HUMANML3D_JOINTS], FeatureError> {
        let set = set.name();
        if self.ground != Ground::Y {
            return Err(FeatureError::UpAxis { set });
        }
        let no_joints = |reason: &String| FeatureError::NoJoints {
            set,
            reason: reason.clone(),
        };
        self.humanml3d_joints.as_ref().copied().map_err(no_joints)
    }
}

/// An array of features.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureArray {
    /// Its name in the file.
    pub name: &'static str,
    /// Its shape.
    pub shape: Vec<usize>,
    /// Its numbers, which are stored as f32; contacts and indices as integers.
    pub values: Vec<f64>,
    /// Whether its numbers are whole.
    pub is_whole: bool,
}

/// Why features cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FeatureError {
    /// A set needs joints that the skeleton does not have.
    #[error("{set} needs the 22 joints of SMPL: {reason}")]
    NoJoints {
        /// The name of the set.
        set: &'static str,
        /// Why they are not known, as the end of a sentence.
        reason: String,
    },
    /// HumanML3D and Kimodo have bodies that stand along y.
    #[error("{set} needs y up, and z points up (--up-axis y)")]
    UpAxis {
        /// The name of the set.
        set: &'static str,
    },
    /// Poses without features.
    #[error(transparent)]
    Humanml3d(#[from] Humanml3dError),
    /// Too few frames.
    #[error(transparent)]
    Kimodo(#[from] KimodoError),
}

/// The arrays of some sets, in their order.
///
/// # Errors
/// A [`FeatureError`].
pub fn feature_arrays(
    poses: &WorldFrames,
    request: &FeatureRequest,
) -> Result<Vec<FeatureArray>, FeatureError> {
    let (frames, joints) = (poses.times.len(), poses.names.len());
    let array = |name, inner: &[usize], values: Vec<f64>| FeatureArray {
        name,
        shape: [&[frames], inner].concat(),
        values,
        is_whole: false,
    };
    let whole = |array: FeatureArray| FeatureArray {
        is_whole: true,
        ..array
    };
    let points = |list: &[DVec3]| list.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
    let mut all = Vec::new();
    for set in &request.sets {
        match set {
            FeatureSet::Positions => {
                all.push(array("positions", &[joints, 3], points(&poses.positions)));
                all.push(array("velocities", &[joints, 3], points(&poses.velocities)));
            }
            FeatureSet::SixColumns | FeatureSet::SixRows | FeatureSet::SixInterleaved => {
                let (name, order) = match set {
                    FeatureSet::SixColumns => ("six_columns", SixOrder::Columns),
                    FeatureSet::SixRows => ("six_rows", SixOrder::Rows),
                    _ => ("six_interleaved", SixOrder::Interleaved),
                };
                let numbers = poses
                    .rotations
                    .iter()
                    .flat_map(|&rotation| six(rotation, order));
                all.push(array(name, &[joints, 6], numbers.collect()));
            }
            FeatureSet::Heading => {
                let roots = poses.rotations.iter().step_by(joints.max(1));
                let headings = roots.map(|&rotation| twist_heading(rotation, request.ground));
                all.push(array("heading", &[], headings.collect()));
            }
            FeatureSet::Contacts => {
                let ground = request.ground;
                let found = contacts(&poses.positions, &poses.velocities, ground, request.limits);
                let mut values = vec![0.0; found.len()];
                for joint in 0..joints {
                    let of_joint: Vec<bool> =
                        found.iter().skip(joint).step_by(joints).copied().collect();
                    let filtered = majority(&of_joint, request.window);
                    let positions = values.iter_mut().skip(joint).step_by(joints);
                    positions
                        .zip(filtered)
                        .for_each(|(value, touches)| *value = f64::from(u8::from(touches)));
                }
                all.push(whole(array("contacts", &[joints], values)));
            }
            FeatureSet::Mirror => {
                let (pairs, axis) = (mirror_pairs(&poses.names), request.mirror_axis);
                let partners = (0..frames)
                    .flat_map(|frame| pairs.iter().map(move |&pair| frame * joints + pair));
                let partners: Vec<usize> = partners.collect();
                let moved = partners
                    .iter()
                    .map(|&at| mirrored_point(poses.positions[at], axis));
                all.push(array(
                    "mirrored_positions",
                    &[joints, 3],
                    points(&moved.collect::<Vec<_>>()),
                ));
                let rotated = partners
                    .iter()
                    .map(|&at| mirrored_rotation(poses.rotations[at], axis));
                let rotated = rotated.flat_map(|rotation| rotation.to_array());
                all.push(array("mirrored_rotations", &[joints, 4], rotated.collect()));
                let pairs = pairs.into_iter().map(|pair| pair as f64).collect();
                all.push(whole(FeatureArray {
                    shape: vec![joints],
                    ..array("mirror_pairs", &[], pairs)
                }));
            }
            FeatureSet::Kimodo => {
                let order = request.joints_of(*set)?;
                let at = |frame: usize| order.map(|joint| frame * joints + joint);
                let positions = (0..frames).map(|frame| at(frame).map(|at| poses.positions[at]));
                let rotations = (0..frames).map(|frame| at(frame).map(|at| poses.rotations[at]));
                let positions: Vec<_> = positions.collect();
                let rotations: Vec<_> = rotations.collect();
                let rows = kimodo(&positions, &rotations, request.rate.per_second())?;
                all.push(array("kimodo", &[KIMODO_NUMBERS], rows.concat()));
            }
            FeatureSet::Humanml3d => {
                let order = request.joints_of(*set)?;
                let of_frame =
                    |frame: usize| order.map(|joint| poses.positions[frame * joints + joint]);
                let positions: Vec<_> = (0..frames).map(of_frame).collect();
                let rows = humanml3d(&positions, THRESHOLD)?;
                all.push(FeatureArray {
                    shape: vec![rows.len(), HUMANML3D_NUMBERS],
                    ..array("humanml3d", &[], rows.concat())
                });
            }
        }
    }
    Ok(all)
}

/// The square of how far a joint of a foot on the ground moves in a frame, as in the data set.
const THRESHOLD: f64 = 0.002;

/// Writes arrays as an NPZ file, with the times of the frames and the names of the joints.
///
/// # Errors
/// When writing fails.
pub fn write_features(
    poses: &WorldFrames,
    arrays: &[FeatureArray],
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut archive = ArchiveWriter::new();
    for array in arrays {
        let element = match array.is_whole {
            true => Element::Signed(8),
            false => Element::F32,
        };
        let path = format!("{}.npy", array.name);
        archive.numbers(&path, (&element, &array.shape), false, |put| {
            array.values.iter().try_for_each(|&number| put(number))
        })?;
    }
    let times = &poses.times;
    archive.numbers("times.npy", (&Element::F64, &[times.len()]), false, |put| {
        times.iter().try_for_each(|&time| put(time))
    })?;
    let names: Vec<&str> = poses.names.iter().map(String::as_str).collect();
    archive.texts("joint_names.npy", &names, &[names.len()])?;
    archive.finish(out)
}
