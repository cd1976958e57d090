//! Results of numbers: rotations in any representation, streamed as they come, and whole poses.

use glam::{DVec3, Quat, Vec3};
use tumble::method::SLERP;
use tumble::{Engine, Error, Layout, Quantity, SampleTimes, Timeline};
use tumble_formats::format::ResultShape;
use tumble_formats::motion::Motion;
use tumble_formats::origin::origin_of;
use tumble_formats::poses::{Poses, TRANSFORM, WORLD};
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::world::{HierarchyError, world};

use crate::arguments::output::PoseKind;
use crate::arguments::time;
use crate::batch::pipeline::EvaluatedResult;
use crate::batch::room;
use crate::batch::target::ResultTarget;
use crate::commands::eval::job::{EvaluationJob, EvaluationReport};
use crate::messages::exit::{ALL_INPUTS, Failure};

impl EvaluationJob<'_> {
    /// The rotations of one clip, or values derived from them.
    pub(super) fn rotations(
        &mut self,
        name: &str,
        clip: &Motion,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let (arguments, set) = (self.arguments, &clip.set);
        let samples = self.samples.of_clip(clip, name)?;
        self.in_gaps = samples.in_gaps;
        if samples.held.is_some() && arguments.output.quantity() != Quantity::Rotation {
            return Err(Failure::usage(format!(
                "{name}: a rotation that is held has no velocity; leave times in gaps out (--in-gaps leave-out)"
            )));
        }
        let frames = &samples.frames;
        let timeline = samples
            .written_times()
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        let encoding = arguments.output.encoding(arguments.encoding);
        target.has_room(name, set.track_count(), timeline.len(), encoding)?;
        let requested = arguments.layout;
        let mut notes = self.notes(name)?;
        if let time::SampleRequest::Rate { rate, .. } = self.samples {
            notes.push(("rate", rate.to_string()));
        }
        let format = target.results()?;
        let order = arguments.order().unwrap_or(format.order);
        let order = encoding.is_quaternion().then_some(order);
        notes.extend(order.map(|order| ("order", order.name().to_owned())));
        let result = ResultShape {
            name,
            set,
            timeline: &timeline,
            layout: format.layout.unwrap_or(requested),
            order,
            encoding,
            notes: &notes,
        };
        self.explain(name, clip, frames, result.layout)?;
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let size = (set.track_count(), timeline.len());
        let extent = (size.0, size.1, span(&timeline));
        let Some(method) = methods.method_of(clip) else {
            // Tracks of different samplers are evaluated apart, and put together in memory.
            room::in_memory(name, set, frames, 2)?;
            let found = self
                .device
                .choose(size.0 * size.1)
                .and_then(|()| {
                    let layout = result.layout;
                    let work = |engine: &Engine| match arguments.output.quantity() {
                        Quantity::Rotation => methods.rotations(engine, clip, frames, layout),
                        // Velocities are rows of four numbers too.
                        _ => {
                            let rates = methods.rates(engine, clip, frames, layout)?;
                            Ok(rates.into_iter().map(Quat::from_vec4).collect())
                        }
                    };
                    self.device.work(work)
                })
                .map_err(|error| Failure::evaluating(name, &error))?;
            let written = target.write_whole(&result, &found)?;
            let method = "each channel's own method";
            return Ok(self.evaluated(name, extent, method, written, target, order));
        };
        let interpolation = with(method);
        let written = target.write_rotations(&result, |sink| {
            self.device
                .stream(set, interpolation, frames, result.layout, sink)
        })?;
        Ok(self.evaluated(name, extent, method.name, written, target, order))
    }

    /// Whole poses, `[frame][track]`: along the clip's skeleton, or of the boxes of a chain, each of
    /// which hangs at the end of the one before it. All tracks are evaluated, since the position of a
    /// joint depends on its ancestors; the selected ones are written.
    pub(super) fn poses(
        &mut self,
        name: &str,
        clip: &Motion,
        kind: PoseKind,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let set = &clip.set;
        let samples = self.samples.of_clip(clip, name)?;
        self.in_gaps = samples.in_gaps;
        let frames = &samples.frames;
        let timeline = samples
            .written_times()
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        // The rotations, and twice what becomes of them.
        room::in_memory(name, set, frames, 8)?;
        self.check_scale(name, clip, true)?;
        self.explain(name, clip, frames, Layout::FrameMajor)?;
        let (mut numbers, mut origins) = if clip.skeleton.is_empty() && !clip.has_vectors() {
            (self.chain(name, clip, frames, kind)?, Vec::new())
        } else {
            if self.arguments.output.has_parents() {
                let message = "has a skeleton or positions already; leave out --parents";
                return Err(Failure::usage(format!("{name}: {message}")));
            }
            let samples = self.sample(name, clip, frames)?;
            numbers_of(clip, &samples, kind)
                .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?
        };
        let mut components = match kind {
            PoseKind::World => WORLD.to_vec(),
            PoseKind::Transform => TRANSFORM.to_vec(),
        };
        let width = components.len();
        let order = self.arguments.order().unwrap_or_default();
        if let Some(index) = components.iter().position(|name| *name == "x")
            && order == ComponentOrder::Wxyz
        {
            components[index..index + 4].rotate_right(1);
            let poses = numbers.chunks_exact_mut(width);
            poses.for_each(|pose| pose[index..index + 4].rotate_right(1));
        }
        let selected = self.arguments.inputs.tracks.of(clip, name)?;
        if let Some(tracks) = &selected {
            let frames = numbers.chunks_exact(width * set.track_count());
            let pose = |frame: &[f32], track: usize| frame[track * width..][..width].to_vec();
            let of_tracks =
                frames.flat_map(|frame| tracks.iter().flat_map(move |&track| pose(frame, track)));
            numbers = of_tracks.collect();
            if !origins.is_empty() {
                origins = tracks.iter().map(|&track| origins[track]).collect();
            }
        }
        let selection = selected.map(|tracks| set.select(tracks)).transpose();
        let subset = selection.map_err(|error| Failure::evaluating(name, &error.into()))?;
        let set = subset.as_ref().unwrap_or(set);
        let size = (set.track_count(), timeline.len(), span(&timeline));
        let poses = Poses {
            set,
            timeline: &timeline,
            components: &components,
            numbers: &numbers,
            origins: &origins,
        };
        let write = target.results()?.poses;
        let written = target.prepare(|out| write(&poses, out))?;
        let method = self.arguments.method.to_string();
        Ok(self.evaluated(name, size, &method, written, target, Some(order)))
    }

    /// The poses of boxes that hang at the ends of others.
    fn chain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
        kind: PoseKind,
    ) -> Result<Vec<f32>, Failure> {
        let set = &clip.set;
        let (tracks, length) = (
            set.track_count(),
            self.input.loaded.box_length.unwrap_or(1.0),
        );
        let (skeleton, offsets) = self
            .arguments
            .output
            .skeleton(tracks, length)
            .map_err(|message| Failure::usage(format!("{name}: {message}")))?;
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let interpolation = with(methods.method_of(clip).unwrap_or(SLERP));
        let samples = frames.resolve(tracks, set.time_span());
        let evaluated = samples.map_err(Error::from).and_then(|timeline| {
            self.device.choose(tracks * timeline.len())?;
            self.device.work(|engine| {
                let local = engine
                    .request(set, interpolation, frames)
                    .layout(Layout::FrameMajor)
                    .evaluate()?;
                match kind {
                    PoseKind::World => {
                        let world = engine.world(&local, &skeleton)?;
                        let numbers = world.as_slice().chunks_exact(2).flat_map(|pose| {
                            let ([x, y, z, w], [px, py, pz, _]) = (pose[0], pose[1]);
                            [px, py, pz, x, y, z, w]
                        });
                        Ok(numbers.collect::<Vec<f32>>())
                    }
                    PoseKind::Transform => {
                        let hung = offsets.iter().cycle();
                        let numbers = local.as_quats().iter().zip(hung).flat_map(|(q, at)| {
                            [at.x, at.y, at.z, q.x, q.y, q.z, q.w, 1.0, 1.0, 1.0]
                        });
                        Ok(numbers.collect())
                    }
                }
            })
        });
        evaluated.map_err(|error| Failure::evaluating(name, &error))
    }
}

