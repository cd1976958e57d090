//! Poses computed from poses, on the engine's device: layers are blended, mixed or added, and rotations along a
//! skeleton are converted to rotations and positions in the world.

use glam::{Quat, Vec3};

use crate::cpu::engine::poses::set_all;
use crate::engine::Engine;
use crate::error::Error;
use crate::machine::error::EvaluateError;
use crate::machine::poses::{Pass, PassRunner};
use crate::memory::zeroed;
use crate::output::buffer::OutputBuffer;
use crate::output::pose_error::{
    PoseError, check_fraction, check_references, check_skeleton, check_weight_count, check_weights,
};
use crate::output::rotations::{Layout, Rotations};
use crate::pose::skeleton::Skeleton;
use crate::simd::dispatch::VectorWidth;
use crate::twin::{pose_blend, pose_mix};

/// The number of layers that are blended without an allocation.
const LAYERS_IN_ARRAYS: usize = 8;

/// The number of rotations that the host computes at once.
const HOST_WINDOW: usize = 1 << 20;

impl Engine {
    /// Blends layers: the normalised weighted sum of their rotations. Each layer's rotation has the sign that is
    /// nearer to the first layer's. The sum of the weights need not be 1. Results have no names, so tracks are combined
    /// by index; [`Joints::order_of`](crate::Joints::order_of) and [`TrackSet::select`](crate::TrackSet::select) bring
    /// the tracks of sets into one order before they are evaluated.
    ///
    /// # Errors
    /// When there is no layer, the layers' shapes differ, a weight is not finite or exceeds 1e9 in magnitude, or the
    /// device fails.
    pub fn blend(&self, layers: &[(&Rotations, f32)]) -> Result<Rotations, Error> {
        let Some((&(first, _), others)) = layers.split_first() else {
            return Err(PoseError::NoLayer.into());
        };
        for (index, &(layer, _)) in (1..).zip(others) {
            same_shape(first, layer, index)?;
        }
        let weights: Vec<f32> = layers.iter().map(|&(_, weight)| weight).collect();
        check_weights(&weights)?;
        let mut gathered: Vec<Quat> = Vec::new();
        self.each_rotation(first, layers.len(), |runner, start, output| {
            gathered.clear();
            for &(layer, _) in layers {
                gathered.extend_from_slice(&layer.as_quats()[start..start + output.len()]);
            }
            let layers = bytemuck::cast_slice(&gathered);
            let weights = &weights;
            runner.run(&Pass::Blend { layers, weights }, output)
        })
    }

    /// Mixes two results: slerp along the shorter arc from each rotation of `from` to that of `to`. `weight` is from
    /// 0 to 1. Tracks are combined by index, as in [`Engine::blend`].
    ///
    /// # Errors
    /// When the shapes differ, the weight is outside 0 to 1, or the device fails.
    pub fn mix(&self, from: &Rotations, to: &Rotations, weight: f32) -> Result<Rotations, Error> {
        same_shape(from, to, 1)?;
        check_fraction(weight)?;
        self.each_rotation(from, 1, |runner, start, output| {
            let [from, to] = [from, to].map(|layer| values(layer, start, output.len()));
            runner.run(&Pass::Mix { from, to, weight }, output)
        })
    }

    /// As [`Engine::blend`], with a weight for each rotation of each layer, in the order of the results. The results have the
    /// bits of `blend` with these weights; they are computed on the threads of the host, whatever the engine's device is.
    ///
    /// # Errors
    /// As [`Engine::blend`]; also when a layer does not have one weight for each rotation.
    pub fn blend_each(&self, layers: &[(&Rotations, &[f32])]) -> Result<Rotations, Error> {
        let Some((&(first, _), others)) = layers.split_first() else {
            return Err(PoseError::NoLayer.into());
        };
        for (index, &(layer, _)) in (1..).zip(others) {
            same_shape(first, layer, index)?;
        }
        for (index, &(layer, weights)) in layers.iter().enumerate() {
            check_weight_count(weights.len(), layer.as_arrays().len())?;
            check_weights(weights).map_err(|error| of_layer(error, index))?;
        }
        let count = layers.len();
        self.each_on_host(first, |index| {
            // Few layers are blended without an allocation.
            let mut poses = [[0.0; 4]; LAYERS_IN_ARRAYS];
            let mut weights = [0.0; LAYERS_IN_ARRAYS];
            if count > LAYERS_IN_ARRAYS {
                let poses: Vec<[f32; 4]> = layers
                    .iter()
                    .map(|(layer, _)| layer.as_arrays()[index])
                    .collect();
                let weights: Vec<f32> = layers.iter().map(|(_, weights)| weights[index]).collect();
                return pose_blend::pose(&poses, &weights, 1, 0);
            }
            for (at, (layer, of_layer)) in layers.iter().enumerate() {
                (poses[at], weights[at]) = (layer.as_arrays()[index], of_layer[index]);
            }
            pose_blend::pose(&poses[..count], &weights[..count], 1, 0)
        })
    }

