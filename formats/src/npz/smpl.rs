//! Motion of SMPL bodies in the layout of AMASS: rotation vectors of all joints in rows, one for each frame.

use tumble::Layout;

use crate::diagnostic::{Code, Diagnostic};
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind};
use crate::warnings::Warnings;

/// Joints of all SMPL bodies, with their parents.
#[rustfmt::skip]
const BODY: [(&str, usize); 22] = [
    ("pelvis", usize::MAX), ("left_hip", 0), ("right_hip", 0), ("spine1", 0), ("left_knee", 1),
    ("right_knee", 2), ("spine2", 3), ("left_ankle", 4), ("right_ankle", 5), ("spine3", 6),
    ("left_foot", 7), ("right_foot", 8), ("neck", 9), ("left_collar", 9), ("right_collar", 9),
    ("head", 12), ("left_shoulder", 13), ("right_shoulder", 14), ("left_elbow", 16),
    ("right_elbow", 17), ("left_wrist", 18), ("right_wrist", 19),
];
const HEAD: usize = 15;
const WRISTS: [(&str, usize); 2] = [("left", 20), ("right", 21)];
const FINGERS: [&str; 5] = ["index", "middle", "pinky", "ring", "thumb"];

/// The arrays of a pose in parts, by their names in AMASS, in the order of `poses`: pelvis, body, jaw, eyes, hands.
const PIECES: [(&str, usize); 5] = [
    ("root_orient", 1),
    ("pose_body", 21),
    ("pose_jaw", 1),
    ("pose_eye", 2),
    ("pose_hand", 30),
];

/// The same arrays by their names in the models. SMPL has two more joints in the body, the hands.
const MODEL_PIECES: [(&str, usize); 7] = [
    ("global_orient", 1),
    ("body_pose", 21),
    ("jaw_pose", 1),
    ("leye_pose", 1),
    ("reye_pose", 1),
    ("left_hand_pose", 15),
    ("right_hand_pose", 15),
];

/// Number of joints of the SMPL body without the pelvis.
const SMPL_BODY: usize = 23;

/// The arrays with the translation of the root: in AMASS, and in the models.
const ROOTS: [&str; 2] = ["trans", "transl"];

/// The arrays with the rate.
const RATES: [&str; 4] = ["mocap_framerate", "mocap_frame_rate", "framerate", "fps"];

/// The array with the duration in seconds, in files of AMASS.
const LENGTH: &str = "mocap_time_length";

/// Arrays that files of AMASS and SMPL-X usually have besides the motion: the shape of the body, the motion of soft
/// tissue, and the markers that the motion was computed from.
const BESIDE: [&str; 20] = [
    "betas",
    "dmpls",
    "expression",
    "gender",
    "id",
    "labels",
    "labels_obs",
    "latent_labels",
    "marker_data",
    "marker_labels",
    "markers",
    "markers_latent",
    "markers_latent_vids",
    "markers_obs",
    "markers_sim",
    "model",
    "num_betas",
    "smpl_scaling",
    "surface_model_type",
    "v_template_fname",
];

/// Names and parents of joints.
struct Skeleton {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
}

impl Skeleton {
    fn push(&mut self, name: String, parent: usize) {
        self.names.push(name);
        self.parents.push((parent != usize::MAX).then_some(parent));
    }

    fn body() -> Self {
        let (names, parents) = (Vec::new(), Vec::new());
        let mut body = Self { names, parents };
        BODY.into_iter()
            .for_each(|(name, parent)| body.push(name.to_owned(), parent));
        body
    }

    /// Adds jaw and eyes.
    fn face(&mut self, jaw: bool, eyes: bool) {
        if jaw {
            self.push("jaw".to_owned(), HEAD);
        }
        if eyes {
            self.push("left_eye_smplhf".to_owned(), HEAD);
            self.push("right_eye_smplhf".to_owned(), HEAD);
        }
    }

