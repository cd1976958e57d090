//! What the tangents at the keys of a block are made of, side by side.

use super::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::cpu::{InLanes, Lanes, in_lanes};
use crate::joints::{Joints, UNKNOWN};
use crate::method::Ends;
use crate::segment::Joint;

/// A [`Joint`] for the key that each interval of a block starts with.
pub(super) struct KeyJoints {
    rule: Joints,
    /// At a track's ends.
    end: Joint,
    is_loop: bool,
    pub(super) before: [f32; ROOM],
    pub(super) after: [f32; ROOM],
    pub(super) outgoing: [f32; ROOM],
    pub(super) kinds: [f32; ROOM],
}

impl KeyJoints {
    pub(super) fn new(rule: Joints, ends: Ends) -> Self {
        Self {
            rule,
            end: Joints::end(ends),
            is_loop: ends == Ends::Loop,
            before: [UNKNOWN.before; ROOM],
            after: [UNKNOWN.after; ROOM],
            outgoing: [UNKNOWN.outgoing; ROOM],
            kinds: [UNKNOWN.kind; ROOM],
        }
    }

    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> Joint {
        Joint {
            before: self.before[lane],
            after: self.after[lane],
            outgoing: self.outgoing[lane],
            kind: self.kinds[lane],
        }
    }

    fn set(&mut self, lane: usize, joint: Joint) {
        self.before[lane] = joint.before;
        self.after[lane] = joint.after;
        self.outgoing[lane] = joint.outgoing;
        self.kinds[lane] = joint.kind;
    }

    /// Those of all keys.
    pub(super) fn bring(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        in_lanes(&mut Between {
            joints: self,
            durations: &intervals.durations,
        });
        for stretch in stretches {
            // Two keys alone have nothing beside them, not in a loop either.
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

struct Between<'a> {
    joints: &'a mut KeyJoints,
    durations: &'a [f64; ROOM],
}

impl InLanes for Between<'_> {
    // A loop that the compiler makes vectors of.
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let KeyJoints {
            rule,
            before,
            after,
            outgoing,
            kinds,
            ..
        } = &mut *self.joints;
        for j in 0..LANES {
            let joint = rule.between(self.durations[j], self.durations[j + 1]);
            before[j + 1] = joint.before;
            after[j + 1] = joint.after;
            outgoing[j + 1] = joint.outgoing;
            kinds[j + 1] = joint.kind;
        }
    }
}
