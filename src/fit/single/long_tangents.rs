//! Long tangents: handles of keys whose tangents exceed the range of f32's formulas. They are
//! computed in f64 over the full range.

use crate::fit::double::handles::{HandleRule, Handles, Interval};
use crate::fit::double::intervals::Intervals;
use crate::fit::single::handles::HandlesF32;
use crate::math::quaternion::{log, step, unit};
use crate::math::ranges::FullRange;

/// Finds by a rule the handles of the key at the start of an interval.
pub(crate) type FindLong = fn(&Intervals, usize) -> Handles<f64>;

/// The [`FindLong`] of a rule.
pub(crate) fn find_long<R: HandleRule>(intervals: &Intervals, key: usize) -> Handles<f64> {
    let interval = |lane: usize| {
        let [from, to] = intervals.keys(lane).map(unit);
        let step = step(from, to);
        Interval {
            duration: intervals.durations[lane],
            step,
            log: log(step),
            key: [0.0; 4],
        }
    };
    R::handles(&mut FullRange, [key - 1, key].map(interval))
}

impl HandlesF32 {
    /// Sets the handles of a few keys, as `find` finds them.
    #[inline(never)]
    pub(crate) fn set_far(&mut self, keys: &[usize], intervals: &Intervals, find: FindLong) {
        for &key in keys {
            let Handles { incoming, outgoing } = find(intervals, key);
            for c in 0..3 {
                self.incoming[c][key] = incoming[c] as f32;
                self.outgoing[c][key] = outgoing[c] as f32;
            }
            self.far[key] = 0.0;
        }
    }
}
