//! FBX, as programs of Autodesk, Blender and Mixamo write it, binary or text.
//!
//! The file is read by `ufbx`, which also evaluates the layers, curves, pivots and rotation orders of a node. Each
//! animation stack becomes a clip, and each node a track. The keys follow the curves of the node within 1e-6 (in
//! radians for rotations, otherwise relative to the largest number). With [`ReadOptions::keyframes`] they are only
//! those at the key times of the file, and those that large rotations need.

mod decimal_commas;
mod direct;
mod follow;
mod layers;
mod times;

use std::cell::Cell;
use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::{AtomicI64, Ordering};

use glam::{DQuat, DVec3, DVec4, Quat, Vec3};
use rayon::prelude::*;
use tumble::{FrameRate, TrackError};
use ufbx::{
    AllocatorOpts, AnimRoot, AnimValue, CoordinateAxis, ErrorType, FileFormat, InheritModeHandling,
    LoadOpts, Node, SceneRoot, Transform,
};

use crate::budget::{Budget, OverBudget};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::fbx::direct::DirectEvaluator;
use crate::fbx::follow::{
    ChannelFollower, ChannelKind, ChannelValue, FollowedKeys, KeyStop, Unfollowed,
};
use crate::fbx::layers::{LayerFault, StackLayers, is_solo, is_spheric, without_spheric_orders};
use crate::fbx::times::{ChannelTimes, NodeTimes, Takes, TimeDisorder, was_rounded};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions, Space};
use crate::motion::origin::relative;
use crate::motion::{self, ChannelInterpolation, Channels, Joint, Motion};
use crate::names::unique_name;
use crate::quaternion::unit;
use crate::rate::{FrameGrid, Precision, RateSource, frame_time, of, on_frames};
use crate::source::Source;
use crate::warnings::Warnings;

/// The FBX format: scenes with their animations.
pub static FORMAT: Format = Format {
    name: "fbx",
    summary: "scenes of Maya, Blender, MotionBuilder, Mixamo, as binary or text",
    extensions: &[],
    probe: is_fbx,
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_fbx,
    read_bytes: |name, bytes, options| read_fbx(name, &bytes, options),
    write: None,
    write_motion: None,
    features: &[
        Feature::SeveralTracks,
        Feature::TrackNames,
        Feature::ClipName,
        Feature::Skeleton,
        Feature::RestRotations,
        Feature::Translations,
        Feature::Scales,
        Feature::Steps,
        Feature::Lines,
        Feature::SeveralClips,
        Feature::TimesPerTrack,
        Feature::TimesPerChannel,
        Feature::UnevenTimes,
        Feature::Start,
    ],
    options: &[FormatOption::RawTimes, FormatOption::Keyframes],
};

/// The first bytes of a binary file.
const MAGIC: &[u8] = b"Kaydara FBX Binary";

/// The deepest nesting of nodes.
const DEPTH: u32 = 1024;

/// The distance in seconds on either side of a key at which a curve is evaluated, to find jumps.
const BESIDE: f64 = 1e-10;

/// The maximum number of evaluations of curves: a number for every input, and a number for each of its bytes. The
/// evaluation of a node counts once for each layer that moves it. The numbers suffice for a key of a node that ten
/// layers move: it takes 600 evaluations, and in the file it takes at least a byte for each of up to ninety curves.
const EVALUATIONS: (i64, i64) = (1 << 22, 64);

/// Bytes of memory of a track without its keys, of a key time while it is evaluated, and of a key.
const TRACK: usize = 600;
const STOP: usize = 10 * size_of::<Transform>();
const KEY: usize = 4 * (size_of::<(f64, ChannelValue, [ChannelValue; 2])>());

fn is_fbx(start: &[u8]) -> bool {
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let text = text.trim_ascii_start();
    let has = |word: &[u8]| text.windows(word.len()).any(|part| part == word);
    start.starts_with(MAGIC) || text.starts_with(b"; FBX ") || has(b"FBXHeaderExtension:")
}

/// Reads an FBX file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned. Errors of single stacks are in
/// [`Loaded::refused`].
pub fn open_fbx(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    let bytes = source.into_bytes(options.limits.file)?;
    read_fbx(&name, &bytes, options)
}

