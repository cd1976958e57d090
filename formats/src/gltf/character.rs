//! Characters: the skeleton of a file at rest, whether the file has animations or none, and the file with other animations.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;
use serde_json::value::RawValue;
use tumble::Channel as VectorChannel;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{JointClip, WriteError};
use crate::gltf::animation::ReadAnimation;
use crate::gltf::bake::is_part;
use crate::gltf::edits::Edits;
use crate::gltf::json::JsonMembers;
use crate::gltf::key_bytes::KeyBytes;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Animation, Channel, Skin, TargetPath};
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
    let mut writer = ChannelWriter::new(nodes, output, edits);
    let mut names = UniqueNames::default();
    let mut animations = Vec::new();
    for (index, clip) in clips.iter().enumerate() {
        let mut animation = NewAnimation {
            name: clip.name.clone().map(|name| names.unique(name, index)),
            ..NewAnimation::default()
        };
        writer.add(&mut animation, (index, clip), AtRest::LeftOut, edits)?;
        if animation.channels.is_empty() {
            let why = "nothing of it moves".to_owned();
            return Err(writer.refuse(index, (Code::NothingToAnimate, why)).into());
        }
        animations.push(serde_json::to_string(&animation).map_err(std::io::Error::from)?);
    }
    match json.array("animations") {
        Some(array) => edits.replace(array, format!("[{}]", animations.join(","))),
        None => animations.into_iter().for_each(|animation| {
            edits.append_to("animations", animation);
        }),
    }
    Ok(writer.bytes.into_bytes())
}

/// Replaces the channels of joints in the animations of a file by the keys of clips, each in the animation of its index.
/// Morph weights are cut if their clip is. Everything else of the animations stays: names, and other animations. Returns
/// the new bytes, for the next buffer view.
///
/// # Errors
/// As [`replace_animations`].
pub(super) fn replace_joints(
    reader: &GltfReader<'_>,
    nodes: &Nodes,
    (clips, animations): (&[JointClip<'_>], &[Option<ReadAnimation>]),
    output: &str,
    edits: &mut Edits<'_>,
) -> Result<Vec<u8>, WriteError> {
    let mut writer = ChannelWriter::new(nodes, output, edits);
    let entries = reader.json.entries("animations");
    for &JointClip { joints, weights } in clips {
        let index = joints.index;
        let pointer = format!("/animations/{index}");
        let Some(&raw) = entries.get(index) else {
            continue;
        };
        let read = animations.get(index).and_then(Option::as_ref);
        let cut = read.filter(|read| is_part(read, weights));
        let before: Animation<'_> = reader.json.typed(raw, &pointer)?;
        let (mut channels, mut samplers) = (Vec::new(), Vec::new());
        let mut kept: HashMap<usize, usize> = HashMap::new();
        let mut moves_joints = false;
        for (index_in_file, raw) in before.channels.iter().enumerate() {
            let channel: Channel = reader.json.typed(raw, &pointer)?;
            let moved = channel.target.moves();
            if moved.is_some_and(|(_, path)| path != TargetPath::Weights) {
                moves_joints = true;
                continue;
            }
            let keys = cut.and_then(|read| read.weights(index_in_file));
            let keys = keys.and_then(|scalars| WrittenKeys::of_scalars(weights, scalars));
            let sampler = match keys {
                Some(keys) => {
                    let sampler = writer.sampler(index, 1, (&keys, TargetPath::Weights), edits)?;
                    samplers.push(serde_json::to_string(&sampler).map_err(std::io::Error::from)?);
                    samplers.len() - 1
                }
                None => {
                    let Some(raw) = before.samplers.get(channel.sampler) else {
                        continue;
                    };
                    *kept.entry(channel.sampler).or_insert_with(|| {
                        samplers.push(raw.get().to_owned());
                        samplers.len() - 1
                    })
                }
            };
            let members: JsonMembers<'_> = reader.json.typed(raw, &pointer)?;
            channels.push(object(&members, &[("sampler", sampler.to_string())]));
        }
        if !moves_joints && cut.is_none() {
            continue;
        }
        let mut animation = NewAnimation::default();
        writer.add(&mut animation, (index, joints), AtRest::LeftOut, edits)?;
        if animation.channels.is_empty() {
            writer.add(&mut animation, (index, joints), AtRest::Written, edits)?;
        }
        // The clip has no keys at all, so there is no animation.
        if animation.channels.is_empty() && moves_joints {
            continue;
        }
        let first = samplers.len();
        for mut channel in animation.channels {
            channel.sampler += first;
            channels.push(serde_json::to_string(&channel).map_err(std::io::Error::from)?);
        }
        for sampler in animation.samplers {
            samplers.push(serde_json::to_string(&sampler).map_err(std::io::Error::from)?);
        }
        let members: JsonMembers<'_> = reader.json.typed(raw, &pointer)?;
        let lists = [("channels", channels), ("samplers", samplers)];
        let lists = lists.map(|(name, list)| (name, format!("[{}]", list.join(","))));
        edits.replace(raw, object(&members, &lists));
    }
    Ok(writer.bytes.into_bytes())
}

/// The text of an object with other values of some members.
fn object(members: &JsonMembers<'_>, others: &[(&str, String)]) -> String {
    let text = |(name, value): &(String, &RawValue)| {
        let other = others.iter().find(|(other, _)| other == name);
        let value = other.map_or(value.get(), |(_, value)| value);
        format!("{}:{value}", serde_json::Value::from(name.as_str()))
    };
    let members: Vec<String> = members.0.iter().map(text).collect();
    format!("{{{}}}", members.join(","))
}

/// The treatment of channels that only repeat the rest pose.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AtRest {
    LeftOut,
    Written,
}

/// Writes the keys of clips as channels, whose tracks are the nodes of their names.
struct ChannelWriter<'a> {
    nodes: HashMap<&'a str, usize>,
    /// The name of the file in messages.
    output: &'a str,
    bytes: KeyBytes,
}

