//! Long tangents: handles of keys whose tangents exceed the range of f32's formulas. They are
//! computed in f64 over the full range, in vectors of a few keys.

use std::marker::PhantomData;

use crate::fit::block::{Intervals, at, put};
use crate::fit::exact::handles::{HandlePair, HandleRule, KeyInterval};
use crate::fit::fast::handles::{AT_ONCE, HandlesF32};
use crate::math::quaternion::{log, normalised, step};
use crate::math::ranges::FullRange;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// One number for each key.
type KeyRow = [f64; AT_ONCE];

/// Keys with long tangents, and their handles by a rule.
struct LongTangents<R> {
    /// The intervals before the keys, and those after them.
    sides: [Side; 2],
    handles: HandlePair<KeyRow>,
    rule: PhantomData<R>,
}

/// The intervals on one side of the keys.
struct Side {
    from: [KeyRow; 4],
    to: [KeyRow; 4],
    durations: KeyRow,
}

/// Sets the handles of at most [`AT_ONCE`] keys by a rule.
#[inline(never)]
pub(crate) fn set_long<R: HandleRule>(
    handles: &mut HandlesF32,
    keys: &[usize],
    intervals: &Intervals,
) {
    let mut tangents = LongTangents::<R> {
        sides: [Side::new(intervals, keys, 1), Side::new(intervals, keys, 0)],
        handles: HandlePair {
            incoming: [[0.0; AT_ONCE]; 3],
            outgoing: [[0.0; AT_ONCE]; 3],
        },
        rule: PhantomData,
    };
    in_lanes(&mut tangents);
    for (i, &key) in keys.iter().enumerate() {
        for c in 0..3 {
            handles.incoming[c][key] = tangents.handles.incoming[c][i] as f32;
            handles.outgoing[c][key] = tangents.handles.outgoing[c][i] as f32;
        }
        handles.limit_ratio[key] = 0.0;
    }
}

impl Side {
    /// `back` is 1 for the intervals before the keys, 0 for those after them.
    #[inline(always)]
    fn new(intervals: &Intervals, keys: &[usize], back: usize) -> Self {
        let mut side = Self {
            from: [[0.0; AT_ONCE]; 4],
            to: [[0.0; AT_ONCE]; 4],
            durations: [1.0; AT_ONCE],
        };
        for (i, key) in keys.iter().enumerate() {
            let lane = key - back;
            put(&mut side.from, i, intervals.from[lane].map(f64::from));
            put(&mut side.to, i, intervals.to[lane].map(f64::from));
            side.durations[i] = intervals.durations[lane];
        }
        side
    }

    #[inline(always)]
    fn interval(&self, i: usize) -> KeyInterval<f64> {
        let step = step(normalised(at(&self.from, i)), normalised(at(&self.to, i)));
        KeyInterval {
            duration: self.durations[i],
            step,
            log: log(step),
            key: [0.0; 4],
        }
    }
}

impl<R: HandleRule> InLanes for LongTangents<R> {
    // The compiler vectorises this loop.
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [before, after] = &self.sides;
        let HandlePair { incoming, outgoing } = &mut self.handles;
        for i in 0..AT_ONCE {
            let found = R::handles(&mut FullRange, [before.interval(i), after.interval(i)]);
            for c in 0..3 {
                incoming[c][i] = found.incoming[c];
                outgoing[c][i] = found.outgoing[c];
            }
        }
    }
}