/// Reads the bytes of an FBX file; `name` is the input's name in messages. Units and axes are those of the file;
/// [`Loaded::space`] contains them.
///
/// # Errors
/// As [`open_fbx`].
pub fn read_fbx(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    decimal_commas::refuse(name, bytes)?;
    let budget = Budget::of(bytes.len(), options.limits);
    let scene = load(name, bytes, &budget)?;
    let over = |error: OverBudget| Diagnostic::new(name, Code::Memory, error.to_string());
    budget
        .take(1, scene.metadata.result_memory_used)
        .map_err(over)?;
    if scene.anim_stacks.is_empty() {
        let message = "the file has no animation stack; is it the right one?";
        return Err(Diagnostic::new(name, Code::NoAnimations, message));
    }
    if scene.nodes.iter().all(|node| node.is_root) {
        let message = "the file has no node, and its animation moves nothing; is it the right one?";
        return Err(Diagnostic::new(name, Code::NoAnimations, message));
    }
    let mut warnings = Warnings::new(name);
    warn_of_scene(&scene, &mut warnings);
    let has_spheric = scene.nodes.iter().any(|node| is_spheric(node));
    let rests = has_spheric.then(|| without_spheric_orders(&scene, Vec::new()));
    let reader = FbxReader {
        name,
        budget: &budget,
        scene: &scene,
        nodes: FbxNodes::of(&scene),
        rate: of(&RateSource::Number(frames_per_second(&scene))).map(|found| found.grid),
        rests: rests.transpose().map_err(|error| no_anim(name, &error))?,
        options,
        evaluations: AtomicI64::new(
            EVALUATIONS.0 + EVALUATIONS.1.saturating_mul(bytes.len() as i64),
        ),
    };
    let mut loaded = Loaded {
        space: space(&scene),
        ..Loaded::default()
    };
    for stack in 0..scene.anim_stacks.len() {
        match reader.clip(stack, &mut warnings) {
            Ok(clip) => loaded.clips.push(clip),
            // The limit applies to the whole file, so the other stacks would be refused too.
            Err(fault) if [Code::Memory, Code::FbxWork].contains(&fault.code) => return Err(fault),
            Err(fault) => loaded.refused.push(fault),
        }
    }
    loaded.warnings = warnings.into_list();
    Ok(loaded)
}

/// The rate that the file states.
fn frames_per_second(scene: &SceneRoot) -> f64 {
    /// 119.88 frames a second, which `ufbx` does not know.
    const FRAMES_119_88: i64 = 18;
    let mode = ufbx::find_prop(&scene.settings.props, "TimeMode").map(|mode| mode.value_int);
    match mode {
        Some(FRAMES_119_88) => 119.88,
        _ => scene.settings.frames_per_second,
    }
}

/// The error where the library cannot make an animation of some layers.
fn no_anim(name: &str, error: &ufbx::Error) -> Diagnostic {
    let message = format!("its layers cannot be evaluated: {}", &*error.description);
    Diagnostic::new(name, Code::FbxDamaged, message)
}

fn load(name: &str, bytes: &[u8], budget: &Budget) -> Result<SceneRoot, Diagnostic> {
    let half = usize::try_from(budget.left() / 2).unwrap_or(usize::MAX);
    // For `ufbx`, 0 means no limit.
    let half = half.max(1);
    let allocator = || AllocatorOpts {
        memory_limit: half,
        ..AllocatorOpts::default()
    };
    let options = LoadOpts {
        temp_allocator: allocator(),
        result_allocator: allocator(),
        ignore_geometry: true,
        ignore_embedded: true,
        skip_skin_vertices: true,
        skip_mesh_parts: true,
        node_depth_limit: DEPTH,
        file_format: FileFormat::Fbx,
        // With this option, children inherit scales as in every other format.
        inherit_mode_handling: InheritModeHandling::Compensate,
        ..LoadOpts::default()
    };
    ufbx::load_memory(bytes, options).map_err(|error| {
        let (code, message) = match error.type_ {
            ErrorType::OutOfMemory | ErrorType::MemoryLimit | ErrorType::AllocationLimit => (
                Code::Memory,
                format!(
                    "reading it takes more than {half} bytes, the limit for an input of this length"
                ),
            ),
            ErrorType::NodeDepthLimit => (
                Code::FbxDepth,
                format!("nodes are nested more than {DEPTH} deep; is the file damaged?"),
            ),
            ErrorType::UnsupportedVersion => (
                Code::FbxVersion,
                "the version of the file is not known; export it as FBX 7.4 to 7.7 (FBX 2014 to 2020)"
                    .to_owned(),
            ),
            _ => {
                let info = match error.info() {
                    "" => String::new(),
                    info => format!(" ({info})"),
                };
                let reason = &*error.description;
                let message = format!(
                    "cannot be read as FBX: {reason}{info}; is it truncated, or of another format?"
                );
                (Code::FbxDamaged, message)
            }
        };
        Diagnostic::new(name, code, message)
    })
}

