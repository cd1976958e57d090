//! The tangent weights of the keys of a block.

use crate::curve::options::Ends;
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::tangent_weights::{UNKNOWN, WeightRule};
use crate::shader::TangentWeights;
use crate::simd::lanes::Lanes;

/// A [`TangentWeights`] for the key that each interval of a block starts with.
pub(crate) struct KeyWeights {
    rule: WeightRule,
    ends: Ends,
    pub(crate) keys: [TangentWeights; ROOM],
}

impl KeyWeights {
    pub(crate) fn new(rule: WeightRule, ends: Ends) -> Self {
        Self {
            rule,
            ends,
            keys: [UNKNOWN; ROOM],
        }
    }

    /// A vector for each field of the weights, from `lane` on.
    #[inline(always)]
    pub(crate) fn load<L: Lanes>(&self, lane: usize) -> [L; 4] {
        L::load_rotations(bytemuck::cast_slice(&self.keys[lane..]))
    }

    /// Computes the weights of all keys of a block.
    pub(crate) fn bring(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        for lane in 0..LANES {
            let [before, after] = [lane, lane + 1].map(|lane| intervals.durations[lane]);
            self.keys[lane + 1] = self.rule.between(before, after);
        }
        for stretch in stretches {
            // A track of two keys has no neighbouring intervals, not even in a loop.
            let end = match (stretch.all, self.ends) {
                (1, _) => UNKNOWN,
                (_, Ends::Loop) => continue,
                (_, ends) => WeightRule::end(ends),
            };
            if let Some(lane) = stretch.first() {
                self.keys[lane] = end;
            }
            if let Some(lane) = stretch.last() {
                self.keys[lane + 1] = end;
            }
        }
    }
}