/// The first and the last time of a result.
fn span(timeline: &Timeline) -> Option<(f64, f64)> {
    let last = timeline.len().checked_sub(1)?;
    Some((timeline.time(0, 0)?, timeline.time(0, last)?))
}

/// The numbers of the poses of a clip with a skeleton, or with translations or scales, and the origin of
/// each track.
fn numbers_of(
    clip: &Motion,
    samples: &Samples,
    kind: PoseKind,
) -> Result<(Vec<f32>, Vec<DVec3>), HierarchyError> {
    Ok(match kind {
        PoseKind::World => {
            let poses = world(clip, samples)?;
            let tracks = clip.set.track_count();
            let of_track = |track: usize| poses.iter().skip(track).step_by(tracks);
            let mut origins = Vec::new();
            if !clip.origins.is_empty() {
                let origin = |track| origin_of(of_track(track).map(|pose| pose.position));
                origins = (0..tracks).map(origin).collect();
            }
            let numbers = poses.iter().enumerate().flat_map(|(index, pose)| {
                let origin = origins.get(index % tracks).copied().unwrap_or_default();
                let [px, py, pz] = (pose.position - origin).as_vec3().to_array();
                let [x, y, z, w] = pose.rotation.to_array();
                [px, py, pz, x, y, z, w]
            });
            (numbers.collect(), origins)
        }
        PoseKind::Transform => {
            let at = |list: &[Vec3], index: usize| list.get(index).copied();
            let numbers = samples
                .rotations
                .iter()
                .enumerate()
                .flat_map(|(index, rotation)| {
                    let [tx, ty, tz] = at(&samples.translations, index)
                        .unwrap_or(Vec3::ZERO)
                        .to_array();
                    let [sx, sy, sz] = at(&samples.scales, index).unwrap_or(Vec3::ONE).to_array();
                    let [x, y, z, w] = rotation.to_array();
                    [tx, ty, tz, x, y, z, w, sx, sy, sz]
                });
            (numbers.collect(), clip.origins.clone())
        }
    })
}