/// The unit of length and the up axis, if the file contains them.
fn space(scene: &SceneRoot) -> Option<Space> {
    let up = match scene.settings.axes.up {
        CoordinateAxis::PositiveX => DVec3::X,
        CoordinateAxis::NegativeX => DVec3::NEG_X,
        CoordinateAxis::PositiveY => DVec3::Y,
        CoordinateAxis::NegativeY => DVec3::NEG_Y,
        CoordinateAxis::PositiveZ => DVec3::Z,
        CoordinateAxis::NegativeZ => DVec3::NEG_Z,
        CoordinateAxis::Unknown => return None,
    };
    // Files state units as factors of 1 cm. Rounding makes 1 cm and 1 inch exact in metres.
    let metres = (scene.settings.unit_meters * 1e9).round() / 1e9;
    (metres.is_finite() && metres > 0.0).then_some(Space { up, metres })
}

/// Warns of contents of the file that no clip can store.
fn warn_of_scene(scene: &SceneRoot, warnings: &mut Warnings) {
    let count = |count: usize, one: &str| match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        many => Some(format!("{many} {one}s")),
    };
    let beside = [
        count(scene.meshes.len(), "mesh").map(|text| text.replace("meshs", "meshes")),
        count(scene.skin_deformers.len(), "skin"),
        count(scene.blend_deformers.len(), "blend shape"),
        count(scene.materials.len(), "material"),
        count(scene.cameras.len(), "camera"),
        count(scene.lights.len(), "light"),
        count(scene.constraints.len(), "constraint"),
    ];
    let beside: Vec<String> = beside.into_iter().flatten().collect();
    if !beside.is_empty() {
        warnings.warn(Code::FbxBeside, || {
            (
                None,
                format!("only motion is read; left out: {}", beside.join(", ")),
            )
        });
    }
    if let Some(node) = scene.nodes.iter().find(|node| is_spheric(node)) {
        warnings.warn(Code::FbxSpheric, || {
            let name = &node.element.name;
            (
                None,
                format!("`{name}` has the rotation order 6 (spheric), which is read as XYZ"),
            )
        });
    }
    for warning in &scene.metadata.warnings {
        warnings.warn(Code::FbxOdd, || (None, warning.description.to_string()));
    }
    let helpers = scene
        .nodes
        .iter()
        .filter(|node| node.is_scale_helper)
        .count();
    if helpers > 0 {
        warnings.warn(Code::FbxScaleNodes, || {
            let nodes = count(helpers, "additional node").unwrap_or_default();
            (
                None,
                format!("{nodes}, for scales that children do not inherit"),
            )
        });
    }
}

/// The nodes that are tracks: all but the root, which every file has.
struct FbxNodes {
    /// Their indices in the file, parents before children.
    tracks: Vec<usize>,
    /// The track of each node of the file.
    track_of: Vec<Option<usize>>,
    names: Vec<String>,
}

impl FbxNodes {
    fn of(scene: &SceneRoot) -> Self {
        let is_track = |index: &usize| !scene.nodes[*index].is_root;
        let tracks: Vec<usize> = (0..scene.nodes.len()).filter(is_track).collect();
        let mut track_of = vec![None; scene.nodes.len()];
        for (track, &node) in tracks.iter().enumerate() {
            track_of[node] = Some(track);
        }
        let mut used = HashSet::new();
        let name = |(track, &node): (usize, &usize)| {
            let name = &scene.nodes[node].element.name;
            let name = match name.is_empty() {
                true => format!("node{track}"),
                false => name.to_string(),
            };
            unique_name(name, track, &mut used)
        };
        Self {
            names: tracks.iter().enumerate().map(name).collect(),
            track_of,
            tracks,
        }
    }
}

/// A file that is being read.
struct FbxReader<'a> {
    name: &'a str,
    budget: &'a Budget,
    scene: &'a SceneRoot,
    nodes: FbxNodes,
    /// The rate that the file states.
    rate: Option<FrameRate>,
    /// The animation without layers, in which nodes are in their rest poses; `None` if `ufbx` provides the rest poses.
    rests: Option<AnimRoot>,
    options: &'a ReadOptions,
    /// How many evaluations are left.
    evaluations: AtomicI64,
}

/// The keys of the channels of a node, its rest transform, and whether all keys follow their curves.
struct NodeKeys {
    rest: Transform,
    translation: FollowedKeys,
    rotation: FollowedKeys,
    scale: FollowedKeys,
    is_whole: bool,
}

impl NodeKeys {
    fn rests(&self) -> bool {
        let channels = [&self.translation, &self.rotation, &self.scale];
        channels
            .iter()
            .all(|keys| matches!(keys, FollowedKeys::Rest(_)))
    }
}

/// The channels that an evaluation computes: bits of `ufbx`'s `TransformFlags`, which the crate does not publish.
const EXPLICIT: u32 = 0x4;
const TRANSLATION: u32 = 0x10;
const ROTATION: u32 = 0x20;
const SCALE: u32 = 0x40;

