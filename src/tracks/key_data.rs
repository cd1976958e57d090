//! Data that keys may carry beside their rotations, for the methods that use it: angular
//! velocities, tangents, and tension, continuity and bias.

use glam::{DVec3, Quat};

use crate::tracks::error::TrackError;
use crate::tracks::set::TrackSet;

/// Tension, continuity and bias of a key (Kochanek, Bartels 1984); 0 for none, mostly
/// within -1 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tcb {
    /// 1 makes the curve stand still at the key, -1 doubles its speed there.
    pub tension: f64,
    /// -1 makes a corner at the key, 1 a corner to the other side.
    pub continuity: f64,
    /// 1 lets the curve follow the interval before the key, -1 the interval after it.
    pub bias: f64,
}

impl Tcb {
    pub(crate) fn is_finite(self) -> bool {
        [self.tension, self.continuity, self.bias]
            .iter()
            .all(|value| value.is_finite())
    }
}

/// One kind of data for a set: a track has a value for each of its keys, or none at all.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct KeyData<T> {
    values: Vec<T>,
    /// For each track, where its values start; `None` if it has none.
    starts: Vec<Option<usize>>,
}

impl<T: Clone> KeyData<T> {
    /// The values of a track with `keys` keys; empty if it has none.
    pub(crate) fn of(&self, track: usize, keys: usize) -> &[T] {
        match self.starts.get(track) {
            Some(&Some(start)) => &self.values[start..start + keys],
            _ => &[],
        }
    }

    pub(crate) fn set(&mut self, track: usize, values: &[T]) {
        if values.is_empty() {
            return;
        }
        if self.starts.len() <= track {
            self.starts.resize(track + 1, None);
        }
        if let Some(start) = self.starts[track] {
            self.values[start..start + values.len()].clone_from_slice(values);
        } else {
            self.starts[track] = Some(self.values.len());
            self.values.extend_from_slice(values);
        }
    }
}

impl TrackSet {
    /// Gives each key of a track an angular velocity, radians per second in the body
    /// frame: for [`HERMITE`](crate::method::hermite::HERMITE).
    ///
    /// # Errors
    /// When there is no such track, or not one finite velocity for each of its keys.
    pub fn set_velocities(&mut self, track: usize, velocities: &[DVec3]) -> Result<(), TrackError> {
        self.check_data(track, velocities, "velocity", |velocity| {
            velocity.is_finite()
        })?;
        self.velocities.set(track, velocities);
        Ok(())
    }

    /// Gives each key of a track the tangents with which the curve arrives and leaves,
    /// `x y z w` a second: for [`GLTF_CUBIC`](crate::method::gltf_cubic::GLTF_CUBIC).
    ///
    /// # Errors
    /// When there is no such track, or not one finite pair for each of its keys.
    pub fn set_tangents(&mut self, track: usize, tangents: &[[Quat; 2]]) -> Result<(), TrackError> {
        self.check_data(track, tangents, "tangent", |[arriving, leaving]| {
            arriving.is_finite() && leaving.is_finite()
        })?;
        self.tangents.set(track, tangents);
        Ok(())
    }

    /// Gives each key of a track its own tension, continuity and bias: for
    /// [`KOCHANEK_BARTELS`](crate::method::kochanek_bartels::KOCHANEK_BARTELS).
    ///
    /// # Errors
    /// When there is no such track, or not one finite triple for each of its keys.
    pub fn set_tcb(&mut self, track: usize, tcb: &[Tcb]) -> Result<(), TrackError> {
        self.check_data(track, tcb, "tension, continuity or bias", |tcb| {
            tcb.is_finite()
        })?;
        self.tcb.set(track, tcb);
        Ok(())
    }

    fn check_data<T>(
        &self,
        track: usize,
        values: &[T],
        what: &'static str,
        is_finite: impl Fn(&T) -> bool,
    ) -> Result<(), TrackError> {
        let tracks = self.track_count();
        if track >= tracks {
            return Err(TrackError::NoSuchTrack { track, tracks });
        }
        let keys = self.track(track).keys.len();
        if values.len() != keys {
            return Err(TrackError::DataLength {
                track,
                what,
                keys,
                given: values.len(),
            });
        }
        match values.iter().position(|value| !is_finite(value)) {
            Some(key) => Err(TrackError::DataNotFinite { track, key, what }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_of_keys_is_checked_and_goes_with_its_track() {
        let mut set = TrackSet::new();
        set.push("a", &[0.0, 1.0], &[Quat::IDENTITY; 2]).unwrap();
        set.push("b", &[0.0, 1.0, 2.0], &[Quat::IDENTITY; 3])
            .unwrap();
        let tcb = |bias| Tcb {
            bias,
            ..Tcb::default()
        };
        let error = set.set_tcb(2, &[tcb(0.0)]).unwrap_err();
        assert_eq!(
            error,
            TrackError::NoSuchTrack {
                track: 2,
                tracks: 2
            }
        );
        let error = set.set_velocities(1, &[DVec3::X]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "track 1 has 3 keys but 1 values of velocity; give one for each key"
        );
        let error = set
            .set_tcb(1, &[tcb(0.0), tcb(f64::NAN), tcb(1.0)])
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "track 1, key 1: the tension, continuity or bias is not finite"
        );
        assert!(set.track(1).tcb.is_empty());
        let own = [tcb(0.1), tcb(0.2), tcb(0.3)];
        set.set_tcb(1, &[tcb(1.0); 3]).unwrap();
        set.set_tcb(1, &own).unwrap();
        assert_eq!(set.track(1).tcb, own);
        assert_eq!(set.select(1..2).unwrap().track(0).tcb, own);
        assert!(set.track(0).tcb.is_empty());
    }
}
