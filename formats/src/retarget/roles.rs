//! Parts of a human body, and how skeletons call them.

use glam::DVec3;
use tumble::names;

/// A part of a human body: the bones of VRM 1.0 without fingers, eyes and jaw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Role {
    Hips,
    Spine,
    Chest,
    UpperChest,
    Neck,
    Head,
    LeftShoulder,
    LeftUpperArm,
    LeftLowerArm,
    LeftHand,
    RightShoulder,
    RightUpperArm,
    RightLowerArm,
    RightHand,
    LeftUpperLeg,
    LeftLowerLeg,
    LeftFoot,
    LeftToes,
    RightUpperLeg,
    RightLowerLeg,
    RightFoot,
    RightToes,
}

names! {
    Role, "part of a body",
    Hips => "hips",
    Spine => "spine",
    Chest => "chest",
    UpperChest => "upperChest",
    Neck => "neck",
    Head => "head",
    LeftShoulder => "leftShoulder",
    LeftUpperArm => "leftUpperArm",
    LeftLowerArm => "leftLowerArm",
    LeftHand => "leftHand",
    RightShoulder => "rightShoulder",
    RightUpperArm => "rightUpperArm",
    RightLowerArm => "rightLowerArm",
    RightHand => "rightHand",
    LeftUpperLeg => "leftUpperLeg",
    LeftLowerLeg => "leftLowerLeg",
    LeftFoot => "leftFoot",
    LeftToes => "leftToes",
    RightUpperLeg => "rightUpperLeg",
    RightLowerLeg => "rightLowerLeg",
    RightFoot => "rightFoot",
    RightToes => "rightToes",
}

impl Role {
    /// Whether every human skeleton has this part.
    #[must_use]
    pub fn is_required(self) -> bool {
        !matches!(
            self,
            Self::Chest
                | Self::UpperChest
                | Self::Neck
                | Self::LeftShoulder
                | Self::RightShoulder
                | Self::LeftToes
                | Self::RightToes
        )
    }

    /// The role of the next part towards the hips. In a skeleton, parts that are not required may be missing.
    fn above(self) -> Option<Self> {
        Some(match self {
            Self::Hips => return None,
            Self::Spine | Self::LeftUpperLeg | Self::RightUpperLeg => Self::Hips,
            Self::Chest => Self::Spine,
            Self::UpperChest => Self::Chest,
            Self::Neck | Self::LeftShoulder | Self::RightShoulder => Self::UpperChest,
            Self::Head => Self::Neck,
            Self::LeftUpperArm => Self::LeftShoulder,
            Self::LeftLowerArm => Self::LeftUpperArm,
            Self::LeftHand => Self::LeftLowerArm,
            Self::RightUpperArm => Self::RightShoulder,
            Self::RightLowerArm => Self::RightUpperArm,
            Self::RightHand => Self::RightLowerArm,
            Self::LeftLowerLeg => Self::LeftUpperLeg,
            Self::LeftFoot => Self::LeftLowerLeg,
            Self::LeftToes => Self::LeftFoot,
            Self::RightLowerLeg => Self::RightUpperLeg,
            Self::RightFoot => Self::RightLowerLeg,
            Self::RightToes => Self::RightFoot,
        })
    }

    /// For a part of a limb that has a direction, the part at its other end.
    pub(super) fn limb_end(self) -> Option<Self> {
        Some(match self {
            Self::LeftUpperArm => Self::LeftLowerArm,
            Self::LeftLowerArm => Self::LeftHand,
            Self::RightUpperArm => Self::RightLowerArm,
            Self::RightLowerArm => Self::RightHand,
            Self::LeftUpperLeg => Self::LeftLowerLeg,
            Self::LeftLowerLeg => Self::LeftFoot,
            Self::RightUpperLeg => Self::RightLowerLeg,
            Self::RightLowerLeg => Self::RightFoot,
            _ => return None,
        })
    }
}

