//! Translations and scales: keys that tracks may carry beside their rotations, at times
//! of their own.

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
    /// Tangents with which the curve arrives at each key and leaves it, units per second; empty if
    /// none were given.
    pub(crate) tangents: Vec<[Vec3; 2]>,
    /// Upward directions at the keys of a path; empty if none were given.
    pub(crate) ups: Vec<Option<Vec3>>,
}

/// The largest magnitude of a number of a vector or of its tangent: curves between such stay finite.
const LARGEST_VECTOR: f64 = 1e30;

/// The vectors of a set's tracks, `None` for a track without. The list may be shorter than the set.
pub(crate) type VectorTracks = Vec<Option<Arc<VectorTrack>>>;

/// Which of a track's vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Where the track's origin goes.
    Translation,
    /// Along the axes.
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
    /// Tangents with which the curve arrives at each key and leaves it, units per second; empty
    /// where none were given.
    pub tangents: &'a [[Vec3; 2]],
}

impl TrackSet {
    /// Gives a track translation keys, [`Vec3`] or `[f32; 3]`. Their `times` are seconds, strictly
    /// increasing, and may differ from the rotations' times. `tangents` (arriving, leaving; units per
    /// second) are used by [`VectorMethod::GltfCubic`](crate::method::vector_method::VectorMethod::GltfCubic)
    /// and may be empty.
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
    /// When there is no such track, the lengths differ, or a number is not finite or beyond 1e30.
    pub fn set_translations<V: Copy + Into<Vec3>>(
        &mut self,
        track: usize,
        times: &[f64],
        keys: &[V],
        tangents: &[[Vec3; 2]],
    ) -> Result<(), TrackError> {
        self.set_vectors(Channel::Translation, track, times, keys, tangents)
    }

    /// Adds a track for a body that follows a path: translation keys, at times in seconds that are
    /// strictly increasing, and no rotation of its own. `ups` are upward directions at some keys,
    /// one entry for each point; it may be empty. [`Engine::follow`](crate::engine::Engine::follow)
    /// evaluates it.
    ///
    /// # Errors
    /// When there is no point, the lengths differ, a number is not finite, or an upward direction
    /// has no length.
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
        check_finite(track, "point of the path", &points, |point| {
            point.is_finite()
        })?;
        self.push(name, &times[..1], &[Quat::IDENTITY])?;
        self.set_translations(track, times, &points, &[])?;
        if let Some(path) = &mut self.vectors[Channel::Translation as usize][track] {
            Arc::make_mut(path).ups = ups.to_vec();
        }
        Ok(track)
    }

    /// Gives a track scale keys; otherwise as [`TrackSet::set_translations`].
    ///
    /// # Errors
    /// As there.
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
        let quantity = "vector or its tangent";
        check_finite(track, quantity, &keys, |key| key.is_finite())?;
        check_finite(track, quantity, tangents, |[arriving, leaving]| {
            arriving.is_finite() && leaving.is_finite()
        })?;
        let limit = LARGEST_VECTOR;
        let is_too_large = |vector: &Vec3| vector.abs().max_element() > limit as f32;
        let key = keys.iter().position(is_too_large);
        let key = key.or_else(|| {
            tangents
                .iter()
                .position(|both| both.iter().any(is_too_large))
        });
        if let Some(key) = key {
            return Err(TrackError::DataTooLarge {
                track,
                key,
                quantity,
                limit,
            });
        }
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

    /// The keys of a track's translation or scale; `None` for a track without.
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