/// A channel: its flag, and the value in a transform.
type ChannelOf = (u32, ChannelKind, fn(&Transform) -> ChannelValue);

const CHANNELS: [ChannelOf; 3] = [
    (TRANSLATION, ChannelKind::Vector, |all| {
        DVec4::new(all.translation.x, all.translation.y, all.translation.z, 0.0)
    }),
    (ROTATION, ChannelKind::Rotation, |all| {
        let q = &all.rotation;
        DVec4::new(q.x, q.y, q.z, q.w)
    }),
    (SCALE, ChannelKind::Vector, |all| {
        DVec4::new(all.scale.x, all.scale.y, all.scale.z, 0.0)
    }),
];

impl FbxReader<'_> {
    fn refuse(&self, stack: usize, code: Code, message: impl Into<String>) -> Diagnostic {
        let name = self.scene.anim_stacks[stack].element.name.to_string();
        Diagnostic::new(self.name, code, message).inside(name)
    }

    fn clip(&self, stack: usize, warnings: &mut Warnings) -> Result<Motion, Diagnostic> {
        let over = |error: OverBudget| self.refuse(stack, Code::Memory, error.to_string());
        let (scene, tracks) = (self.scene, &self.nodes.tracks);
        self.budget.take(tracks.len(), TRACK).map_err(over)?;
        // Memory for the names of the tracks, which each clip contains.
        let names = self.nodes.names.iter().map(String::len).sum();
        self.budget.take(names, 1).map_err(over)?;
        let anim_stack = &scene.anim_stacks[stack];
        let layers = StackLayers::of(scene, anim_stack, self.budget);
        let layers = layers.map_err(|fault| match fault {
            LayerFault::Ufbx(error) => no_anim(self.name, &error),
            LayerFault::Memory(error) => over(error),
        })?;
        let takes = Takes::of(scene, anim_stack, &layers.audible, self.budget).map_err(over)?;
        if let Some(TimeDisorder {
            property,
            node,
            times: [time, next],
        }) = &takes.disorder
        {
            let message = format!(
                "the key times of `{property}` of `{node}` do not increase: {time} s is followed by {next} s; export \
                 the file again"
            );
            return Err(self.refuse(stack, Code::TimeNotIncreasing, message));
        }
        let takes = self.on_frames(takes);
        self.warn_of_takes(stack, &takes, warnings);
        // One limit for all threads, because they take memory in any order.
        let max_keys = usize::try_from(self.budget.left() / KEY as u64).unwrap_or(usize::MAX);
        let follower = StackFollower {
            reader: self,
            stack,
            takes: &takes,
            layers: &layers,
            max_keys,
        };
        let nodes: Vec<Result<NodeKeys, Diagnostic>> =
            tracks.par_iter().map(|&node| follower.node(node)).collect();
        let mut clip = Motion {
            name: Some(scene.anim_stacks[stack].element.name.to_string())
                .filter(|name| !name.is_empty()),
            index: stack,
            ..Motion::default()
        };
        let mut nodes: Vec<NodeKeys> = nodes.into_iter().collect::<Result<_, _>>()?;
        let [start, end] = takes.span.map(|time| self.clip_time(time, takes.grid));
        // If nothing moves in a take, its first track gets a key at both ends. This stores the length of the take.
        if start < end
            && nodes.iter().all(NodeKeys::rests)
            && let Some(NodeKeys { rotation, .. }) = nodes.first_mut()
            && let FollowedKeys::Rest(value) = *rotation
        {
            *rotation = FollowedKeys::Linear(vec![(start, value), (end, value)]);
        }
        for (track, keys) in nodes.into_iter().enumerate() {
            if !keys.is_whole {
                warnings.warn(Code::FbxWild, || {
                    let message = format!(
                        "the curves of `{}` change too fast; between some keys they are only approximated",
                        self.nodes.names[track]
                    );
                    (None, message)
                });
            }
            let parent = scene.nodes[tracks[track]].parent.as_deref();
            let parent =
                parent.and_then(|parent| self.nodes.track_of[parent.element.typed_id as usize]);
            let too_large = |reason: String| {
                let message = format!("`{}`: {reason}", self.nodes.names[track]);
                self.refuse(stack, Code::TooLarge, message)
            };
            let rest = self
                .push(&mut clip, parent, start, keys)
                .map_err(|error| too_large(error.to_string()))?;
            if !(rest.translation.is_finite() && rest.scale.is_finite()) {
                let reason = "a number passes the largest f32, 3.4e38".to_owned();
                return Err(too_large(reason));
            }
        }
        // Keys that were added to follow a curve may be at frames of another rate, which is not the clip's.
        let is_of_file = |rate: &FrameRate| [self.rate, takes.rate].contains(&Some(*rate));
        clip.rate = clip.rate_of_keys().filter(is_of_file);
        Ok(clip)
    }

    /// Finds the rate of the keys, and moves the ends of the clip to frames of it if they were rounded to f32.
    fn on_frames(&self, mut takes: Takes) -> Takes {
        // FBX counts time in units of 2.2e-11 s.
        const TICKS: Precision = Precision::Decimals(10);
        let found = of(&RateSource::Times(&takes.keys, TICKS));
        takes.rate = found.and_then(FrameGrid::rate);
        let keys = || takes.keys.iter().flatten().copied();
        let fits = |rate: &FrameRate| on_frames(keys(), *rate, 0.0, TICKS);
        let found = found.filter(|found| found.phase == 0.0);
        takes.grid = (self.rate.filter(fits)).or(found.map(|found| found.grid));
        if let Some(grid) = takes.grid.filter(|_| !self.options.raw_times) {
            takes.span = takes.span.map(|time| {
                let frame = frame_time(grid, 0.0, time);
                match was_rounded(time, frame) && (time - frame).abs() > times::SAME {
                    true => frame,
                    false => time,
                }
            });
        }
        takes
    }

    fn warn_of_takes(&self, stack: usize, takes: &Takes, warnings: &mut Warnings) {
        let stack = &self.scene.anim_stacks[stack];
        let inside = || Some(Location::Inside(stack.element.name.to_string()));
        if let Some(layer) = stack.layers.iter().find(|layer| is_solo(layer)) {
            warnings.warn(Code::FbxSolo, || {
                let layer = &layer.element.name;
                (
                    inside(),
                    format!("the layer `{layer}` is set to play alone (Solo); all layers that are not muted are read"),
                )
            });
        }
        if takes.outside > 0 {
            warnings.warn(Code::FbxOutside, || {
                let [begin, end] = takes.span;
                let keys = match takes.outside {
                    1 => "1 key lies".to_owned(),
                    count => format!("{count} keys lie"),
                };
                (
                    inside(),
                    format!(
                        "{keys} outside the take ({begin} to {end} s); the motion there is left out"
                    ),
                )
            });
        }
        if !takes.others.is_empty() {
            warnings.warn(Code::FbxProperties, || {
                let names: Vec<String> = takes
                    .others
                    .iter()
                    .map(|name| format!("`{name}`"))
                    .collect();
                (
                    inside(),
                    format!(
                        "curves that move something other than a transform are left out: {}",
                        names.join(", ")
                    ),
                )
            });
        }
        if takes.nodes.values().all(NodeTimes::is_empty) {
            let message = match takes.has_curves {
                true => "the stack is a pose: each of its curves has one key; nothing moves",
                false => "the stack moves no node; nothing moves",
            };
            warnings.warn(Code::FbxRests, || (inside(), message));
        }
    }

    /// A time of the file, moved to the frame from which it was rounded: ticks do not represent frames of 29.97
    /// exactly.
    fn clip_time(&self, time: f64, grid: Option<FrameRate>) -> f64 {
        let tick = 1.1 / self.scene.metadata.ktime_second.max(1) as f64;
        let frame = grid.map(|rate| frame_time(rate, 0.0, time));
        let is_near = |frame: &f64| (frame - time).abs() <= tick && !self.options.raw_times;
        frame.filter(is_near).unwrap_or(time)
    }

    /// Adds the track of a node to a clip; returns its rest transform.
    fn push(
        &self,
        clip: &mut Motion,
        parent: Option<usize>,
        start: f64,
        keys: NodeKeys,
    ) -> Result<motion::Transform, TrackError> {
        let track = clip.set.track_count();
        let name = &self.nodes.names[track];
        let mut channels = Channels::default();
        let [translation, rotation, scale] = CHANNELS.map(|channel| (channel.2)(&keys.rest));
        let quat = |value: ChannelValue| unit(DQuat::from_vec4(value));
        let resting = quat(rotation);
        match keys.rotation {
            FollowedKeys::Rest(value) => {
                let key = quat(value);
                // All clips of a file share the rest poses of nodes. If a node rests in another pose in this clip, it
                // gets a key.
                if key != resting && key != -resting {
                    channels.rotation = Some(ChannelInterpolation::Linear);
                }
                clip.set.push(name, &[start], &[key])?;
            }
            FollowedKeys::Step(keys) => {
                channels.rotation = Some(ChannelInterpolation::Step);
                let (times, values) = split(&keys, quat);
                clip.set.push(name, &times, &values)?;
            }
            FollowedKeys::Linear(keys) => {
                channels.rotation = Some(ChannelInterpolation::Linear);
                let (times, values) = split(&keys, quat);
                clip.set.push(name, &times, &values)?;
            }
            FollowedKeys::Cubic(keys) => {
                channels.rotation = Some(ChannelInterpolation::Cubic);
                let plain: Vec<(f64, ChannelValue)> =
                    keys.iter().map(|key| (key.0, key.1)).collect();
                let (times, values) = split(&plain, quat);
                clip.set.push(name, &times, &values)?;
                let tangents: Vec<[Quat; 2]> = keys
                    .iter()
                    .map(|key| key.2.map(|tangent| Quat::from_vec4(tangent.as_vec4())))
                    .collect();
                clip.set.set_tangents(track, &tangents)?;
            }
        }
        let (sampler, moved) = vectors(keys.translation, translation, start);
        channels.translation = sampler;
        let points: Vec<DVec3> = moved.values.iter().map(|value| value.truncate()).collect();
        let (origin, points) = relative(&points);
        if sampler.is_some() {
            clip.set
                .set_translations(track, &moved.times, &points, &moved.tangents)?;
        }
        let (sampler, scaled) = vectors(keys.scale, scale, start);
        channels.scale = sampler;
        let values = scaled.values.iter();
        let sizes: Vec<Vec3> = values.map(|value| value.truncate().as_vec3()).collect();
        if sampler.is_some() {
            clip.set
                .set_scales(track, &scaled.times, &sizes, &scaled.tangents)?;
        }
        let rest = motion::Transform {
            translation: (translation.truncate() - origin).as_vec3(),
            rotation: resting,
            scale: scale.truncate().as_vec3(),
        };
        clip.skeleton.push(Joint { parent, rest });
        clip.channels.push(channels);
        clip.set_origin(track, origin);
        Ok(rest)
    }
}