    /// Adds the fingers of both hands, three joints each.
    fn fingers(&mut self) {
        for (side, wrist) in WRISTS {
            for finger in FINGERS {
                for joint in 1..=3 {
                    let last = self.names.len() - 1;
                    let parent = if joint == 1 { wrist } else { last };
                    self.push(format!("{side}_{finger}{joint}"), parent);
                }
            }
        }
    }

    /// The skeleton with this number of joints: SMPL has 24, SMPL-H 52, SMPL-X 55; all share 22.
    fn of(joints: usize) -> Option<Self> {
        let mut skeleton = Self::body();
        match joints {
            22 => {}
            24 => {
                for (side, wrist) in WRISTS {
                    skeleton.push(format!("{side}_hand"), wrist);
                }
            }
            52 => skeleton.fingers(),
            55 => {
                skeleton.face(true, true);
                skeleton.fingers();
            }
            _ => return None,
        }
        Some(skeleton)
    }
}

/// The names and parents of the joints of the body with this number of joints.
pub(crate) fn joints_of_body(joints: usize) -> Option<(Vec<String>, Vec<Option<usize>>)> {
    Skeleton::of(joints).map(|skeleton| (skeleton.names, skeleton.parents))
}

/// The reason why the positions of a body's joints are not known.
pub(crate) const NO_OFFSETS: &str = "the positions of a body's joints depend on its shape; give its model with \
                                     --body-model, or the \
                                     offsets of its joints with --offsets";

/// Whether the archive has the shape of a body and nothing that may be a motion, which has at least two axes. Such
/// files of AMASS have the shapes of its subjects.
pub(crate) fn is_body_alone(archive: &Archive) -> bool {
    let is_small = |name: &str| archive.shape(name).is_some_and(|shape| shape.len() < 2);
    let mut members = archive.members.iter().map(|member| &*member.name);
    archive.find("betas").is_some() && members.all(|name| BESIDE.contains(&name) || is_small(name))
}

/// The plan of a file with `poses`, or with `root_orient`, `pose_body` and perhaps others, which the models call
/// `global_orient` and `body_pose`. `None` for other files.
pub(crate) fn plan(
    archive: &Archive,
    warnings: &mut Warnings,
) -> Result<Option<ArchivePlan>, Diagnostic> {
    let vectors = |name: &str, first| {
        KeyArray::of(
            archive,
            name,
            KeyKind::RotationVector,
            first,
            Layout::FrameMajor,
        )
    };
    let mut plan = ArchivePlan::default();
    let skeleton = if let Some(poses) = vectors("poses", 0)? {
        plan.add(archive, poses)?;
        let skeleton = Skeleton::of(plan.tracks);
        if skeleton.is_none() {
            let tracks = plan.tracks;
            warnings.warn(Code::UnknownBody, || {
                let message = format!(
                    "bodies of {tracks} joints are not known (22, 24, 52 and 55 are), so the joints have no names"
                );
                (None, message)
            });
        }
        skeleton
    } else if let Some(pieces) = pieces_of(archive) {
        let mut skeleton = Skeleton::body();
        let mut is_smpl = false;
        for &(name, joints) in pieces {
            let Some(piece) = vectors(name, plan.tracks)? else {
                continue;
            };
            let found = piece.0.tracks.len();
            is_smpl |= name == "body_pose" && found == SMPL_BODY;
            if found != joints && !(name == "body_pose" && is_smpl) {
                let message = format!(
                    "the array has {} numbers per frame where {} are rotation vectors; components of \
                     a hand model cannot be read",
                    3 * found,
                    3 * joints
                );
                return Err(archive.refuse(piece.0.member, Code::Shape, message));
            }
            plan.add(archive, piece)?;
        }
        let has = |name: &str| archive.find(name).is_some();
        let sides = [
            ("leye_pose", "reye_pose"),
            ("left_hand_pose", "right_hand_pose"),
        ];
        for (left, right) in sides {
            if has(left) != has(right) {
                let missing = if has(left) { right } else { left };
                let message = format!("`{missing}` is missing; the other side is there");
                return Err(Diagnostic::new(&archive.file, Code::UnknownArrays, message));
            }
        }
        let is_piece = |name: &str| pieces.iter().any(|piece| piece.0 == name);
        let has = |names: [&str; 2]| names.iter().any(|name| is_piece(name) && has(name));
        let has_more = has(["pose_jaw", "jaw_pose"]) || has(["pose_eye", "leye_pose"]);
        if is_smpl && !has_more && !has(["pose_hand", "left_hand_pose"]) {
            Skeleton::of(SMPL_BODY + 1)
        } else if is_smpl {
            let message = "`body_pose` has the 23 joints of SMPL, which has no fingers and no face; the arrays of \
                           fingers and face belong to another model";
            return Err(Diagnostic::new(&archive.file, Code::UnknownArrays, message));
        } else {
            skeleton.face(
                has(["pose_jaw", "jaw_pose"]),
                has(["pose_eye", "leye_pose"]),
            );
            if has(["pose_hand", "left_hand_pose"]) {
                skeleton.fingers();
            }
            Some(skeleton)
        }
    } else {
        return Ok(None);
    };
    if let Some(skeleton) = skeleton {
        (plan.names, plan.parents) = (skeleton.names, skeleton.parents);
        plan.is_body = true;
        plan.companions = &BESIDE;
        plan.no_world = Some(NO_OFFSETS.to_owned());
    }
    let root = ROOTS.into_iter().find(|name| archive.find(name).is_some());
    if let Some(root) = root
        && let Some(root) =
            KeyArray::of(archive, root, KeyKind::Translation, 0, Layout::FrameMajor)?
    {
        plan.add(archive, root)?;
    }
    if archive.find("poses").is_some() {
        let again = PIECES.iter().filter_map(|(name, _)| archive.find(name));
        plan.compared.extend(again);
    }
    plan.read_rate(archive, &RATES)?;
    plan.compare_length(archive, LENGTH);
    Ok(Some(plan))
}