    /// As [`Engine::mix`], with a weight for each rotation, in the order of the results. The results have the bits of `mix`
    /// with these weights; they are computed on the threads of the host, whatever the engine's device is.
    ///
    /// # Errors
    /// As [`Engine::mix`]; also when the number of weights is not the number of rotations.
    pub fn mix_each(
        &self,
        from: &Rotations,
        to: &Rotations,
        weights: &[f32],
    ) -> Result<Rotations, Error> {
        same_shape(from, to, 1)?;
        check_weight_count(weights.len(), from.as_arrays().len())?;
        weights
            .iter()
            .try_for_each(|&weight| check_fraction(weight))?;
        let [first, second] = [from, to].map(Rotations::as_arrays);
        self.each_on_host(from, |index| {
            pose_mix::pose(first[index], second[index], weights[index])
        })
    }

    /// Adds the difference of a layer from a reference to a base: `base · (reference⁻¹ layer)^weight`. The reference
    /// has one rotation for each track; the weight is from 0 to 1. Tracks are combined by index, as in
    /// [`Engine::blend`].
    ///
    /// # Errors
    /// When the shapes differ, there is not one reference rotation for each track, the weight is outside 0 to 1, or
    /// the device fails.
    #[doc(alias = "additive")]
    pub fn add(
        &self,
        base: &Rotations,
        layer: &Rotations,
        reference: &[Quat],
        weight: f32,
    ) -> Result<Rotations, Error> {
        same_shape(base, layer, 1)?;
        check_fraction(weight)?;
        check_references(reference.len(), base.track_count())?;
        let mut references: Vec<[f32; 4]> = Vec::new();
        self.each_rotation(base, 1, |runner, start, output| {
            references.clear();
            references.extend((start..start + output.len()).map(|index| {
                let track = match base.layout() {
                    Layout::TrackMajor => index / base.sample_count(),
                    Layout::FrameMajor => index % base.track_count(),
                };
                reference[track].to_array()
            }));
            references.push([weight, 0.0, 0.0, 0.0]);
            let [base, layer] = [base, layer].map(|layer| values(layer, start, output.len()));
            let references = &references;
            let pass = Pass::Add {
                base,
                layer,
                references,
            };
            runner.run(&pass, output)
        })
    }

    /// Converts rotations in their parents' frames to rotations and positions in the world, with the skeleton's
    /// offsets. [`Engine::local_to_model`] does this with translations and scales.
    ///
    /// ```
    /// # use glam::{Quat, Vec3};
    /// # use tumble::{Device, Engine, SampleTimes, Skeleton, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # let keys = [Quat::IDENTITY, Quat::from_rotation_z(std::f32::consts::FRAC_PI_2)];
    /// set.push("upper", &[0.0, 1.0], &keys)?;
    /// set.push("lower", &[0.0, 1.0], &[keys[0]; 2])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let local = engine.evaluate(&set, method::SLERP, &SampleTimes::fps(1))?;
    /// let world = engine.world(&local, &Skeleton::chain(2, 3.0)?)?;
    /// // The lower joint is at the end of the upper one, which has rotated aside.
    /// assert!(world.position(1, 1).unwrap().distance(Vec3::new(3.0, 0.0, 0.0)) < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the skeleton does not have one joint for each track, or the device fails.
    pub fn world(&self, local: &Rotations, skeleton: &Skeleton) -> Result<WorldPoses, Error> {
        let (tracks, samples) = (local.track_count(), local.sample_count());
        check_skeleton(skeleton.len(), tracks)?;
        let links = skeleton.links();
        let count = tracks.saturating_mul(samples).saturating_mul(2);
        let mut values: Vec<[f32; 4]> = zeroed(count, "poses in the world")?;
        let mut frame_major: Vec<[f32; 4]> = Vec::new();
        self.machine.passes(&mut |runner| {
            let frames = (runner.window() / (2 * tracks).max(1)).max(1);
            let windows = values.chunks_mut((2 * tracks * frames).max(1));
            for (first, output) in (0..).step_by(frames).zip(windows) {
                let count = output.len() / (2 * tracks);
                frame_major.clear();
                for frame in first..first + count {
                    let indices = (0..tracks)
                        .map(|track| local.layout().offset(track, frame, tracks, samples));
                    frame_major.extend(indices.map(|index| local.as_quats()[index].to_array()));
                }
                let local = &frame_major;
                runner.run(&Pass::World { local, links }, output)?;
            }
            Ok(())
        })?;
        Ok(WorldPoses {
            values,
            tracks,
            samples,
        })
    }