impl<'a> ChannelWriter<'a> {
    fn new(nodes: &'a Nodes, output: &'a str, edits: &Edits<'_>) -> Self {
        Self {
            nodes: (0..nodes.count())
                .map(|node| (nodes.name(node), node))
                .collect(),
            output,
            bytes: KeyBytes::new(edits),
        }
    }

    fn refuse(&self, index: usize, (code, why): (Code, String)) -> Diagnostic {
        Diagnostic::new(self.output, code, format!("clip {}: {why}", index + 1))
    }

    /// Adds the channels of the clip with this index.
    fn add(
        &mut self,
        animation: &mut NewAnimation,
        (index, clip): (usize, &Motion),
        at_rest: AtRest,
        edits: &mut Edits<'_>,
    ) -> Result<(), Diagnostic> {
        for track in 0..clip.set.track_count() {
            let name = clip.set.track_name(track);
            let Some(&node) = self.nodes.get(&*name) else {
                let why = format!("no node of the file is called `{name}`");
                return Err(self.refuse(index, (Code::NothingToAnimate, why)));
            };
            for path in [
                TargetPath::Rotation,
                TargetPath::Translation,
                TargetPath::Scale,
            ] {
                let Some(keys) = WrittenKeys::of(clip, track, path) else {
                    continue;
                };
                let is_at_rest = keys.times.len() < 2 && repeats_rest(clip, track, path);
                if is_at_rest && at_rest == AtRest::LeftOut {
                    continue;
                }
                let tracks = clip.set.track_count();
                let sampler = self.sampler(index, tracks, (&keys, path), edits)?;
                animation.channels.push(NewChannel {
                    sampler: animation.samplers.len(),
                    target: NewTarget {
                        node,
                        path: path.name(),
                    },
                });
                animation.samplers.push(sampler);
            }
        }
        Ok(())
    }

    /// Adds the keys of a channel of the clip with this index, which has so many tracks.
    fn sampler(
        &mut self,
        index: usize,
        tracks: usize,
        (keys, path): (&WrittenKeys, TargetPath),
        edits: &mut Edits<'_>,
    ) -> Result<NewSampler, Diagnostic> {
        let times = f32_times(tracks, &keys.times).map_err(|why| self.refuse(index, why))?;
        let input = self.bytes.input(&times, edits);
        let output = self.bytes.output(keys, path, edits);
        Ok(NewSampler {
            input,
            output,
            interpolation: keys.sampler.name(),
        })
    }
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
        TargetPath::Translation => {
            vector(VectorChannel::Translation) == Some(joint.rest.translation)
        }
        TargetPath::Scale => vector(VectorChannel::Scale) == Some(joint.rest.scale),
        TargetPath::Weights => false,
    }
}

/// The bytes of the keys of clips, at most.
pub(super) fn key_bytes<'a>(clips: impl Iterator<Item = &'a Motion>) -> u64 {
    // Times, values and two tangents of three channels.
    let keys = clips.map(|clip| clip.key_count() as u64);
    4 * (1 + 3 * 4) * keys.sum::<u64>()
}
