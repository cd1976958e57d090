//! Converts one animation to a clip.

use std::collections::btree_map::{BTreeMap, Entry};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use serde_json::value::RawValue;
use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::gltf::channel::{ChannelKeys, InputTimes, MovedChannel};
use crate::gltf::morphs::Morphs;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Animation, AnimationExtras, Channel, Sampler, TargetPath};
use crate::learning::mirror_pairs;
use crate::motion::grid::restore;
use crate::motion::{self, Channels, Joint, Motion};
use crate::rate::Precision;

/// Data of an animation that was read, for writing it again.
#[derive(Debug)]
pub(super) struct ReadAnimation {
    /// First and last key time, in the file and in the clip.
    pub(super) stored_span: [f32; 2],
    pub(super) span: [f64; 2],
    /// The channels that have more than one key and are not STEP.
    pub(super) sampled: Vec<SampledChannel>,
    /// The other channels that move tracks. They change only if the clip is cut.
    pub(super) others: Vec<SampledChannel>,
    /// Number of channels that move anything else, such as a material.
    pub(super) beside: usize,
}

impl ReadAnimation {
    /// The scalars that a channel moves.
    pub(super) fn weights(&self, channel: usize) -> Option<Range<usize>> {
        let mut channels = self.sampled.iter().chain(&self.others);
        let found = channels.find(|read| read.channel == channel);
        let found = found.filter(|read| read.path == TargetPath::Weights)?;
        Some(found.scalars())
    }
}

/// A channel that gets other keys when the file is written again.
#[derive(Debug)]
pub(super) struct SampledChannel {
    /// Its index among the channels of the animation, and that of its sampler.
    pub(super) channel: usize,
    pub(super) sampler: usize,
    /// The track and the property that it moves; of weights, the first scalar.
    pub(super) track: usize,
    pub(super) path: TargetPath,
    /// The number of scalars of weights, 1 for others.
    pub(super) elements: usize,
}

impl SampledChannel {
    /// The scalars of weights.
    pub(super) fn scalars(&self) -> Range<usize> {
        self.track..self.track + self.elements
    }
}

/// Bytes of memory of a track without its keys: its name, its joint, its channels, and its entries in lists.
const TRACK: usize = 400;

/// Bytes of memory of a scalar without its keys and its name.
const SCALAR: usize = 240;