/// How one kind of skeleton calls the roles, in the order of [`Role::ALL`].
struct Scheme {
    name: &'static str,
    names: [&'static str; 22],
}

/// `LeftLeg` is the calf of Mixamo and the thigh of SOMA; `left_foot` of SMPL is the toes, and `left_shoulder` the upper arm.
#[rustfmt::skip]
const SCHEMES: [Scheme; 8] = [
    Scheme { name: "VRM", names: [
        "hips", "spine", "chest", "upperChest", "neck", "head",
        "leftShoulder", "leftUpperArm", "leftLowerArm", "leftHand",
        "rightShoulder", "rightUpperArm", "rightLowerArm", "rightHand",
        "leftUpperLeg", "leftLowerLeg", "leftFoot", "leftToes",
        "rightUpperLeg", "rightLowerLeg", "rightFoot", "rightToes"] },
    Scheme { name: "Mixamo", names: [
        "Hips", "Spine", "Spine1", "Spine2", "Neck", "Head",
        "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand",
        "RightShoulder", "RightArm", "RightForeArm", "RightHand",
        "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase",
        "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase"] },
    Scheme { name: "SMPL", names: [
        "pelvis", "spine1", "spine2", "spine3", "neck", "head",
        "left_collar", "left_shoulder", "left_elbow", "left_wrist",
        "right_collar", "right_shoulder", "right_elbow", "right_wrist",
        "left_hip", "left_knee", "left_ankle", "left_foot",
        "right_hip", "right_knee", "right_ankle", "right_foot"] },
    Scheme { name: "LAFAN1", names: [
        "Hips", "Spine", "Spine1", "Spine2", "Neck", "Head",
        "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand",
        "RightShoulder", "RightArm", "RightForeArm", "RightHand",
        "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToe",
        "RightUpLeg", "RightLeg", "RightFoot", "RightToe"] },
    Scheme { name: "CMU", names: [
        "Hips", "LowerBack", "Spine", "Spine1", "Neck", "Head",
        "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand",
        "RightShoulder", "RightArm", "RightForeArm", "RightHand",
        "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase",
        "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase"] },
    Scheme { name: "Xsens", names: [
        "Hips", "Chest", "Chest2", "Chest4", "Neck", "Head",
        "LeftCollar", "LeftShoulder", "LeftElbow", "LeftWrist",
        "RightCollar", "RightShoulder", "RightElbow", "RightWrist",
        "LeftHip", "LeftKnee", "LeftAnkle", "LeftToe",
        "RightHip", "RightKnee", "RightAnkle", "RightToe"] },
    Scheme { name: "Unreal", names: [
        "pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head",
        "clavicle_l", "upperarm_l", "lowerarm_l", "hand_l",
        "clavicle_r", "upperarm_r", "lowerarm_r", "hand_r",
        "thigh_l", "calf_l", "foot_l", "ball_l",
        "thigh_r", "calf_r", "foot_r", "ball_r"] },
    Scheme { name: "SOMA", names: [
        "Hips", "Spine1", "Spine2", "Chest", "Neck1", "Head",
        "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand",
        "RightShoulder", "RightArm", "RightForeArm", "RightHand",
        "LeftLeg", "LeftShin", "LeftFoot", "LeftToeBase",
        "RightLeg", "RightShin", "RightFoot", "RightToeBase"] },
];

/// The joints that have roles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Roles {
    /// The kind of skeleton, such as `Mixamo`.
    pub kind: &'static str,
    /// The joint of each role of [`Role::ALL`].
    pub joints: [Option<usize>; 22],
}

impl Roles {
    /// The joint of a role.
    #[must_use]
    pub fn joint(&self, role: Role) -> Option<usize> {
        self.joints[role as usize]
    }
}

