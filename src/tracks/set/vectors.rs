//! Translations and scales: keys of tracks in addition to rotations, at separate times.

use std::sync::Arc;

use glam::{Quat, Vec3};

use crate::names::names;
use crate::tracks::error::TrackError;
use crate::tracks::set::{TrackSet, check_finite, check_length, check_times};

/// Keys of a translation or of a scale.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VectorTrack {
    pub(crate) times: Vec<f64>,
    pub(crate) keys: Vec<Vec3>,
    /// The incoming and outgoing tangent of each key, units per second; empty if none were set.
    pub(crate) tangents: Vec<[Vec3; 2]>,
    /// Upward directions at the keys of a path; empty if none were set.
    pub(crate) ups: Vec<Option<Vec3>>,
}

/// The largest magnitude of a component of a vector or of its tangent. With it, curves between keys are finite.
const LARGEST_VECTOR: f64 = 1e30;

/// The vectors of a set's tracks, `None` for a track without vectors. The list may be shorter than the set.
pub(crate) type VectorTracks = Vec<Option<Arc<VectorTrack>>>;

/// A kind of a track's vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// The translation of the track's origin.
    Translation,
    /// The scale along the axes.
    Scale,
}

names! {
    Channel, "channel",
    Translation => "translation",
    Scale => "scale",
}

/// The keys of one track's translation or scale, borrowed from its [`TrackSet`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VectorKeys<'a> {
    /// Key times in seconds, strictly increasing.
    pub times: &'a [f64],
    /// One vector for each time.
    pub keys: &'a [Vec3],
    /// The incoming and outgoing tangent of each key, units per second; empty if none were set.
    pub tangents: &'a [[Vec3; 2]],
}