/// Follows the nodes of a stack, each on one of the threads.
struct StackFollower<'a> {
    reader: &'a FbxReader<'a>,
    stack: usize,
    takes: &'a Takes,
    layers: &'a StackLayers,
    /// The largest number of keys of a channel, for which there is memory.
    max_keys: usize,
}

impl StackFollower<'_> {
    /// The keys of a node.
    fn node(&self, node: usize) -> Result<NodeKeys, Diagnostic> {
        let (reader, takes) = (self.reader, self.takes);
        let none = ChannelTimes::default();
        let moved = takes.nodes.get(&node);
        let times = moved.map_or([&none; 3], |moved| {
            [&moved.translation, &moved.rotation, &moved.scale]
        });
        let evaluator = Evaluator::of(self, node);
        let mut lists = times.map(|times| times.within(takes.span));
        // A curve that never changes needs only its first key.
        for (list, channel) in lists.iter_mut().zip(CHANNELS) {
            if evaluator.is_still(channel.0) {
                list.truncate(1);
            }
        }
        let mut keys: [Option<FollowedKeys>; 3] = [None, None, None];
        let mut is_whole = true;
        for channel in 0..3 {
            if keys[channel].is_some() {
                continue;
            }
            // If channels have keys at the same times, they are evaluated together.
            let group: Vec<usize> = (channel..3)
                .filter(|&other| lists[other] == lists[channel])
                .collect();
            let jump = group.iter().any(|&channel| times[channel].jump);
            let found = self.follow(&evaluator, (&lists[channel], jump), &group)?;
            for (channel, (found, follows)) in group.into_iter().zip(found) {
                keys[channel] = Some(found);
                is_whole &= follows;
            }
        }
        let [Some(translation), Some(rotation), Some(scale)] = keys else {
            unreachable!("each channel is in a group");
        };
        let of_node = &reader.scene.nodes[node];
        let rest = match &reader.rests {
            Some(rests) if is_spheric(of_node) => ufbx::evaluate_transform(rests, of_node, 0.0),
            _ => of_node.local_transform,
        };
        Ok(NodeKeys {
            rest,
            translation,
            rotation,
            scale,
            is_whole,
        })
    }

    /// The keys of channels of a node that have the same key times.
    fn follow(
        &self,
        evaluator: &Evaluator<'_>,
        (times, jump): (&[f64], bool),
        group: &[usize],
    ) -> Result<Vec<(FollowedKeys, bool)>, Diagnostic> {
        let reader = self.reader;
        let memory = |error: OverBudget| reader.refuse(self.stack, Code::Memory, error.to_string());
        let _borrowed = reader.budget.borrow(times.len(), STOP).map_err(memory)?;
        let evaluate = |time: f64, flags: u32| evaluator.at(time, flags);
        let all = group
            .iter()
            .fold(0, |all, &channel| all | CHANNELS[channel].0);
        let stops = || {
            let mut at = Vec::with_capacity(times.len());
            let mut thirds = Vec::with_capacity(times.len());
            for (index, &time) in times.iter().enumerate() {
                let here = evaluate(time, all)?;
                let [before, after] = match jump {
                    true => {
                        let room = |other: Option<&f64>| {
                            let gap = other.map_or(f64::INFINITY, |other| (other - time).abs());
                            BESIDE.min(gap / 8.0)
                        };
                        let earlier = index.checked_sub(1).and_then(|index| times.get(index));
                        let (back, on) = (room(earlier), room(times.get(index + 1)));
                        [
                            if index == 0 {
                                here
                            } else {
                                evaluate(time - back, all)?
                            },
                            match index + 1 < times.len() {
                                true => evaluate(time + on, all)?,
                                false => here,
                            },
                        ]
                    }
                    false => [here; 2],
                };
                at.push([before, here, after]);
                if let Some(&next) = times.get(index + 1) {
                    let third = |u: f64| evaluate(time + u * (next - time), all);
                    thirds.push([third(1.0 / 3.0)?, third(2.0 / 3.0)?]);
                }
            }
            Ok((at, thirds))
        };
        let (at, thirds) = stops().map_err(|why| evaluator.refusal(why))?;
        let mut found = Vec::with_capacity(group.len());
        for &channel in group {
            let (flag, kind, part) = CHANNELS[channel];
            let one = |time: f64| Ok(part(&evaluate(time, flag)?));
            let channel_stops: Vec<KeyStop> = (times.iter().zip(&at))
                .map(|(&file, all)| {
                    stop(
                        file,
                        reader.clip_time(file, self.takes.grid),
                        kind,
                        all.each_ref().map(part),
                    )
                })
                .collect();
            let channel_thirds: Vec<[ChannelValue; 2]> = thirds
                .iter()
                .map(|both| both.each_ref().map(part))
                .collect();
            let follow = ChannelFollower {
                kind,
                value: &one,
                rate: self.takes.grid,
                keyframes: reader.options.keyframes,
                max_keys: self.max_keys,
            };
            let keys = follow.keys(&channel_stops, &channel_thirds);
            let keys = keys.map_err(|why| evaluator.refusal(why))?;
            let count = match &keys.0 {
                FollowedKeys::Rest(_) => 1,
                FollowedKeys::Step(keys) | FollowedKeys::Linear(keys) => keys.len(),
                FollowedKeys::Cubic(keys) => keys.len(),
            };
            reader.budget.take(count, KEY).map_err(memory)?;
            found.push(keys);
        }
        Ok(found)
    }
}