/// Reads the animation with this index; `None` if it moves no node and no morph target.
///
/// # Errors
/// When the animation is invalid; the first error is returned.
pub(super) fn read(
    index: usize,
    reader: &GltfReader<'_>,
    (nodes, morphs): (&Nodes, &Morphs),
    options: &ReadOptions,
) -> Result<Option<(Motion, ReadAnimation)>, Diagnostic> {
    let pointer = format!("/animations/{index}");
    let animation: Animation<'_> = reader.json.entry("animations", index, &pointer)?;
    let moved = moved(reader, (nodes, morphs), &animation, &pointer)?;
    if moved.is_empty() {
        reader.warn(
            Code::NothingMoved,
            &pointer,
            || "the animation moves no node and no morph target; it is copied unchanged",
        );
        return Ok(None);
    }
    let (times, stored, rate) = times(reader, &moved, options)?;
    let tracks = Tracks::of(nodes, &moved, options.with_partners);
    reader.take(tracks.nodes.len(), TRACK, &pointer)?;
    // Memory for the names of the tracks, which each clip contains.
    let names = tracks.nodes.iter().map(|&node| nodes.name(node).len());
    reader.take(names.sum(), 1, &pointer)?;
    let mut motion = Motion {
        name: animation.name.filter(|name| !name.is_empty()),
        index,
        rate,
        ..Motion::default()
    };
    let mut keys: Vec<ChannelKeys> = Vec::new();
    let mut borrowed = Vec::new();
    let are_needed = options.tracks.as_ref().map(|selection| {
        let names = tracks.nodes.iter().map(|&node| nodes.name(node));
        let parent = |&node: &usize| Some(tracks.of_node(nodes.carrier(node).0?));
        let parents: Vec<Option<usize>> = tracks.nodes.iter().map(parent).collect();
        selection.are_needed(names, &parents)
    });
    for moved in &moved {
        let is_of_joint = moved.path != TargetPath::Weights;
        if is_of_joint
            && let Some(are_needed) = &are_needed
            && !are_needed[tracks.of_node(moved.node)]
        {
            keys.push(ChannelKeys::at_rest());
            continue;
        }
        // Keys exist twice in memory until they are moved into the set.
        let count = times[&moved.sampler.input].len();
        borrowed.push(reader.borrow(count, moved.key_bytes(), &pointer)?);
        reader.take(count, moved.key_bytes(), &pointer)?;
        keys.push(moved.keys(reader, &times[&moved.sampler.input], options.duplicates)?);
    }
    let all_times = || keys.iter().flat_map(|keys| keys.times.iter().copied());
    let start = all_times().fold(f64::INFINITY, f64::min);
    let start = if start.is_finite() { start } else { 0.0 };
    let targets = moved.iter().zip(&keys);
    let targets: HashMap<_, _> = targets
        .map(|(moved, keys)| ((moved.node, moved.path), (moved, keys)))
        .collect();
    let mut origins = Vec::new();
    for &node in &tracks.nodes {
        motion
            .written_joints
            .extend(nodes.written_joint(node).cloned());
        let rest = rest(node, reader, nodes, &mut motion)?;
        let keyed = |path| {
            let found = targets.get(&(node, path)).copied();
            found.filter(|(_, keys)| !keys.times.is_empty())
        };
        let sampler = |path| keyed(path).map(|(moved, _)| moved.interpolation);
        motion.channels.push(Channels {
            rotation: sampler(TargetPath::Rotation),
            translation: sampler(TargetPath::Translation),
            scale: sampler(TargetPath::Scale),
        });
        let (carrier, origin) = nodes.carrier(node);
        motion.skeleton.push(Joint {
            parent: carrier.map(|parent| tracks.of_node(parent)),
            rest,
        });
        origins.push(origin);
        let name = nodes.name(node);
        match keyed(TargetPath::Rotation) {
            Some((_, keys)) => keys.push(&mut motion.set, name),
            None => motion.set.push(name, &[start], &[rest.rotation]),
        }
        .map_err(|error| {
            reader
                .json
                .refuse(&pointer, Code::NotFinite, error.to_string())
        })?;
        for path in [TargetPath::Translation, TargetPath::Scale] {
            if let Some((moved, keys)) = keyed(path) {
                let set = keys.set(&mut motion.set, path);
                set.map_err(|error| {
                    reader
                        .json
                        .refuse(&moved.output, Code::NotFinite, error.to_string())
                })?;
            }
        }
    }
    for (track, origin) in origins.into_iter().enumerate() {
        motion.set_origin(track, origin);
    }
    let mut first_scalars = HashMap::new();
    for (moved, keys) in moved.iter().zip(&keys) {
        if moved.path != TargetPath::Weights || keys.times.is_empty() {
            continue;
        }
        first_scalars.insert(moved.channel, motion.set.scalar_count());
        let name = |target| morphs.name(nodes, moved.node, target);
        let bytes = (0..moved.elements).map(|target| SCALAR + name(target).len());
        reader.take(bytes.sum(), 1, &pointer)?;
        let how = (moved.elements, moved.interpolation);
        let pushed = keys.push_weights(&mut motion, how, name);
        pushed.map_err(|error| {
            reader
                .json
                .refuse(&moved.output, Code::NotFinite, error.to_string())
        })?;
    }
    // Joints without offsets: the file may state why their poses in the world are unknown.
    if motion.has_unplaced_joints() && motion.no_world.is_none() {
        motion.no_world = animation.extras.and_then(no_world);
    }
    let (sampled, others): (Vec<_>, Vec<_>) = moved.iter().zip(&keys).partition(|(moved, keys)| {
        keys.times.len() > 1 && moved.interpolation != motion::ChannelInterpolation::Step
    });
    let channel = |(moved, _): (&MovedChannel, _)| SampledChannel {
        channel: moved.channel,
        sampler: moved.sampler_index,
        track: match moved.path {
            TargetPath::Weights => first_scalars.get(&moved.channel).copied().unwrap_or(0),
            _ => tracks.of_node(moved.node),
        },
        path: moved.path,
        elements: moved.elements,
    };
    let others = others
        .into_iter()
        .filter(|(_, keys)| !keys.times.is_empty());
    let read = ReadAnimation {
        stored_span: stored,
        span: motion
            .set
            .time_span()
            .map_or([0.0; 2], |(first, last)| [first, last]),
        others: others.map(channel).collect(),
        sampled: sampled.into_iter().map(channel).collect(),
        beside: animation.channels.len() - moved.len(),
    };
    Ok(Some((motion, read)))
}