/// The roles of a skeleton's joints by their names and parents. Prefixes such as `mixamorig:` are passed over.
///
/// # Errors
/// The names of the roles that the most similar kind of skeleton lacks; empty where two kinds are as similar, and
/// differ.
pub fn recognise(
    joint_names: &[String],
    parents: &[Option<usize>],
) -> Result<Roles, Vec<&'static str>> {
    let found: Vec<Roles> = SCHEMES
        .iter()
        .map(|scheme| found(scheme, joint_names, parents))
        .collect();
    let count = |roles: &Roles| roles.joints.iter().flatten().count();
    let missing = |roles: &Roles| -> Vec<&'static str> {
        let all = Role::ALL.iter().filter(|role| role.is_required());
        all.filter(|&&role| roles.joint(role).is_none())
            .map(|role| role.name())
            .collect()
    };
    let fewest_missing = found
        .iter()
        .map(missing)
        .min_by_key(Vec::len)
        .unwrap_or_default();
    if !fewest_missing.is_empty() {
        return Err(fewest_missing);
    }
    let complete = || found.iter().filter(|roles| missing(roles).is_empty());
    let largest = complete().map(count).max().unwrap_or(0);
    let best: Vec<&Roles> = complete().filter(|roles| count(roles) == largest).collect();
    match &best[..] {
        [first, others @ ..] if others.iter().all(|other| other.joints == first.joints) => {
            Ok((*first).clone())
        }
        _ => Err(Vec::new()),
    }
}

/// Why a skeleton is not recognised, for a message: the parts that [`recognise`] found missing.
#[must_use]
pub fn missing_text(missing: &[&str]) -> String {
    match missing {
        [] => "two kinds of skeletons fit as well".to_owned(),
        parts => format!("no joint has a known name for {}", parts.join(", ")),
    }
}

/// The axis along which a body stands: that of the direction from the feet to the head, on average over the positions
/// of all joints in some poses. `None` if no axis is clear, for example if the body crawls on all fours along a
/// diagonal, or lies.
#[must_use]
pub fn standing_axis<P: AsRef<[DVec3]>>(
    roles: &Roles,
    poses: impl IntoIterator<Item = P>,
) -> Option<DVec3> {
    let [head, left, right] =
        [Role::Head, Role::LeftFoot, Role::RightFoot].map(|role| roles.joint(role));
    let (head, left, right) = (head?, left?, right?);
    let height = |pose: P| {
        let pose = pose.as_ref();
        pose[head] - (pose[left] + pose[right]) / 2.0
    };
    let sum: DVec3 = poses.into_iter().map(height).sum();
    let along = |axis: &DVec3| sum.dot(*axis).abs();
    let (mut axes, by_length) = (DVec3::AXES, |a: &DVec3, b: &DVec3| {
        along(b).total_cmp(&along(a))
    });
    axes.sort_by(by_length);
    let [axis, second, _] = axes;
    // The components along the other two axes come from leaning. If one of them is large, the upward axis is not clear.
    let is_clear = along(&axis) > 2.0 * along(&second);
    is_clear.then(|| axis * sum.dot(axis).signum())
}

fn found(scheme: &Scheme, joint_names: &[String], parents: &[Option<usize>]) -> Roles {
    let named = |name: &str| {
        joint_names
            .iter()
            .position(|joint| without_prefix(joint) == name)
    };
    let mut joints = scheme.names.map(named);
    // A joint is in the right place if the nearest joint above it that has a role has the expected one: the next higher
    // role that the skeleton has.
    let is_placed = |role: Role| {
        let Some(joint) = joints[role as usize] else {
            return false;
        };
        let mut above = role.above();
        while let Some(next) = above.filter(|&next| joints[next as usize].is_none()) {
            above = next.above();
        }
        let mut parent = parents.get(joint).copied().flatten();
        let mut steps = parents.len();
        while let Some(next) = parent.filter(|next| steps > 0 && !joints.contains(&Some(*next))) {
            steps -= 1;
            parent = parents.get(next).copied().flatten();
        }
        parent == above.and_then(|above| joints[above as usize])
    };
    let placed = Role::ALL.map(is_placed);
    for (joint, is_placed) in joints.iter_mut().zip(placed) {
        *joint = joint.filter(|_| is_placed);
    }
    Roles {
        kind: scheme.name,
        joints,
    }
}

/// `mixamorig:Hips`, `mixamorig7:Hips` and `mixamorigHips` are `Hips`.
fn without_prefix(name: &str) -> &str {
    let name = name.rsplit_once(':').map_or(name, |(_, name)| name);
    match name.strip_prefix("mixamorig") {
        Some(rest) => rest.trim_start_matches(|c: char| c.is_ascii_digit()),
        None => name,
    }
}