/// Evaluates the transforms of a node.
struct Evaluator<'a> {
    follower: &'a StackFollower<'a>,
    node: &'a Node,
    direct: Option<DirectEvaluator<'a>>,
    /// The cost of an evaluation: the layers that are evaluated.
    cost: i64,
    /// Evaluations that the reader has granted and that are not used yet.
    left: Cell<i64>,
}

/// How many evaluations are granted at once, because all threads share the count. Few, so that those which one thread
/// does not use are not missed by another.
const GRANTED: i64 = 64;

impl<'a> Evaluator<'a> {
    fn of(follower: &'a StackFollower<'a>, node: usize) -> Self {
        let (scene, layers) = (follower.reader.scene, follower.layers);
        let first = layers.audible.first().copied().unwrap_or(0);
        let layers_of_stack = &scene.anim_stacks[follower.stack].layers;
        let value = |index: usize| -> &'a AnimValue {
            &layers_of_stack[first].anim_props[index].anim_value
        };
        let properties = follower.takes.properties.get(&node);
        let node = &scene.nodes[node];
        let mut evaluator = Self {
            follower,
            node,
            direct: None,
            cost: layers.count(node).max(1) as i64,
            left: Cell::new(0),
        };
        let direct = properties.and_then(|properties| DirectEvaluator::of(node, properties, value));
        evaluator.direct = direct.filter(|direct| {
            let exact = |time| evaluator.exact(time, TRANSLATION | ROTATION | SCALE);
            direct.is(exact, follower.takes.span)
        });
        evaluator
    }

    /// The transform that `ufbx` computes.
    fn exact(&self, time: f64, flags: u32) -> Transform {
        let layers = self.follower.layers;
        let stack = &self.follower.reader.scene.anim_stacks[self.follower.stack];
        let anim = layers.anim(stack, self.node);
        let mut found = ufbx::evaluate_transform_flags(anim, self.node, time, EXPLICIT | flags);
        if flags & TRANSLATION != 0
            && let Some(off) = layers.weight_of_translation(stack, self.node, time)
        {
            found.translation.x += off.x;
            found.translation.y += off.y;
            found.translation.z += off.z;
        }
        found
    }

    /// # Errors
    /// When the work is too much, or when a number is not finite.
    fn at(&self, time: f64, flags: u32) -> Result<Transform, Unfollowed> {
        if self.left.get() == 0 {
            let granted = GRANTED * self.cost;
            let evaluations = &self.follower.reader.evaluations;
            if evaluations.fetch_sub(granted, Ordering::Relaxed) < 0 {
                return Err(Unfollowed::TooMuchWork);
            }
            self.left.set(GRANTED);
        }
        self.left.set(self.left.get() - 1);
        let found = match &self.direct {
            Some(direct) => direct.at(time, flags),
            None => self.exact(time, flags),
        };
        let is_finite = CHANNELS
            .iter()
            .all(|channel| (channel.2)(&found).is_finite());
        match is_finite {
            true => Ok(found),
            false => Err(Unfollowed::NotFinite { time }),
        }
    }

    /// Whether the channels of these flags are constant.
    fn is_still(&self, flags: u32) -> bool {
        let direct = self.direct.as_ref();
        direct.is_some_and(|direct| direct.is_still(flags))
    }

    /// The refusal of the stack, because the node cannot be followed.
    fn refusal(&self, why: Unfollowed) -> Diagnostic {
        let name = &*self.node.element.name;
        let (code, message) = match why {
            Unfollowed::NotFinite { time } => (
                Code::NotFinite,
                format!("`{name}` has no finite transform at {time} s"),
            ),
            Unfollowed::TooManyKeys => (
                Code::Memory,
                format!(
                    "the curves of `{name}` need more than {} keys, more than the memory limit for an input of this \
                     length allows; is an angle damaged?",
                    self.follower.max_keys
                ),
            ),
            Unfollowed::TooMuchWork => (
                Code::FbxWork,
                "following the curves takes more work than is allowed for a file of this length; is it damaged?"
                    .to_owned(),
            ),
        };
        self.follower
            .reader
            .refuse(self.follower.stack, code, message)
    }
}