impl TrackSet {
    /// Sets the translation keys of a track, [`Vec3`] or `[f32; 3]`. `times` are seconds, strictly increasing, and
    /// may differ from the times of rotations.
    ///
    /// `tangents` may be empty. They are pairs (incoming, outgoing) in units per second, for
    /// [`VectorMethod::GltfCubic`](crate::method::vector_method::VectorMethod::GltfCubic).
    ///
    /// ```
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::{Channel, Device, Engine, SampleTimes, Layout, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// set.push("hip", &[0.0], &[Quat::IDENTITY])?;
    /// set.set_translations(0, &[0.0, 2.0], &[[0.0, 1.0, 0.0], [4.0, 1.0, 0.0]], &[])?;
    /// let (channel, how) = (Channel::Translation, VectorMethod::Linear);
    /// let frames = SampleTimes::fps(1);
    /// let engine = Engine::new(Device::Cpu)?;
    /// let moved = engine.vectors(&set, channel, how, method::SLERP, &frames, Layout::TrackMajor)?;
    /// assert_eq!(moved.get(0, 1), Some(Vec3::new(2.0, 1.0, 0.0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When there is no such track, the lengths differ, the times are not strictly increasing, or a number is not
    /// finite or exceeds 1e30 in magnitude.
    pub fn set_translations<V: Copy + Into<Vec3>>(
        &mut self,
        track: usize,
        times: &[f64],
        keys: &[V],
        tangents: &[[Vec3; 2]],
    ) -> Result<(), TrackError> {
        self.set_vectors(Channel::Translation, track, times, keys, tangents)
    }

    /// Appends a track for a body that follows a path ([`Engine::follow`](crate::engine::Engine::follow)), and
    /// returns its index.
    ///
    /// The points are translation keys at `times` in seconds, strictly increasing; the track has no rotation keys
    /// except an identity. `ups` are upward directions at some points: it is empty, or has one entry for each point.
    ///
    /// # Errors
    /// * When there are no points, or the lengths of the lists differ.
    /// * When the times are not strictly increasing.
    /// * When a number is not finite or exceeds 1e30 in magnitude, or an upward direction has no length.
    pub fn push_path<V: Copy + Into<Vec3>>(
        &mut self,
        name: &str,
        times: &[f64],
        points: &[V],
        ups: &[Option<Vec3>],
    ) -> Result<usize, TrackError> {
        let track = self.track_count();
        check_times(track, times, points.len())?;
        let points: Vec<Vec3> = points.iter().map(|&point| point.into()).collect();
        if !ups.is_empty() {
            check_length(track, "upward directions", points.len(), ups.len())?;
        }
        let has_no_length = |up: &Option<Vec3>| {
            up.is_some_and(|up| !up.is_finite() || up.as_dvec3().length() == 0.0)
        };
        if let Some(key) = ups.iter().position(has_no_length) {
            return Err(TrackError::NoUp { track, key });
        }
        check_magnitudes(track, "point of the path", &points, &[], magnitude)?;
        self.push(name, &times[..1], &[Quat::IDENTITY])?;
        self.set_translations(track, times, &points, &[])?;
        if let Some(path) = &mut self.vectors[Channel::Translation as usize][track] {
            Arc::make_mut(path).ups = ups.to_vec();
        }
        Ok(track)
    }

    /// Sets the scale keys of a track; otherwise as [`TrackSet::set_translations`].
    ///
    /// # Errors
    /// As [`TrackSet::set_translations`].
    pub fn set_scales<V: Copy + Into<Vec3>>(
        &mut self,
        track: usize,
        times: &[f64],
        keys: &[V],
        tangents: &[[Vec3; 2]],
    ) -> Result<(), TrackError> {
        self.set_vectors(Channel::Scale, track, times, keys, tangents)
    }

    fn set_vectors<V: Copy + Into<Vec3>>(
        &mut self,
        channel: Channel,
        track: usize,
        times: &[f64],
        keys: &[V],
        tangents: &[[Vec3; 2]],
    ) -> Result<(), TrackError> {
        self.check_track(track)?;
        check_times(track, times, keys.len())?;
        let keys: Vec<Vec3> = keys.iter().map(|&key| key.into()).collect();
        if !tangents.is_empty() {
            check_length(track, "tangents", keys.len(), tangents.len())?;
        }
        check_magnitudes(track, "vector or its tangent", &keys, tangents, magnitude)?;
        self.widen_span(times);
        let tracks = self.track_count();
        let vectors = &mut self.vectors[channel as usize];
        if vectors.len() < tracks {
            vectors.resize(tracks, None);
        }
        vectors[track] = Some(Arc::new(VectorTrack {
            times: times.to_vec(),
            keys,
            tangents: tangents.to_vec(),
            ups: Vec::new(),
        }));
        Ok(())
    }

    /// The keys of a track's translation or scale; `None` if it has none.
    #[must_use]
    pub fn vector_keys(&self, channel: Channel, track: usize) -> Option<VectorKeys<'_>> {
        let vectors = self.vectors(channel, track)?;
        Some(VectorKeys {
            times: &vectors.times,
            keys: &vectors.keys,
            tangents: &vectors.tangents,
        })
    }

    /// A track's translations or scales, if it has any.
    pub(crate) fn vectors(&self, channel: Channel, track: usize) -> Option<&VectorTrack> {
        (self.vectors[channel as usize].get(track)?).as_deref()
    }
}

/// The largest magnitude of a vector's components; infinite if one is not finite.
fn magnitude(vector: &Vec3) -> f32 {
    match vector.is_finite() {
        true => vector.abs().max_element(),
        false => f32::INFINITY,
    }
}

/// Refuses keys and tangents that are not finite or too large, by their magnitude, which is infinite or NaN if they are
/// not finite.
pub(crate) fn check_magnitudes<T>(
    track: usize,
    quantity: &'static str,
    keys: &[T],
    tangents: &[[T; 2]],
    magnitude: impl Fn(&T) -> f32,
) -> Result<(), TrackError> {
    let is_finite = |value: &T| magnitude(value).is_finite();
    check_finite(track, quantity, keys, is_finite)?;
    check_finite(track, quantity, tangents, |both| both.iter().all(is_finite))?;
    let limit = LARGEST_VECTOR;
    let is_too_large = |value: &T| magnitude(value) > limit as f32;
    let key = keys.iter().position(is_too_large);
    let has_too_large = |both: &[T; 2]| both.iter().any(is_too_large);
    match key.or_else(|| tangents.iter().position(has_too_large)) {
        Some(key) => Err(TrackError::DataTooLarge {
            track,
            key,
            quantity,
            limit,
        }),
        None => Ok(()),
    }
}
