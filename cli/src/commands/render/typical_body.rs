//! Offsets of a typical body, so that the motion of an SMPL body can be drawn although its file does not contain
//! where the joints are.

use tumble_formats::adjust::{OffsetsError, set_offsets};
use tumble_formats::motion::Motion;

/// Metres from the parent, with y up and z forward, of an adult of about 1.7 m. Those of the right side are mirrored.
#[rustfmt::skip]
const OFFSETS: [(&str, [f64; 3]); 16] = [
    ("hip", [0.07, -0.09, 0.0]), ("spine1", [0.0, 0.11, -0.03]), ("knee", [0.03, -0.38, 0.0]),
    ("spine2", [0.0, 0.13, 0.0]), ("ankle", [-0.01, -0.4, -0.04]), ("spine3", [0.0, 0.06, 0.02]),
    ("foot", [0.02, -0.06, 0.12]), ("neck", [0.0, 0.21, -0.04]), ("collar", [0.08, 0.12, -0.03]),
    ("head", [0.0, 0.08, 0.05]), ("shoulder", [0.09, 0.03, -0.01]), ("elbow", [0.26, -0.01, -0.03]),
    ("wrist", [0.25, 0.01, 0.0]), ("hand", [0.08, 0.0, 0.0]), ("jaw", [0.0, 0.0, 0.02]),
    ("eye_smplhf", [0.03, 0.07, 0.07]),
];

/// How far the fingers are apart at the hand, along z.
const FINGERS: [(&str, f64); 5] = [
    ("thumb", 0.04),
    ("index", 0.03),
    ("middle", 0.01),
    ("ring", -0.01),
    ("pinky", -0.03),
];

/// Places the joints of a body.
///
/// # Errors
/// When the clip states offsets.
pub(super) fn set_typical_offsets(clip: &mut Motion) -> Result<(), OffsetsError> {
    let pelvis = clip.body.as_ref().map(|body| body.pelvis.as_dvec3());
    let set = &clip.set;
    let offsets = (0..set.track_count()).map(|track| match pelvis {
        Some(pelvis) if track == 0 => pelvis.to_array(),
        _ => offset(&set.track_name(track)),
    });
    let numbers: Vec<f64> = offsets.flatten().collect();
    set_offsets(clip, &numbers)
}

/// Where a joint is relative to its parent; 0 if it has none of the names.
fn offset(name: &str) -> [f64; 3] {
    let (side, part) = match name.split_once('_') {
        Some(("left", part)) => (1.0, part),
        Some(("right", part)) => (-1.0, part),
        _ => (1.0, name),
    };
    let known = OFFSETS.iter().find(|(known, _)| *known == part);
    let finger = || {
        let (finger, aside) = FINGERS
            .iter()
            .find(|(finger, _)| part.starts_with(finger))?;
        let is_first = part[finger.len()..] == *"1";
        Some(if is_first {
            [0.08, 0.0, *aside]
        } else {
            [0.03, 0.0, 0.0]
        })
    };
    let offset = known.map(|(_, offset)| *offset).or_else(finger);
    let [x, y, z] = offset.unwrap_or_default();
    [side * x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_mirrored_and_fingers_spread() {
        assert_eq!(offset("left_knee"), [0.03, -0.38, 0.0]);
        assert_eq!(offset("right_knee"), [-0.03, -0.38, 0.0]);
        assert_eq!(offset("right_index1"), [-0.08, 0.0, 0.03]);
        assert_eq!(offset("left_pinky3"), [0.03, 0.0, 0.0]);
        assert_eq!(offset("spine2"), [0.0, 0.13, 0.0]);
        assert_eq!(offset("tail"), [0.0; 3]);
    }
}