/// The names by which a file contains its pose in parts, if it does.
fn pieces_of(archive: &Archive) -> Option<&'static [(&'static str, usize)]> {
    let all: [&'static [_]; 2] = [&PIECES, &MODEL_PIECES];
    let has = |pieces: &&'static [(&str, usize)]| {
        pieces[..2]
            .iter()
            .all(|(name, _)| archive.find(name).is_some())
    };
    all.into_iter().find(has)
}

/// The arrays that repeat parts of `poses`, each with the index of its first joint there.
pub(crate) fn repeated_pieces(joints: usize) -> impl Iterator<Item = (&'static str, usize)> {
    let has_face = joints == 55;
    let of_body = move |&(name, _): &(&str, usize)| match name {
        "pose_jaw" | "pose_eye" => has_face,
        "pose_hand" => joints >= 52,
        _ => joints >= 22,
    };
    let mut first = 0;
    PIECES
        .into_iter()
        .filter(of_body)
        .map(move |(name, joints)| {
            first += joints;
            (name, first - joints)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_and_faces_hang_where_the_models_have_them() {
        for (joints, name, at, parent) in [
            (24, "right_hand", 23, Some(21)),
            (52, "left_index1", 22, Some(20)),
            (52, "right_index1", 37, Some(21)),
            (52, "right_thumb3", 51, Some(50)),
            (55, "jaw", 22, Some(15)),
            (55, "right_eye_smplhf", 24, Some(15)),
            (55, "left_index1", 25, Some(20)),
            (55, "right_pinky1", 46, Some(21)),
            (22, "pelvis", 0, None),
        ] {
            let skeleton = Skeleton::of(joints).unwrap();
            assert_eq!(
                (skeleton.names.len(), skeleton.parents.len()),
                (joints, joints)
            );
            assert_eq!(skeleton.names[at], name);
            assert_eq!(skeleton.parents[at], parent, "{name}");
        }
        assert!(Skeleton::of(23).is_none());
        let pieces: Vec<_> = repeated_pieces(55).collect();
        assert_eq!(
            pieces[1..4],
            [("pose_body", 1), ("pose_jaw", 22), ("pose_eye", 23)]
        );
        assert_eq!(repeated_pieces(52).last(), Some(("pose_hand", 22)));
    }
}