    /// Makes a result of the same shape as `like`, each rotation by its index, on the threads of the host.
    fn each_on_host(
        &self,
        like: &Rotations,
        pose: impl Fn(usize) -> [f32; 4] + Sync,
    ) -> Result<Rotations, Error> {
        let mut made = OutputBuffer::new(like.as_quats().len())?;
        for (start, output) in (0..).step_by(HOST_WINDOW).zip(made.chunks_mut(HOST_WINDOW)) {
            let output = bytemuck::cast_slice_mut(output);
            let threads = self.machine.threads();
            set_all(threads, VectorWidth::widest(), output, |index| {
                pose(start + index)
            })?;
        }
        let (tracks, samples, layout) = like.shape();
        Ok(Rotations::new(Box::new(made), tracks, samples, layout))
    }

    /// Makes a result of the same shape as `like`, some rotations at a time. `work` gets what runs its pass, the index
    /// of the first rotation, and the memory of the rotations. It reads `layers` values for each of them.
    fn each_rotation(
        &self,
        like: &Rotations,
        layers: usize,
        mut work: impl FnMut(&dyn PassRunner, usize, &mut [[f32; 4]]) -> Result<(), EvaluateError>,
    ) -> Result<Rotations, Error> {
        let mut made = OutputBuffer::new(like.as_quats().len())?;
        self.machine.passes(&mut |runner| {
            let max_len = (runner.window() / layers).clamp(1, usize::MAX / 4);
            for (start, output) in (0..).step_by(max_len).zip(made.chunks_mut(max_len)) {
                work(runner, start, bytemuck::cast_slice_mut(output))?;
            }
            Ok(())
        })?;
        let (tracks, samples, layout) = like.shape();
        Ok(Rotations::new(Box::new(made), tracks, samples, layout))
    }
}

/// Rotations and positions in the world, `[frame][track]`.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldPoses {
    /// The rotation and the position for each frame and track.
    values: Vec<[f32; 4]>,
    tracks: usize,
    samples: usize,
}

impl WorldPoses {
    /// Number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        self.tracks
    }

    /// Number of samples of each track.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.samples
    }

    /// The rotation of a track at a sample; `None` out of range.
    #[must_use]
    pub fn rotation(&self, track: usize, sample: usize) -> Option<Quat> {
        let index = self.index_of(track, sample)?;
        Some(Quat::from_array(self.values[index]))
    }

    /// The position of a track in the world at a sample; `None` out of range.
    #[must_use]
    pub fn position(&self, track: usize, sample: usize) -> Option<Vec3> {
        let [x, y, z, _] = self.values[self.index_of(track, sample)? + 1];
        Some(Vec3::new(x, y, z))
    }

    /// All values, `[frame][track]`: a rotation `x y z w` and a position `x y z 0` each.
    #[must_use]
    pub fn as_slice(&self) -> &[[f32; 4]] {
        &self.values
    }

    fn index_of(&self, track: usize, sample: usize) -> Option<usize> {
        let index = Layout::FrameMajor.index(track, sample, self.tracks, self.samples)?;
        Some(2 * index)
    }
}

/// Refuses a layer whose shape differs from the first layer's.
fn same_shape(first: &Rotations, other: &Rotations, layer: usize) -> Result<(), PoseError> {
    let (first, shape) = (first.shape(), other.shape());
    match first == shape {
        true => Ok(()),
        false => Err(PoseError::Shape {
            layer,
            shape,
            first,
        }),
    }
}

/// An error of the weights of a layer, which names an index among them.
fn of_layer(error: PoseError, layer: usize) -> PoseError {
    match error {
        PoseError::WeightNotFinite { weight, .. } => PoseError::WeightNotFinite { layer, weight },
        other => other,
    }
}

fn values(layer: &Rotations, start: usize, count: usize) -> &[[f32; 4]] {
    bytemuck::cast_slice(&layer.as_quats()[start..start + count])
}
