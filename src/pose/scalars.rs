//! Scalars at samples, and velocities and accelerations of scalars and vectors.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::{ScalarQuantity, VectorMethod};
use crate::output::buffer::OutputBuffer;
use crate::output::rotations::{Layout, Samples, Vectors};
use crate::output::scalars::Scalars;
use crate::prepare::clip_data::ClipData;
use crate::prepare::vectors::VectorRequest;
use crate::threads::on_threads;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::set::TrackSet;
use crate::tracks::set::vectors::Channel;

impl Engine {
    /// Evaluates the scalars of a set ([`TrackSet::push_scalar`]), or how fast they change, at every sample. They are
    /// interpolated by `method`, with the ends and wrap modes of `interpolation`.
    ///
    /// Velocities are derivatives of the curve, not differences of samples. `BesselOverhauser` has continuous
    /// velocities, `C2` also continuous accelerations.
    ///
    /// ```
    /// use tumble::{Device, Engine, Layout, SampleTimes, ScalarQuantity, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// for joint in ["hip", "knee"] {
    ///     set.push_scalar(joint, &[0.0, 1.0, 2.0], &[0.0, 1.0, 4.0], &[])?;
    /// }
    /// let engine = Engine::new(Device::Cpu)?;
    /// let (frames, layout) = (SampleTimes::fps(2), Layout::FrameMajor);
    /// let how = VectorMethod::BesselOverhauser;
    /// let rates = engine.scalars(&set, ScalarQuantity::Velocity, how, method::SLERP, &frames, layout)?;
    /// assert_eq!(rates.get(1, 2), Some(2.0)); // the parabola's slope after a second
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Engine::evaluate`]. Times for each track are times for each scalar.
    pub fn scalars(
        &self,
        set: &TrackSet,
        quantity: ScalarQuantity,
        method: VectorMethod,
        interpolation: impl Into<Interpolation>,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Scalars, Error> {
        let interpolation = interpolation.into();
        let count = set.scalar_count();
        let timeline = times.resolve(count, set.time_span())?;
        let request = self.vector_request(quantity, method, &interpolation, &timeline)?;
        let packs = set.scalar_packs(timeline.is_per_track());
        let data = ClipData::of_scalars(set, &packs, &request)?;
        let key_times = |pack: usize| set.scalar(packs[pack]).map_or(&[][..], |first| first.times);
        let of_packs = self.vector_samples(data, &request, &timeline, layout, key_times)?;
        let samples = timeline.len();
        let mut scalars = Scalars::new(count, samples, layout)?;
        let pack_of = |scalar: usize| packs.partition_point(|&first| first <= scalar) - 1;
        let components: Vec<Component> = (0..count)
            .map(|scalar| Component {
                pack: pack_of(scalar),
                index: scalar - packs[pack_of(scalar)],
            })
            .collect();
        let (vectors, width) = (of_packs.as_arrays(), of_packs.track_count());
        let values = scalars.as_mut_slice();
        on_threads(|| match layout {
            Layout::TrackMajor => {
                let rows = values.par_chunks_mut(samples.max(1)).zip(&components);
                rows.for_each(|(row, component)| {
                    let vectors = &vectors[component.pack * samples..];
                    for (value, vector) in row.iter_mut().zip(vectors) {
                        *value = vector[component.index];
                    }
                });
            }
            Layout::FrameMajor => {
                let frames = values.par_chunks_mut(count.max(1)).with_min_len(MIN_FRAMES);
                frames.zip(vectors.par_chunks(width.max(1))).for_each(
                    |(values, vectors): (&mut [f32], &[[f32; 4]])| {
                        for (value, component) in values.iter_mut().zip(&components) {
                            *value = vectors[component.pack][component.index];
                        }
                    },
                );
            }
        })?;
        Ok(scalars)
    }

    /// Evaluates how fast the translations or scales of a set change, in its units per second (squared), by the
    /// rules of [`ScalarQuantity`]; otherwise as [`Engine::vectors`]. A track without such keys has zeros.
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    #[expect(
        clippy::too_many_arguments,
        reason = "those of `vectors`, and the quantity"
    )]
    pub fn vector_rates(
        &self,
        set: &TrackSet,
        channel: Channel,
        quantity: ScalarQuantity,
        method: VectorMethod,
        interpolation: impl Into<Interpolation>,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        let interpolation = interpolation.into();
        let tracks = set.track_count();
        let timeline = times.resolve(tracks, set.time_span())?;
        let request = self.vector_request(quantity, method, &interpolation, &timeline)?;
        let data = ClipData::of_vectors(set, channel, &request)?;
        let key_times =
            |track: usize| (set.vectors(channel, track)).map_or(&[][..], |keys| &keys.times);
        self.vector_samples(data, &request, &timeline, layout, key_times)
    }

    /// Evaluates prepared vectors. `times` are the key times of a track, empty if it has none: in mirrored copies of
    /// it velocities have the other sign.
    fn vector_samples<'t>(
        &self,
        data: ClipData,
        request: &VectorRequest<'_>,
        timeline: &Timeline,
        layout: Layout,
        times: impl Fn(usize) -> &'t [f64],
    ) -> Result<Vectors, Error> {
        let found: Vectors = self.clip_of(data)?.samples(timeline, layout)?;
        if request.quantity != ScalarQuantity::Velocity || !request.interpolation.mirrors() {
            return Ok(found);
        }
        let (wrap, tracks, samples) = (
            request.interpolation.wrap(),
            found.track_count(),
            found.sample_count(),
        );
        let mut quats = OutputBuffer::new(tracks * samples)?;
        let vectors: &mut [[f32; 4]] = bytemuck::cast_slice_mut(&mut quats);
        vectors.copy_from_slice(found.as_arrays());
        for track in 0..tracks {
            let &[first, .., last] = times(track) else {
                continue;
            };
            let backwards =
                |&sample: &usize| wrap.is_backwards((first, last), timeline, track, sample);
            for sample in (0..samples).filter(backwards) {
                let vector = &mut vectors[layout.offset(track, sample, tracks, samples)];
                // Not `-x`, which would change 0 to -0.
                *vector = vector.map(|x| 0.0 - x);
            }
        }
        Ok(Samples::new(Box::new(quats), tracks, samples, layout))
    }

    /// The request by which vectors or scalars are prepared for these samples alone.
    pub(super) fn vector_request<'a>(
        &self,
        quantity: ScalarQuantity,
        method: VectorMethod,
        interpolation: &'a Interpolation,
        only_for: &'a Timeline,
    ) -> Result<VectorRequest<'a>, Error> {
        interpolation.check()?;
        Ok(VectorRequest {
            quantity,
            method,
            interpolation,
            group_bytes: self.machine.limits().group_bytes,
            only_for: Some(only_for),
        })
    }
}

/// Frames that a task copies at least.
const MIN_FRAMES: usize = 1024;

/// Where a scalar is evaluated: as a component of a pack's vector.
struct Component {
    pack: usize,
    index: usize,
}
