//! A track's keys as the methods see them: f64, normalised, signs aligned, with
//! neighbours across the seam of a loop.

use glam::{DQuat, DVec3};

use super::{Ends, Form, Interpolation, InterpolationError, Path};
use crate::numeric::{dot, log, step, to_f64, unit};
use crate::tracks::Track;

/// Dot products nearer to zero than this are rounding noise of f32 keys: the signs
/// given decide, never the noise.
pub(crate) const DOT_NOISE: f64 = 1.0 / (1u64 << 21) as f64;

/// How far the last key of a loop may be from the first (half-angle, radians).
const LOOP_TOLERANCE: f64 = 1e-3;

/// Keys of one track, ready for a method.
pub(crate) struct Keys<'a> {
    /// Aligned unit keys.
    pub(crate) rotations: Vec<DQuat>,
    /// Key times, seconds.
    pub(crate) times: &'a [f64],
    /// What happens in the first and the last interval.
    pub(crate) ends: Ends,
    /// The half-rotation vector of each interval: most methods need each of them
    /// several times, and a logarithm costs more than all else. Arcs need none.
    logs: Vec<DVec3>,
}

impl<'a> Keys<'a> {
    /// Aligns the keys of `track`, the `index`th of its set.
    pub(crate) fn new(
        track: Track<'a>,
        index: usize,
        interpolation: &Interpolation,
    ) -> Result<Self, InterpolationError> {
        let mut rotations: Vec<DQuat> = track.keys.iter().map(|&key| unit(to_f64(key))).collect();
        let mut sign = 1.0;
        for i in 1..rotations.len() {
            let (before, after) = (rotations[i - 1], rotations[i]);
            let stored_dot = dot(before, after) * sign;
            match interpolation.path {
                Path::Shortest if stored_dot < -DOT_NOISE => sign = -sign,
                Path::AsAuthored if stored_dot < -1.0 + f64::from(f32::EPSILON) => {
                    return Err(InterpolationError::Antipodal {
                        track: index,
                        key: i - 1,
                    });
                }
                _ => {}
            }
            rotations[i] = after * sign;
        }
        let logs = match interpolation.method.form {
            Form::Arc => Vec::new(),
            Form::Cumulative => {
                let pairs = rotations.windows(2);
                pairs.map(|pair| log(step(pair[0], pair[1]))).collect()
            }
        };
        let keys = Self {
            rotations,
            times: track.times,
            ends: interpolation.ends,
            logs,
        };
        if matches!(keys.ends, Ends::Loop) {
            keys.check_loop(index)?;
        }
        Ok(keys)
    }

    fn check_loop(&self, track: usize) -> Result<(), InterpolationError> {
        let (first, last) = (self.rotations[0], self.rotations[self.len() - 1]);
        let seam = step(first, last);
        let sine = DVec3::new(seam.x, seam.y, seam.z).length();
        let half_angle = libm::atan2(sine, seam.w.abs());
        if half_angle > LOOP_TOLERANCE {
            let degrees = (2.0 * half_angle).to_degrees();
            return Err(InterpolationError::OpenLoop { track, degrees });
        }
        Ok(())
    }

    /// Number of keys.
    pub(crate) fn len(&self) -> usize {
        self.rotations.len()
    }

    /// Number of key intervals.
    pub(crate) fn intervals(&self) -> usize {
        self.len() - 1
    }

    /// Length of interval `i`, seconds; a loop's intervals continue past both ends.
    pub(crate) fn duration(&self, i: isize) -> f64 {
        let i = i.rem_euclid(self.intervals() as isize) as usize;
        self.times[i + 1] - self.times[i]
    }

    /// `q_i⁻¹ q_{i+1}`; a loop's steps continue past both ends.
    pub(crate) fn step(&self, i: isize) -> DQuat {
        let i = i.rem_euclid(self.intervals() as isize) as usize;
        step(self.rotations[i], self.rotations[i + 1])
    }

    /// The half-rotation vector of interval `i`; a loop's continue past both ends.
    pub(crate) fn log_step(&self, i: isize) -> DVec3 {
        self.logs[i.rem_euclid(self.intervals() as isize) as usize]
    }
}