impl Drop for Evaluator<'_> {
    /// Returns the granted evaluations that were not used.
    fn drop(&mut self) {
        let left = self.left.get() * self.cost;
        let evaluations = &self.follower.reader.evaluations;
        evaluations.fetch_add(left, Ordering::Relaxed);
    }
}

/// The stop of one channel. All sides have continued signs; sides that differ only by rounding become equal.
fn stop(
    file: f64,
    clip: f64,
    kind: ChannelKind,
    [before, at, after]: [ChannelValue; 3],
) -> KeyStop {
    let beside = |value: ChannelValue| {
        let value = match kind {
            ChannelKind::Rotation if value.dot(at) < 0.0 => -value,
            _ => value,
        };
        // A change within 1e-10 s is that of a curve, not a jump.
        let is_same = (value - at).abs().max_element() <= 1e-7 * at.abs().max_element().max(1e-3);
        if is_same { at } else { value }
    };
    KeyStop {
        file,
        clip,
        before: beside(before),
        at,
        after: beside(after),
    }
}

fn split<T>(keys: &[(f64, ChannelValue)], value: impl Fn(ChannelValue) -> T) -> (Vec<f64>, Vec<T>) {
    keys.iter().map(|key| (key.0, value(key.1))).unzip()
}

/// The keys of a translation or a scale.
struct VectorKeys {
    times: Vec<f64>,
    values: Vec<ChannelValue>,
    tangents: Vec<[Vec3; 2]>,
}

