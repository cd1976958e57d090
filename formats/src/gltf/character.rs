//! Characters: the skeleton of a file at rest, whether the file has animations or none, and the file with other animations.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;
use tumble::Channel;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::WriteError;
use crate::gltf::edits::Edits;
use crate::gltf::key_bytes::KeyBytes;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Skin, TargetPath};
use crate::gltf::write_new::{
    NewAnimation, NewChannel, NewSampler, NewTarget, UniqueNames, f32_times,
};
use crate::gltf::written_keys::WrittenKeys;
use crate::motion::{Joint, Motion};

/// The skeleton of a file: the joints of its skins with their ancestors, or all nodes of a file without skins. Each track
/// has one key, its rest rotation.
///
/// # Errors
/// When there are no nodes, or one is invalid.
pub(super) fn skeleton(reader: &GltfReader<'_>, nodes: &Nodes) -> Result<Motion, Diagnostic> {
    let skins = reader.json.optional::<Skin>("skins").into_iter();
    let joints = skins.flat_map(|skin| skin.joints);
    let mut joints: BTreeSet<usize> = joints.filter(|&joint| joint < nodes.count()).collect();
    if joints.is_empty() {
        joints = (0..nodes.count())
            .filter(|&node| !nodes.is_origin(node))
            .collect();
    }
    nodes.complete(&mut joints);
    if joints.is_empty() {
        let message = "the file has no nodes, and so no skeleton";
        return Err(reader
            .json
            .refuse("/nodes", Code::NothingToAnimate, message));
    }
    let joints: Vec<usize> = joints.into_iter().collect();
    let mut motion = Motion::default();
    for (track, &node) in joints.iter().enumerate() {
        let rest = nodes.rest(node, reader)?.transform;
        let (carrier, origin) = nodes.carrier(node);
        let parent = carrier.map(|parent| joints.partition_point(|&listed| listed < parent));
        motion.skeleton.push(Joint { parent, rest });
        let pushed = motion.set.push(nodes.name(node), &[0.0], &[rest.rotation]);
        pushed.map_err(|error| {
            let pointer = format!("/nodes/{node}/rotation");
            reader
                .json
                .refuse(&pointer, Code::NotFinite, error.to_string())
        })?;
        if origin != DVec3::ZERO {
            motion.set_origin(track, origin);
        }
    }
    Ok(motion)
}

/// Replaces the animations of a file by the keys of clips, whose tracks are the nodes of their names. Channels that only
/// repeat the rest pose are left out. Returns the new bytes, for the next buffer view.
///
/// # Errors
/// When no node has a track's name, or times cannot be stored in f32.
pub(super) fn replace_animations(
    reader: &GltfReader<'_>,
    nodes: &Nodes,
    clips: &[&Motion],
    output: &str,
    edits: &mut Edits<'_>,
) -> Result<Vec<u8>, WriteError> {
    let json = reader.json;
    let named: HashMap<&str, usize> = (0..nodes.count())
        .map(|node| (nodes.name(node), node))
        .collect();
    let (mut bytes, mut names) = (KeyBytes::new(edits), UniqueNames::default());
    let mut animations = Vec::new();
    for (index, clip) in clips.iter().enumerate() {
        let refuse = |(code, why): (Code, String)| {
            Diagnostic::new(output, code, format!("clip {}: {why}", index + 1))
        };
        let mut animation = NewAnimation {
            name: clip.name.clone().map(|name| names.unique(name, index)),
            ..NewAnimation::default()
        };
        for track in 0..clip.set.track_count() {
            let name = clip.set.track_name(track);
            let Some(&node) = named.get(&*name) else {
                let why = format!("no node of the file is called `{name}`");
                return Err(refuse((Code::NothingToAnimate, why)).into());
            };
            for path in [
                TargetPath::Rotation,
                TargetPath::Translation,
                TargetPath::Scale,
            ] {
                let Some(keys) = WrittenKeys::of(clip, track, path) else {
                    continue;
                };
                if keys.times.len() < 2 && repeats_rest(clip, track, path) {
                    continue;
                }
                let times = f32_times(clip.set.track_count(), &keys.times).map_err(refuse)?;
                let input = bytes.input(&times, edits);
                let output = bytes.output(&keys, path, edits);
                animation.channels.push(NewChannel {
                    sampler: animation.samplers.len(),
                    target: NewTarget {
                        node,
                        path: path.name(),
                    },
                });
                animation.samplers.push(NewSampler {
                    input,
                    output,
                    interpolation: keys.sampler.name(),
                });
            }
        }
        if animation.channels.is_empty() {
            let why = "nothing of it moves".to_owned();
            return Err(refuse((Code::NothingToAnimate, why)).into());
        }
        animations.push(serde_json::to_string(&animation).map_err(std::io::Error::from)?);
    }
    match json.array("animations") {
        Some(array) => edits.replace(array, format!("[{}]", animations.join(","))),
        None => animations.into_iter().for_each(|animation| {
            edits.append_to("animations", animation);
        }),
    }
    Ok(bytes.into_bytes())
}

/// Whether the first key of a channel is the rest pose.
fn repeats_rest(clip: &Motion, track: usize, path: TargetPath) -> bool {
    let Some(joint) = clip.skeleton.get(track) else {
        return false;
    };
    let vector = |channel| {
        clip.set
            .vector_keys(channel, track)
            .and_then(|keys| keys.keys.first().copied())
    };
    match path {
        TargetPath::Rotation => clip.set.track(track).keys.first() == Some(&joint.rest.rotation),
        TargetPath::Translation => vector(Channel::Translation) == Some(joint.rest.translation),
        TargetPath::Scale => vector(Channel::Scale) == Some(joint.rest.scale),
        TargetPath::Weights => false,
    }
}

/// The bytes of the keys of clips, at most.
pub(super) fn key_bytes(clips: &[&Motion]) -> u64 {
    // Times, values and two tangents of three channels.
    let keys = clips.iter().map(|clip| clip.key_count() as u64);
    4 * (1 + 3 * 4) * keys.sum::<u64>()
}
