//! The limits and interpolations of scalars beside the rows of a table: JSON in the metadata of Parquet and Arrow.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::motion::{ChannelInterpolation, Motion, Scalar};

/// The key of the metadata; for one clip of several, its number may follow: `scalars.1`.
const KEY: &str = "scalars";

/// The parts of a scalar that its column does not say.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct ScalarNote {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    interpolation: Option<ChannelInterpolation>,
}

/// The metadata of the scalars of a clip; `None` if their columns say all. Samples of cubic splines are joined by lines.
pub(crate) fn note_of(clip: &Motion) -> Option<(&'static str, String)> {
    let note = |(index, name): (usize, &str)| {
        let scalar = clip.scalar(index);
        let interpolation = match scalar.interpolation {
            Some(ChannelInterpolation::Cubic) => Some(ChannelInterpolation::Linear),
            same => same,
        };
        let is_known = interpolation == Scalar::of(scalar.kind).interpolation;
        let note = ScalarNote {
            limits: scalar.limits,
            interpolation: interpolation.filter(|_| !is_known),
        };
        let says = note.limits.is_some() || note.interpolation.is_some();
        says.then(|| (scalar.kind.column(name), note))
    };
    let named = clip.scalar_keys().enumerate();
    let notes: BTreeMap<String, ScalarNote> = named
        .filter_map(|(index, keys)| note((index, keys.name)))
        .collect();
    // Text and numbers; limits that are not finite have no JSON.
    let text = (!notes.is_empty()).then(|| serde_json::to_string(&notes).ok());
    Some((KEY, text.flatten()?))
}

/// Sets the limits and interpolations of the scalars of the clip with this index from the metadata.
pub(crate) fn attach_scalars(motion: &mut Motion, index: usize, notes: &[(String, String)]) {
    let find = |key: &str| notes.iter().find(|(known, _)| known == key);
    let note = find(&format!("{KEY}.{index}")).or_else(|| find(KEY));
    // `scalars` of another program have another form.
    let parsed = note.and_then(|(_, text)| serde_json::from_str(text).ok());
    let Some(parsed): Option<BTreeMap<String, ScalarNote>> = parsed else {
        return;
    };
    for index in 0..motion.scalars.len() {
        let Some(keys) = motion.set.scalar(index) else {
            continue;
        };
        let scalar = &mut motion.scalars[index];
        let Some(note) = parsed.get(&scalar.kind.column(keys.name)) else {
            continue;
        };
        let is_range = |[low, high]: &[f64; 2]| low <= high;
        scalar.limits = note.limits.filter(is_range);
        let stated = note.interpolation;
        // Tables do not store tangents.
        let stated = stated.filter(|&stated| stated != ChannelInterpolation::Cubic);
        scalar.interpolation = stated.or(scalar.interpolation);
    }
}
