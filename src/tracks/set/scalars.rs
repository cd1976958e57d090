//! Scalars: single numbers over time, such as the angle of a robot's joint, at separate times.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use crate::tracks::error::TrackError;
use crate::tracks::set::vectors::{VectorTrack, check_magnitudes};
use crate::tracks::set::{TrackSet, check_length, check_times};

/// The keys of a scalar.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ScalarTrack {
    pub(crate) name: String,
    pub(crate) times: Vec<f64>,
    pub(crate) keys: Vec<f32>,
    /// The incoming and outgoing tangent of each key, units per second; empty if none were set.
    pub(crate) tangents: Vec<[f32; 2]>,
}

/// The keys of a scalar, borrowed from its [`TrackSet`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScalarKeys<'a> {
    /// Its name; may be empty.
    pub name: &'a str,
    /// Key times in seconds, strictly increasing.
    pub times: &'a [f64],
    /// One number for each time.
    pub keys: &'a [f32],
    /// The incoming and outgoing tangent of each key, units per second; empty if none were set.
    pub tangents: &'a [[f32; 2]],
}

/// The number of scalars that are evaluated together, as the components of a vector.
pub(crate) const SCALARS_OF_A_PACK: usize = 3;

impl TrackSet {
    /// Appends a scalar: a number over time, such as the angle of a hinge (rad), the opening of a gripper, a weight or
    /// a contact. Returns its index among the scalars.
    ///
    /// Scalars are a list of the set beside its tracks, so a set may have scalars and no rotations. `times` are
    /// seconds, strictly increasing. `tangents` may be empty. They are pairs (incoming, outgoing) in units per
    /// second, for [`VectorMethod::GltfCubic`](crate::method::vector_method::VectorMethod::GltfCubic).
    ///
    /// ```
    /// use tumble::{Device, Engine, Layout, SampleTimes, ScalarQuantity, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// set.push_scalar("knee", &[0.0, 2.0], &[0.0, 1.0], &[])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let (frames, layout) = (SampleTimes::fps(1), Layout::TrackMajor);
    /// let linear = VectorMethod::Linear;
    /// let angles = engine.scalars(&set, ScalarQuantity::Value, linear, method::SLERP, &frames, layout)?;
    /// assert_eq!(angles.as_slice(), [0.0, 0.5, 1.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When there are no keys, the lengths differ, the times are not strictly increasing, or a number is not finite
    /// or exceeds 1e30 in magnitude; then the set is unchanged. The error's `track` is the scalar's index.
    pub fn push_scalar(
        &mut self,
        name: impl Into<String>,
        times: &[f64],
        keys: &[f32],
        tangents: &[[f32; 2]],
    ) -> Result<usize, TrackError> {
        let index = self.scalars.len();
        check_times(index, times, keys.len())?;
        if !tangents.is_empty() {
            check_length(index, "tangents", keys.len(), tangents.len())?;
        }
        let magnitude = |number: &f32| number.abs();
        check_magnitudes(index, "scalar or its tangent", keys, tangents, magnitude)?;
        self.widen_span(times);
        self.scalars.push(Arc::new(ScalarTrack {
            name: name.into(),
            times: times.to_vec(),
            keys: keys.to_vec(),
            tangents: tangents.to_vec(),
        }));
        Ok(index)
    }

    /// Number of scalars.
    #[must_use]
    pub fn scalar_count(&self) -> usize {
        self.scalars.len()
    }

    /// The keys of a scalar; `None` out of range.
    #[must_use]
    pub fn scalar(&self, index: usize) -> Option<ScalarKeys<'_>> {
        let scalar = self.scalars.get(index)?;
        Some(ScalarKeys {
            name: &scalar.name,
            times: &scalar.times,
            keys: &scalar.keys,
            tangents: &scalar.tangents,
        })
    }

    /// The index of the scalar with a name; the first of several.
    #[must_use]
    pub fn scalar_named(&self, name: &str) -> Option<usize> {
        self.scalars.iter().position(|scalar| scalar.name == name)
    }

    /// The index of the first scalar of each pack, and at the end the number of scalars. A pack has up to
    /// [`SCALARS_OF_A_PACK`] consecutive scalars with the same key times, of which all have tangents or none has. With
    /// `alone`, each scalar is a pack.
    pub(crate) fn scalar_packs(&self, alone: bool) -> Vec<usize> {
        let mut starts = Vec::new();
        for (i, scalar) in self.scalars.iter().enumerate() {
            let joins = |&start: &usize| {
                let first = &self.scalars[start];
                let has_room = !alone && i - start < SCALARS_OF_A_PACK;
                let have_tangents = first.tangents.is_empty() == scalar.tangents.is_empty();
                has_room && have_tangents && first.times == scalar.times
            };
            if !starts.last().is_some_and(joins) {
                starts.push(i);
            }
        }
        starts.push(self.scalars.len());
        starts
    }

    /// The scalars of a pack as the components of a vector; others are 0. Components do not influence each other, so
    /// that a scalar has the same bits in every pack.
    pub(crate) fn packed_scalars(&self, scalars: Range<usize>) -> VectorTrack {
        let (first, pack) = (&self.scalars[scalars.start], &self.scalars[scalars]);
        let gathered = |of: &dyn Fn(&ScalarTrack) -> f32| {
            let mut vector = Vec3::ZERO;
            for (component, scalar) in pack.iter().enumerate() {
                vector[component] = of(scalar);
            }
            vector
        };
        VectorTrack {
            times: first.times.clone(),
            keys: (0..first.keys.len())
                .map(|key| gathered(&|scalar| scalar.keys[key]))
                .collect(),
            tangents: (0..first.tangents.len())
                .map(|key| [0, 1].map(|side| gathered(&|scalar| scalar.tangents[key][side])))
                .collect(),
            ups: Vec::new(),
        }
    }
}
