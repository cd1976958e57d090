//! Contacts of bodies with the ground.

use glam::DVec3;

use crate::learning::heading::Ground;

/// A body touches the ground while it is both lower and slower than these limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLimits {
    /// Metres above the ground, exclusive.
    pub height: f64,
    /// Metres a second, exclusive.
    pub speed: f64,
}

impl ContactLimits {
    /// The limits of ProtoMotions' converters.
    pub const PROTOMOTIONS: Self = Self {
        height: 0.1,
        speed: 0.15,
    };
    /// The limits of Kimodo's metrics.
    pub const KIMODO: Self = Self {
        height: 0.05,
        speed: 0.2,
    };

    /// Whether a body is within the limits.
    #[must_use]
    pub fn contains(self, position: DVec3, velocity: DVec3, ground: Ground) -> bool {
        velocity.length() < self.speed && ground.height(position) < self.height
    }
}

/// Which bodies touch the ground, by their positions (metres) and velocities (m/s).
#[must_use]
pub fn contacts(
    positions: &[DVec3],
    velocities: &[DVec3],
    ground: Ground,
    limits: ContactLimits,
) -> Vec<bool> {
    let bodies = positions.iter().zip(velocities);
    bodies
        .map(|(&position, &velocity)| limits.contains(position, velocity, ground))
        .collect()
}

/// Replaces each contact of a body by the majority of the `window` frames around it (an odd number); at the ends, of
/// those that there are. A tie keeps it.
#[must_use]
pub fn majority(contacts: &[bool], window: usize) -> Vec<bool> {
    let half = window / 2;
    let at = |frame: usize| {
        let end = (frame + half + 1).min(contacts.len());
        let around = &contacts[frame.saturating_sub(half)..end];
        let touching = around.iter().filter(|&&touches| touches).count();
        match (2 * touching).cmp(&around.len()) {
            std::cmp::Ordering::Less => false,
            std::cmp::Ordering::Equal => contacts[frame],
            std::cmp::Ordering::Greater => true,
        }
    };
    (0..contacts.len()).map(at).collect()
}
