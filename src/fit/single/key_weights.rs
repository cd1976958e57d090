//! The tangent weights of the keys of a block, as a structure of arrays.

use crate::curve::options::Ends;
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::tangent_weights::{UNKNOWN, WeightRule};
use crate::shader::TangentWeights;

/// A [`TangentWeights`] for the key that each interval of a block starts with.
pub(crate) struct KeyWeights {
    rule: WeightRule,
    /// The weights at a track's ends.
    end: TangentWeights,
    is_loop: bool,
    pub(crate) before: [f32; ROOM],
    pub(crate) after: [f32; ROOM],
    pub(crate) outgoing: [f32; ROOM],
    pub(crate) kinds: [f32; ROOM],
}

impl KeyWeights {
    pub(crate) fn new(rule: WeightRule, ends: Ends) -> Self {
        Self {
            rule,
            end: WeightRule::end(ends),
            is_loop: ends == Ends::Loop,
            before: [UNKNOWN.before; ROOM],
            after: [UNKNOWN.after; ROOM],
            outgoing: [UNKNOWN.outgoing; ROOM],
            kinds: [UNKNOWN.kind; ROOM],
        }
    }

    #[inline(always)]
    pub(crate) fn at(&self, lane: usize) -> TangentWeights {
        TangentWeights {
            before: self.before[lane],
            after: self.after[lane],
            outgoing: self.outgoing[lane],
            kind: self.kinds[lane],
        }
    }

    fn set(&mut self, lane: usize, tangent_weights: TangentWeights) {
        self.before[lane] = tangent_weights.before;
        self.after[lane] = tangent_weights.after;
        self.outgoing[lane] = tangent_weights.outgoing;
        self.kinds[lane] = tangent_weights.kind;
    }

    /// Computes the weights of all keys of a block.
    pub(crate) fn bring(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        for lane in 0..LANES {
            let [before, after] = [lane, lane + 1].map(|lane| intervals.durations[lane]);
            self.set(lane + 1, self.rule.between(before, after));
        }
        for stretch in stretches {
            // A track of two keys has no neighbouring intervals, not even in a loop.
            let end = match stretch.all {
                1 => UNKNOWN,
                _ if self.is_loop => continue,
                _ => self.end,
            };
            if let Some(lane) = stretch.first() {
                self.set(lane, end);
            }
            if let Some(lane) = stretch.last() {
                self.set(lane + 1, end);
            }
        }
    }
}