/// The keys and their interpolation; `None` for a channel that is constant at its rest value.
fn vectors(
    keys: FollowedKeys,
    rest: ChannelValue,
    start: f64,
) -> (Option<ChannelInterpolation>, VectorKeys) {
    let plain = |keys: Vec<(f64, ChannelValue)>| {
        let (times, values) = keys.into_iter().unzip();
        VectorKeys {
            times,
            values,
            tangents: Vec::new(),
        }
    };
    match keys {
        FollowedKeys::Rest(value) => {
            let sampler =
                (value.as_vec4() != rest.as_vec4()).then_some(ChannelInterpolation::Linear);
            (sampler, plain(vec![(start, value)]))
        }
        FollowedKeys::Step(keys) => (Some(ChannelInterpolation::Step), plain(keys)),
        FollowedKeys::Linear(keys) => (Some(ChannelInterpolation::Linear), plain(keys)),
        FollowedKeys::Cubic(keys) => {
            let tangents = keys
                .iter()
                .map(|key| key.2.map(|tangent| tangent.truncate().as_vec3()));
            let tangents = tangents.collect();
            let keys = keys.iter().map(|key| (key.0, key.1)).collect();
            (
                Some(ChannelInterpolation::Cubic),
                VectorKeys {
                    tangents,
                    ..plain(keys)
                },
            )
        }
    }
}
