//! The parents of joints beside the rows of a table: JSON in the metadata of Parquet and Arrow.

use std::collections::HashMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::motion::{Joint, Motion, SampledClip, Transform, circle};
use crate::names::distinct_names;

/// The key of the metadata; for one clip of several, its number may follow: `skeleton.1`.
pub(crate) const KEY: &str = "skeleton";

/// The skeleton of a clip, by the names of its tracks in the table.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct SkeletonNote {
    tracks: Vec<String>,
    /// For each track, the index of its parent; `None` for a root.
    parents: Vec<Option<usize>>,
    /// For each track, its rest position relative to its parent.
    offsets: Vec<[f64; 3]>,
    /// Why poses in the world cannot be computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    no_world: Option<String>,
}

/// The metadata of a clip's skeleton; `None` if no joint has a parent and all rest at 0.
pub(crate) fn note_of(sampled: &SampledClip<'_>) -> Option<(&'static str, String)> {
    let clip = sampled.clip;
    if !clip.has_hierarchy() {
        return None;
    }
    let joints = || clip.skeleton.iter().enumerate();
    let offset = |(track, joint): (usize, &Joint)| {
        (clip.origin(track) + joint.rest.translation.as_dvec3()).to_array()
    };
    let hierarchy = SkeletonNote {
        tracks: distinct_names(&clip.set),
        parents: joints().map(|(_, joint)| joint.parent).collect(),
        offsets: joints().map(offset).collect(),
        no_world: clip.no_world.clone(),
    };
    // Cannot fail: these are only text and finite numbers.
    let text = serde_json::to_string(&hierarchy).ok()?;
    Some((KEY, text))
}

/// Sets the skeleton of the clip with this index from the metadata, if it has these tracks.
pub(crate) fn attach_skeleton(motion: &mut Motion, index: usize, notes: &[(String, String)]) {
    let find = |key: &str| notes.iter().find(|(known, _)| known == key);
    let note = find(&format!("{KEY}.{index}")).or_else(|| find(KEY));
    // A `skeleton` of another program has another form.
    let hierarchy = note.and_then(|(_, text)| serde_json::from_str::<SkeletonNote>(text).ok());
    let Some(SkeletonNote {
        tracks,
        parents,
        offsets,
        no_world,
    }) = hierarchy
    else {
        return;
    };
    let count = tracks.len();
    if parents.len() != count || offsets.len() != count || motion.set.track_count() != count {
        return;
    }
    // If tracks have equal names, the first one is meant.
    let names = (0..count).rev();
    let names = names.map(|track| (motion.set.track_name(track), track));
    let names: HashMap<String, usize> = names.collect();
    let by_name = |name: &String| names.get(name).copied();
    // The tracks of a table may be in another order than in the skeleton.
    let Some(indices) = tracks.iter().map(by_name).collect::<Option<Vec<usize>>>() else {
        return;
    };
    let mut skeleton: Vec<Option<Joint>> = vec![None; count];
    for ((&track, parent), offset) in indices.iter().zip(parents).zip(offsets) {
        let parent = match parent.map(|parent| indices.get(parent).copied()) {
            None => None,
            Some(Some(parent)) if parent != track => Some(parent),
            Some(_) => return,
        };
        let offset = motion.resting_at(track, parent, DVec3::from_array(offset));
        if !offset.is_finite() {
            return;
        }
        skeleton[track] = Some(Joint {
            parent,
            rest: Transform {
                translation: offset,
                ..Transform::default()
            },
        });
    }
    let Some(skeleton) = skeleton.into_iter().collect::<Option<Vec<Joint>>>() else {
        return;
    };
    let parents: Vec<Option<usize>> = skeleton.iter().map(|joint| joint.parent).collect();
    if circle(&parents).is_none() {
        motion.skeleton = skeleton;
        motion.no_world = no_world;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn clip(names: [&str; 2]) -> Motion {
        let mut motion = Motion::default();
        for name in names {
            motion.set.push(name, &[0.0], &[Quat::IDENTITY]).unwrap();
        }
        motion
    }

    fn joint(parent: Option<usize>, translation: Vec3) -> Joint {
        let rest = Transform {
            translation,
            ..Transform::default()
        };
        Joint { parent, rest }
    }

    #[test]
    fn a_skeleton_is_found_again_whatever_the_order_of_its_tracks() {
        let mut written = clip(["hip", "knee"]);
        written.skeleton = vec![
            joint(None, Vec3::Y),
            joint(Some(0), Vec3::new(0.1, -0.4, 0.0)),
        ];
        let samples = crate::motion::keyed::keyed(&written).unwrap();
        let (key, text) = note_of(&samples.of(&written, None, &[])).unwrap();
        let notes = [(key.to_owned(), text)];
        let mut read = clip(["knee", "hip"]);
        attach_skeleton(&mut read, 0, &notes);
        let expected = [
            joint(Some(1), Vec3::new(0.1, -0.4, 0.0)),
            joint(None, Vec3::Y),
        ];
        assert_eq!(read.skeleton, expected);
        for text in [
            "a man",
            r#"{"tracks":["hip","foot"],"parents":[null,0],"offsets":[[0,0,0],[0,0,0]]}"#,
            r#"{"tracks":["hip","knee"],"parents":[null,9],"offsets":[[0,0,0],[0,0,0]]}"#,
            r#"{"tracks":["hip","hip"],"parents":[null,0],"offsets":[[0,0,0],[0,0,0]]}"#,
            r#"{"tracks":["hip","knee"],"parents":[null,1],"offsets":[[0,0,0],[0,0,0]]}"#,
            r#"{"tracks":["hip","knee"],"parents":[1,0],"offsets":[[0,0,0],[0,0,0]]}"#,
        ] {
            let mut read = clip(["hip", "knee"]);
            attach_skeleton(&mut read, 0, &[(KEY.to_owned(), text.to_owned())]);
            assert_eq!(read.skeleton, [], "{text}");
        }
    }
}
