//! Data of keys in addition to rotations, for the methods that use them: angular velocities, tangents, and tension,
//! continuity and bias.

use glam::{DVec3, Quat};

use crate::tracks::error::TrackError;
use crate::tracks::set::{TrackSet, check_finite, check_length};

/// Tension, continuity and bias of a key (Kochanek, Bartels 1984); 0 is neutral, and common values are from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tcb {
    /// With 1 the velocity at the key is 0, with -1 it is doubled.
    pub tension: f64,
    /// With -1 the curve has a corner at the key; with 1 the corner points the other way, because the curve overshoots
    /// on both sides of the key.
    pub continuity: f64,
    /// With 1 the tangent at the key follows the interval before it, with -1 the interval after it.
    pub bias: f64,
}

/// The largest magnitude of a tension, a continuity or a bias. With it, computations do not overflow.
pub(crate) const LARGEST_TCB: f64 = 1e6;

/// The largest angular velocity at a key in radians per second.
const FASTEST: f64 = 1e12;

impl Tcb {
    fn named(&self) -> [(&'static str, f64); 3] {
        [
            ("tension", self.tension),
            ("continuity", self.continuity),
            ("bias", self.bias),
        ]
    }

    /// The name and the value of the first number that is not finite, or is too large.
    pub(crate) fn refused(&self) -> Option<(&'static str, f64)> {
        let is_refused = |(_, value): &(&str, f64)| value.is_nan() || value.abs() > LARGEST_TCB;
        self.named().into_iter().find(is_refused)
    }
}

/// One kind of data for a set: a track has one value for each of its keys, or none. The list may be shorter than the
/// set.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct KeyData<T>(Vec<Vec<T>>);

impl<T: Clone> KeyData<T> {
    /// The values of a track; empty if it has none.
    pub(crate) fn of(&self, track: usize) -> &[T] {
        self.0.get(track).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn set(&mut self, track: usize, values: &[T]) {
        if values.is_empty() {
            return;
        }
        if self.0.len() <= track {
            self.0.resize(track + 1, Vec::new());
        }
        self.0[track] = values.to_vec();
    }
}

impl TrackSet {
    /// Sets the angular velocity at each key of a track in radians per second in the body frame, for
    /// [`HERMITE`](crate::method::hermite::HERMITE).
    ///
    /// # Errors
    /// When there is no such track, the number of velocities is not the number of keys, or a velocity is not finite
    /// or is larger than 1e12 rad/s.
    pub fn set_velocities(&mut self, track: usize, velocities: &[DVec3]) -> Result<(), TrackError> {
        self.check_data(track, "velocity", velocities, FASTEST, |velocity| {
            largest(velocity.to_array().into_iter())
        })?;
        self.velocities.set(track, velocities);
        Ok(())
    }

    /// Sets the incoming and outgoing tangent of each key of a track, `x y z w` per second, for
    /// [`GLTF_CUBIC`](crate::method::gltf_cubic::GLTF_CUBIC).
    ///
    /// # Errors
    /// When there is no such track, the number of pairs is not the number of keys, or a tangent is not finite.
    pub fn set_tangents(&mut self, track: usize, tangents: &[[Quat; 2]]) -> Result<(), TrackError> {
        let largest = |both: &[Quat; 2]| {
            let numbers = both.iter().flat_map(Quat::to_array);
            largest(numbers.map(f64::from))
        };
        self.check_data(track, "tangent", tangents, f64::MAX, largest)?;
        self.tangents.set(track, tangents);
        Ok(())
    }

    /// Sets tension, continuity and bias at each key of a track, for
    /// [`KOCHANEK_BARTELS`](crate::method::kochanek_bartels::KOCHANEK_BARTELS).
    ///
    /// # Errors
    /// When there is no such track, the number of values is not the number of keys, or a number is not finite or is
    /// too large.
    pub fn set_tcb(&mut self, track: usize, tcb: &[Tcb]) -> Result<(), TrackError> {
        let quantity = "tension, continuity or bias";
        self.check_data(track, quantity, tcb, LARGEST_TCB, |tcb| {
            largest(tcb.named().into_iter().map(|(_, value)| value))
        })?;
        self.tcb.set(track, tcb);
        Ok(())
    }

    fn check_data<T>(
        &self,
        track: usize,
        quantity: &'static str,
        values: &[T],
        limit: f64,
        magnitude: impl Fn(&T) -> f64,
    ) -> Result<(), TrackError> {
        self.check_track(track)?;
        check_length(track, quantity, self.track(track).keys.len(), values.len())?;
        check_finite(track, quantity, values, |value| {
            magnitude(value) < f64::INFINITY
        })?;
        match values.iter().position(|value| magnitude(value) > limit) {
            Some(key) => Err(TrackError::DataTooLarge {
                track,
                key,
                quantity,
                limit,
            }),
            None => Ok(()),
        }
    }
}

/// The largest magnitude; infinite if a number is NaN.
fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    let magnitude = |number: f64| {
        if number.is_nan() {
            f64::INFINITY
        } else {
            number.abs()
        }
    };
    numbers.map(magnitude).fold(0.0, f64::max)
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
        let too_few = set.set_velocities(1, &[DVec3::X]);
        let not_finite = set.set_tcb(1, &[tcb(0.0), tcb(f64::NAN), tcb(1.0)]);
        let expected = [
            "track 1 has 3 keys but 1 value of velocity; give one for each key",
            "track 1, key 1: the tension, continuity or bias is not finite",
        ];
        assert_eq!(
            [too_few, not_finite].map(|result| result.unwrap_err().to_string()),
            expected
        );
        assert!(set.track(1).tcb.is_empty());
        let values = [tcb(0.1), tcb(0.2), tcb(0.3)];
        set.set_tcb(1, &[tcb(1.0); 3]).unwrap();
        set.set_tcb(1, &values).unwrap();
        assert_eq!(set.track(1).tcb, values);
        assert_eq!(set.select(1..2).unwrap().track(0).tcb, values);
        assert!(set.track(0).tcb.is_empty());
    }
}
