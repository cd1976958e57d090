//! What the tangent at a key is made of, where curves are prepared in f32 straight from
//! keys: all that depends on times is here, in f64.

use crate::method::interpolation::Ends;
use crate::shader::TangentWeights;
use crate::shader::{KEY_AT_END, KEY_INNER, KEY_UNKNOWN};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// How the steps on both sides of a key count in its tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WeightRule {
    /// Alike: Catmull-Rom.
    Alike,
    /// By how long the other one takes: Bessel-Overhauser.
    ByTime,
}

const SIXTH: f32 = 1.0 / 6.0;

/// How much longer one interval may be than its neighbour.
const MOST_UNEVEN: f64 = 16.0;

/// A key with no neighbour on one side, as nothing is known of what it does there.
pub(crate) const UNKNOWN: TangentWeights = TangentWeights {
    before: 0.0,
    after: 0.0,
    outgoing: 0.0,
    kind: KEY_UNKNOWN,
};

impl WeightRule {
    /// Of a key between intervals of so many seconds.
    #[inline(always)]
    pub(crate) fn between(self, before: f64, after: f64) -> TangentWeights {
        let by_time = matches!(self, Self::ByTime);
        let (left, right) = (after / before, before / after);
        let outgoing = after / (3.0 * (before + after));
        // Written so that NaN is no known joint.
        let is_even = (left <= MOST_UNEVEN) & (right <= MOST_UNEVEN);
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

    /// Of the first or the last of at least three keys.
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

/// The weights of a track's keys, of those that are asked for; kept for the next track
/// with the same times.
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

    /// Of keys that follow one another: the first of them is the `first`th of `all`.
    pub(crate) fn of(&mut self, times: &'a [f64], first: usize, all: usize) -> &[TangentWeights] {
        if std::ptr::eq(self.times, times) && self.whole == (first, all) {
            return &self.weights;
        }
        (self.times, self.whole) = (times, (first, all));
        self.weights.clear();
        self.weights.resize(times.len(), UNKNOWN);
        let mut work = Between {
            rule: self.rule,
            times,
            weights: &mut self.weights,
        };
        in_lanes(&mut work);
        let is_curve = all > 2;
        if first == 0 && is_curve {
            self.weights[0] = WeightRule::end(self.ends);
        }
        if first + times.len() == all && is_curve {
            self.weights[times.len() - 1] = WeightRule::end(self.ends);
        }
        &self.weights
    }
}

/// `WeightRule` of all keys but the first and the last of some.
struct Between<'a> {
    rule: WeightRule,
    times: &'a [f64],
    weights: &'a mut [TangentWeights],
}

impl InLanes for Between<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let inner = self.times.len().saturating_sub(2);
        let (before, own, after) = (
            &self.times[..inner],
            &self.times[self.times.len().min(1)..][..inner],
            &self.times[self.times.len() - inner..],
        );
        let start = self.weights.len().min(1);
        let weights = &mut self.weights[start..][..inner];
        for j in 0..inner {
            weights[j] = self.rule.between(own[j] - before[j], after[j] - own[j]);
        }
    }
}