/// Why the positions of joints are unknown, if the extras of an animation say it.
fn no_world(extras: &RawValue) -> Option<String> {
    let extras: AnimationExtras = serde_json::from_str(extras.get()).ok()?;
    extras.no_world
}

/// The channels that move nodes or morph targets.
fn moved(
    reader: &GltfReader<'_>,
    (nodes, morphs): (&Nodes, &Morphs),
    animation: &Animation<'_>,
    pointer: &str,
) -> Result<Vec<MovedChannel>, Diagnostic> {
    let mut all = Vec::new();
    let mut targets = HashSet::new();
    for (index, raw) in animation.channels.iter().enumerate() {
        let channel_pointer = format!("{pointer}/channels/{index}");
        let channel: Channel = reader.json.typed(raw, &channel_pointer)?;
        let Some((node, path)) = target(reader, &channel, &channel_pointer) else {
            continue;
        };
        let target = format!("{channel_pointer}/target");
        if node >= nodes.count() {
            return Err(reader.json.no_such("nodes", node, nodes.count(), &target));
        }
        let is_of_weights = path == TargetPath::Weights;
        let elements = match is_of_weights {
            true => morphs.count(nodes, node),
            false => 1,
        };
        if elements == 0 {
            reader.warn(Code::NoMorphTargets, &target, || {
                format!(
                    "node {node} has no mesh with morph targets; the channel is copied unchanged"
                )
            });
            continue;
        }
        if nodes.is_origin(node) && !is_of_weights {
            let message = format!(
                "node {node} is marked as an origin (`tumbleOrigin`), and moves; remove the mark or the channel"
            );
            return Err(reader.json.refuse(&target, Code::NodeTree, message));
        }
        if !targets.insert((node, path)) {
            let message = format!("a second channel for the {path} of node {node}; remove one");
            return Err(reader.json.refuse(&target, Code::TwoChannels, message));
        }
        if nodes.has_matrix(node) && !is_of_weights {
            reader.warn(Code::NodeMatrix, &format!("/nodes/{node}/matrix"), || {
                format!("node {node} is animated and has a matrix, which is decomposed into translation, \
                         rotation and scale")
            });
        }
        let Some(sampler) = animation.samplers.get(channel.sampler) else {
            let (index, count) = (channel.sampler, animation.samplers.len());
            return Err(reader.json.no_such(
                "samplers",
                index,
                count,
                &format!("{channel_pointer}/sampler"),
            ));
        };
        let sampler_pointer = format!("{pointer}/samplers/{}", channel.sampler);
        let sampler: Sampler = reader.json.typed(sampler, &sampler_pointer)?;
        all.push(MovedChannel::new(
            reader,
            (index, node, path),
            elements,
            (channel.sampler, sampler),
            &sampler_pointer,
        )?);
    }
    Ok(all)
}

