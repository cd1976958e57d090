//! Local to model: conversion of the transforms of a skeleton's joints from their parents' frames to matrices in the
//! model's frame.

use glam::{Affine3A, Vec3};
use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::math::canonical::canonical;
use crate::memory::zeroed;
use crate::output::encoding::MatrixOrder;
use crate::output::pose_error::{PoseError, check_skeleton};
use crate::output::rotations::Layout;
use crate::pose::affine::{AffineMatrix as _, AffineRows};
use crate::pose::skeleton::Skeleton;
use crate::pose::transforms::Transforms;
use crate::shader::{Link, ROOT};
use crate::twin::matrix;

impl Engine {
    /// Computes model matrices along a skeleton: `M = M_parent T R S` for every joint, from its translation, rotation
    /// and scale. With inverse bind matrices `B`, one for each track, the result is `M B`, with which renderers skin
    /// vertices.
    ///
    /// For tracks with translation keys, the translation replaces the skeleton's offset, as in glTF and BVH; other
    /// tracks keep their offsets. For every device the host computes the matrices in f32, so the bits are the same.
    ///
    /// ```
    /// # use glam::{Quat, Vec3};
    /// # use tumble::{Device, Engine, SampleTimes, Layout, Skeleton, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// set.push("hip", &[0.0], &[Quat::IDENTITY])?;
    /// set.push("knee", &[0.0], &[Quat::IDENTITY])?;
    /// set.set_translations(0, &[0.0, 1.0], &[[0.0, 1.0, 0.0], [0.0, 1.0, 1.0]], &[])?;
    /// let offsets = vec![Vec3::ZERO, Vec3::new(0.0, -0.5, 0.0)];
    /// let skeleton = Skeleton::new(vec![None, Some(0)], offsets)?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let (frames, layout) = (SampleTimes::at(vec![0.75]), Layout::FrameMajor);
    /// let local = engine.transforms(&set, method::SLERP, VectorMethod::Linear, &frames, layout)?;
    /// let model = engine.local_to_model(&local, &skeleton, None)?;
    /// assert_eq!(model.position(0, 0), Some(Vec3::new(0.0, 1.0, 0.75)));
    /// assert_eq!(model.position(1, 0), Some(Vec3::new(0.0, 0.5, 0.75)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// * When translations, rotations and scales differ in the number of tracks or samples.
    /// * When the skeleton, the inverse bind matrices or `has_translation` have another number of joints than there are
    ///   tracks.
    /// * When there is not enough memory.
    #[doc(alias = "skinning")]
    #[doc(alias = "model space")]
    #[doc(alias = "object space")]
    pub fn local_to_model(
        &self,
        local: &Transforms,
        skeleton: &Skeleton,
        inverse_bind: Option<&[Affine3A]>,
    ) -> Result<ModelMatrices, Error> {
        let (tracks, samples) = (
            local.rotations.track_count(),
            local.rotations.sample_count(),
        );
        check(local)?;
        check_skeleton(skeleton.len(), tracks)?;
        if let Some(bind) = inverse_bind
            && bind.len() != tracks
        {
            let matrices = bind.len();
            return Err(PoseError::InverseBind { matrices, tracks }.into());
        }
        let count = tracks.saturating_mul(samples);
        let mut matrices: Vec<AffineRows> = zeroed(count, "model matrices")?;
        let links = skeleton.links();
        let bind: Option<Vec<AffineRows>> =
            inverse_bind.map(|all| all.iter().map(|matrix| matrix.rows()).collect());
        let walk_all = || {
            let frames = matrices.par_chunks_mut(tracks.max(1)).enumerate();
            frames.for_each(|(sample, model)| {
                for link in links {
                    walk(local, link, sample, model);
                }
                for (matrix, bind) in model.iter_mut().zip(bind.iter().flatten()) {
                    *matrix = product(matrix, bind);
                }
                for number in model.as_flattened_mut().as_flattened_mut() {
                    *number = canonical(*number);
                }
            });
        };
        self.machine.threads().run(walk_all)?;
        Ok(ModelMatrices {
            matrices,
            tracks,
            samples,
        })
    }
}

/// Refuses translations, rotations and scales of different shapes.
fn check(local: &Transforms) -> Result<(), PoseError> {
    let first = local.rotations.shape();
    let others = [local.translations.shape(), local.scales.shape()];
    if let Some(index) = others.iter().position(|shape| *shape != first) {
        return Err(PoseError::Shape {
            layer: index + 1,
            shape: others[index],
            first,
        });
    }
    let (entries, tracks) = (local.has_translation.len(), local.rotations.track_count());
    match entries == tracks {
        true => Ok(()),
        false => Err(PoseError::HasTranslation { entries, tracks }),
    }
}

/// Computes the matrix of one joint; the matrix of its parent is known.
fn walk(local: &Transforms, link: &Link, sample: usize, model: &mut [AffineRows]) {
    let (track, layout) = (link.track as usize, local.rotations.layout());
    let (tracks, samples) = (
        local.rotations.track_count(),
        local.rotations.sample_count(),
    );
    let index = layout.offset(track, sample, tracks, samples);
    let [sx, sy, sz, _] = local.scales.as_arrays()[index];
    let [tx, ty, tz, _] = local.translations.as_arrays()[index];
    let translation = match local.has_translation[track] {
        true => [tx, ty, tz],
        false => link.offset,
    };
    let rotated = matrix::rows(
        local.rotations.as_arrays()[index],
        MatrixOrder::RowMajor as u32,
    );
    let row = |i: usize| {
        let [x, y, z]: [f32; 3] = rotated[i];
        [x * sx, y * sy, z * sz, translation[i]]
    };
    let relative = [row(0), row(1), row(2)];
    model[track] = match link.parent {
        ROOT => relative,
        parent => product(&model[parent as usize], &relative),
    };
}

/// The product of two affine matrices.
fn product(a: &AffineRows, b: &AffineRows) -> AffineRows {
    a.map(|[x, y, z, moved]| {
        let [mut row, second, third] = *b;
        for ((first, second), third) in row.iter_mut().zip(second).zip(third) {
            *first = (x * *first + y * second) + z * third;
        }
        row[3] += moved;
        row
    })
}

/// The matrix of every joint at every sample, `[sample][track]`: three rows of four numbers, for column vectors. The
/// last column is the translation.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelMatrices {
    matrices: Vec<AffineRows>,
    tracks: usize,
    samples: usize,
}

impl ModelMatrices {
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

    /// All matrices, `[sample][track][row][column]`, the memory layout of row-major 3 × 4 matrices in shaders.
    #[must_use]
    pub fn as_arrays(&self) -> &[[[f32; 4]; 3]] {
        &self.matrices
    }

    /// The matrix of a track at a sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Affine3A> {
        let [x, y, z] = *self.rows_of(track, sample)?;
        let column = |i: usize| [x[i], y[i], z[i]];
        let columns = [column(0), column(1), column(2), column(3)];
        Some(Affine3A::from_cols_array_2d(&columns))
    }

    /// The position of a track's origin in the model at a sample; `None` out of range.
    #[must_use]
    pub fn position(&self, track: usize, sample: usize) -> Option<Vec3> {
        let rows = self.rows_of(track, sample)?;
        Some(Vec3::from_array(rows.map(|[.., moved]| moved)))
    }

    fn rows_of(&self, track: usize, sample: usize) -> Option<&AffineRows> {
        let index = Layout::FrameMajor.index(track, sample, self.tracks, self.samples)?;
        Some(&self.matrices[index])
    }
}
