//! Tangent weights: the weights of the steps on both sides of a key in its tangent, for curves that are prepared in
//! f32 directly from keys. Only the weights depend on the key times; they are computed in f64.

use crate::curve::options::Ends;
use crate::fit::block::{Intervals, ROW_LEN, TrackStretch};
use crate::shader::{KEY_AT_END, KEY_INNER, KEY_UNKNOWN, TangentWeights};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// The rule for the weights of the steps before and after a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WeightRule {
    /// Both steps have the same weight: Catmull-Rom.
    Alike,
    /// Each step is weighted by the other interval's duration over its own: Bessel-Overhauser.
    ByTime,
}

const SIXTH: f32 = 1.0 / 6.0;

/// The largest ratio of two neighbouring durations for which the weights are valid.
const MAX_DURATION_RATIO: f64 = 16.0;

/// The weights of a key whose tangent cannot be computed with f32 weights.
pub(crate) const UNKNOWN: TangentWeights = TangentWeights {
    before: 0.0,
    after: 0.0,
    outgoing: 0.0,
    kind: KEY_UNKNOWN,
};

impl WeightRule {
    /// The weights of a key between intervals of `before` and `after` seconds.
    #[inline(always)]
    pub(crate) fn between(self, before: f64, after: f64) -> TangentWeights {
        let by_time = matches!(self, Self::ByTime);
        let (left, right) = (after / before, before / after);
        let outgoing = after / (3.0 * (before + after));
        // Both comparisons are false for NaN, whose weights are unknown then.
        let is_even = (left <= MAX_DURATION_RATIO) & (right <= MAX_DURATION_RATIO);
        TangentWeights {
            before: if by_time { left as f32 } else { 1.0 },
            after: if by_time { right as f32 } else { 1.0 },
            outgoing: if by_time { outgoing as f32 } else { SIXTH },
            kind: if is_even | !by_time {
                KEY_INNER
            } else {
                KEY_UNKNOWN
            },
        }
    }

    /// The weights of a key of a track with these times, as [`TrackWeights::weights_of`] has them.
    pub(crate) fn at_key(self, ends: Ends, times: &[f64], key: usize) -> TangentWeights {
        match (times.len(), key) {
            (0..=2, _) => UNKNOWN,
            (count, key) if key == 0 || key + 1 == count => Self::end(ends),
            _ => self.between(times[key] - times[key - 1], times[key + 1] - times[key]),
        }
    }

    /// The weights of the first or the last key of a track of at least three keys.
    pub(crate) fn end(ends: Ends) -> TangentWeights {
        match ends {
            Ends::Parabolic => TangentWeights {
                kind: KEY_AT_END,
                ..UNKNOWN
            },
            _ => UNKNOWN,
        }
    }
}

/// A [`TangentWeights`] for the key that each interval of a block starts with.
pub(crate) struct KeyWeights {
    rule: WeightRule,
    ends: Ends,
    pub(crate) keys: [TangentWeights; ROW_LEN],
}

impl KeyWeights {
    pub(crate) fn new(rule: WeightRule, ends: Ends) -> Self {
        Self {
            rule,
            ends,
            keys: [UNKNOWN; ROW_LEN],
        }
    }

    /// A vector for each field of the weights, from `lane` on.
    #[inline(always)]
    pub(crate) fn load<L: Lanes>(&self, lane: usize) -> [L; 4] {
        L::load_rotations(bytemuck::cast_slice(&self.keys[lane..]))
    }

    /// Computes the weights of all keys of a block.
    pub(crate) fn compute(&mut self, intervals: &Intervals, stretches: &[TrackStretch]) {
        let count = intervals.count;
        in_lanes(&mut Between {
            rule: self.rule,
            starts: &intervals.starts[..=count],
            ends: &intervals.ends[..=count],
            weights: &mut self.keys[1..=count],
        });
        for stretch in stretches {
            // A track of two keys has no neighbouring intervals, not even in a loop.
            let end = match (stretch.track_intervals, self.ends) {
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

/// Computes [`WeightRule::between`] for the keys between neighbouring intervals, one fewer than
/// there are intervals.
struct Between<'a> {
    rule: WeightRule,
    starts: &'a [f64],
    ends: &'a [f64],
    weights: &'a mut [TangentWeights],
}

impl InLanes for Between<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let count = self.weights.len();
        let (starts, next_starts) = (&self.starts[..count], &self.starts[1..=count]);
        let (ends, next_ends) = (&self.ends[..count], &self.ends[1..=count]);
        for j in 0..count {
            let (before, after) = (ends[j] - starts[j], next_ends[j] - next_starts[j]);
            self.weights[j] = self.rule.between(before, after);
        }
    }
}

/// The weights of some keys of a track, kept for the next track with the same times.
pub(crate) struct TrackWeights<'a> {
    rule: WeightRule,
    ends: Ends,
    times: &'a [f64],
    whole: (usize, usize),
    weights: Vec<TangentWeights>,
}

impl<'a> TrackWeights<'a> {
    pub(crate) fn new(rule: WeightRule, ends: Ends) -> Self {
        Self {
            rule,
            ends,
            times: &[],
            whole: (0, 0),
            weights: Vec::new(),
        }
    }

    /// The weights of consecutive keys with these times; the first of them is the `first`th of a
    /// track of `all` keys.
    pub(crate) fn weights_of(
        &mut self,
        times: &'a [f64],
        first: usize,
        key_count: usize,
    ) -> &[TangentWeights] {
        if std::ptr::eq(self.times, times) && self.whole == (first, key_count) {
            return &self.weights;
        }
        (self.times, self.whole) = (times, (first, key_count));
        self.weights.clear();
        self.weights.resize(times.len(), UNKNOWN);
        if let ([_, weights @ .., _], [starts @ .., _]) = (&mut self.weights[..], times) {
            let (rule, ends) = (self.rule, &times[1..]);
            in_lanes(&mut Between {
                rule,
                starts,
                ends,
                weights,
            });
        }
        let is_curve = key_count > 2;
        if first == 0 && is_curve {
            self.weights[0] = WeightRule::end(self.ends);
        }
        if first + times.len() == key_count && is_curve {
            self.weights[times.len() - 1] = WeightRule::end(self.ends);
        }
        &self.weights
    }
}
