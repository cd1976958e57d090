//! Keys with their signs aligned, and their velocities, tangents and parameters.

use glam::{DQuat, DVec3, Quat};

use crate::curve::options::KeySigns;
use crate::reference::quaternion::{inner, invert, multiply, normalise};
use crate::tracks::set::key_data::Tcb;

/// The largest magnitude of a dot product whose sign may be due to the rounding of f32 keys.
const SIGN_NOISE: f64 = 4.76837158203125e-7; // 2^-21

/// One track in f64.
pub(crate) struct ReferenceTrack {
    pub(crate) times: Vec<f64>,
    pub(crate) keys: Vec<DQuat>,
    pub(crate) velocities: Vec<DVec3>,
    pub(crate) tangents: Vec<[Quat; 2]>,
    pub(crate) tcb: Vec<Tcb>,
}

impl ReferenceTrack {
    pub(crate) fn new(signs: KeySigns, times: &[f64], keys: &[Quat]) -> Self {
        let keys: Vec<DQuat> = keys.iter().map(|key| normalise(key.as_dquat())).collect();
        let mut aligned: Vec<DQuat> = Vec::with_capacity(keys.len());
        for (i, &key) in keys.iter().enumerate() {
            let flipped = i > 0 && inner(keys[i - 1], aligned[i - 1]) < 0.0;
            let is_opposite =
                i > 0 && signs == KeySigns::Shortest && inner(keys[i - 1], key) < -SIGN_NOISE;
            aligned.push(if flipped == is_opposite { key } else { -key });
        }
        Self {
            times: times.to_vec(),
            tcb: vec![Tcb::default(); aligned.len()],
            keys: aligned,
            velocities: Vec::new(),
            tangents: Vec::new(),
        }
    }

    pub(crate) fn last(&self) -> usize {
        self.keys.len() - 1
    }

    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) fn difference(&self, i: usize) -> DQuat {
        multiply(invert(self.keys[i]), self.keys[i + 1])
    }

    pub(crate) fn step(&self, i: usize) -> f64 {
        self.times[i + 1] - self.times[i]
    }

    /// The difference and the time step of the interval before key `i` or, if not `before`, after it. At the ends of
    /// a closed track it is the interval at the other end.
    pub(crate) fn side(&self, i: usize, before: bool) -> (DQuat, f64) {
        let interval = match (i, before) {
            (0, true) => self.last() - 1,
            (i, true) => i - 1,
            (i, false) if i == self.last() => 0,
            (i, false) => i,
        };
        (self.difference(interval), self.step(interval))
    }
}