/// The node and the property that a channel moves; `None` if it moves neither this nor morph targets.
fn target(
    reader: &GltfReader<'_>,
    channel: &Channel,
    pointer: &str,
) -> Option<(usize, TargetPath)> {
    let target = &channel.target;
    let moved = target.moves();
    let is_known = target.path == "pointer" || TargetPath::named(&target.path).is_some();
    if target.node.is_some() && !is_known {
        reader.warn(Code::TargetPath, &format!("{pointer}/target/path"), || {
            format!(
                "`{}` is not known; the channel is copied unchanged",
                target.path
            )
        });
    }
    moved
}

/// The times of channels, by the index of their accessor.
type TimesOf = BTreeMap<usize, InputTimes>;

/// The times of all channels, moved to the frames of one rate if they fit it; the first and the last time in the
/// file; and the rate.
fn times(
    reader: &GltfReader<'_>,
    moved: &[MovedChannel],
    options: &ReadOptions,
) -> Result<(TimesOf, [f32; 2], Option<FrameRate>), Diagnostic> {
    let mut stored = BTreeMap::new();
    for moved in moved {
        if let Entry::Vacant(entry) = stored.entry(moved.sampler.input) {
            entry.insert(moved.stored_times(reader)?);
        }
    }
    let all = || stored.values().flatten().copied();
    let first = all().fold(f64::INFINITY, f64::min);
    let last = all().fold(f64::NEG_INFINITY, f64::max);
    let (indices, mut lists): (Vec<usize>, Vec<Vec<f64>>) = stored.into_iter().unzip();
    let rate = match options.raw_times {
        true => None,
        false => restore(&mut lists, Precision::F32),
    };
    let lists = lists.into_iter().map(InputTimes::new);
    let times = indices.into_iter().zip(lists).collect();
    Ok((times, [first as f32, last as f32], rate))
}

/// The nodes that are tracks: those that are moved, their ancestors, and the other joints of their skins; if asked for,
/// also their partners on the other side.
struct Tracks {
    /// In the order of the file.
    nodes: Vec<usize>,
}

impl Tracks {
    fn of(nodes: &Nodes, moved: &[MovedChannel], with_partners: bool) -> Self {
        // Weights move no node.
        let moved = moved
            .iter()
            .filter(|moved| moved.path != TargetPath::Weights);
        let mut tracks: BTreeSet<usize> = moved.map(|moved| moved.node).collect();
        nodes.complete(&mut tracks);
        if with_partners {
            let names: Vec<&str> = (0..nodes.count()).map(|node| nodes.name(node)).collect();
            let partners = mirror_pairs(&names);
            let of_tracks = tracks.iter().map(|&node| partners[node]);
            let of_tracks: Vec<usize> = of_tracks.filter(|&node| !nodes.is_origin(node)).collect();
            tracks.extend(of_tracks);
            nodes.complete(&mut tracks);
        }
        Self {
            nodes: tracks.into_iter().collect(),
        }
    }

    /// The track of a node.
    fn of_node(&self, node: usize) -> usize {
        self.nodes.partition_point(|&listed| listed < node)
    }
}

/// The rest transform of a node; records in `motion` if the node's matrix is not a transform.
fn rest(
    node: usize,
    reader: &GltfReader<'_>,
    nodes: &Nodes,
    motion: &mut Motion,
) -> Result<motion::Transform, Diagnostic> {
    let rest = nodes.rest(node, reader)?;
    if rest.is_sheared {
        let pointer = format!("/nodes/{node}/matrix");
        let message = format!(
            "the matrix of `{}` shears or projects; it is approximated by translation, rotation and scale, and world poses cannot be computed",
            nodes.name(node)
        );
        reader.warn(Code::Shear, &pointer, || message.clone());
        motion.no_world.get_or_insert(message);
    }
    Ok(rest.transform)
}
