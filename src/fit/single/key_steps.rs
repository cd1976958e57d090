//! Steps between the keys of a block's intervals, in vector lanes of f32. They come from the
//! differences of neighbouring keys, which are as exact in f32 as the keys.

use crate::fit::double::intervals::{Intervals, ROOM};
use crate::fit::single::exp_log::{LOG, Row, log, store};
use crate::math::quaternion::dot;
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;
use crate::twin::small_angle::{FromIdentity, chord_of, step_vector};

/// The largest squared chord between keys for which [`LOG`] holds.
pub(crate) const LONGEST_CHORD: f32 = 1.0;

/// Steps between the keys of a block's intervals.
pub(crate) struct KeySteps {
    /// The squares of the differences of keys.
    pub(crate) chords: Row,
    /// The steps' logarithms.
    pub(crate) logs: [Row; 3],
}

impl KeySteps {
    pub(crate) fn new() -> Self {
        Self {
            chords: [0.0; ROOM],
            logs: [[0.0; ROOM]; 3],
        }
    }
}

/// Finds the steps.
pub(crate) struct FindSteps<'a> {
    pub(crate) steps: &'a mut KeySteps,
    pub(crate) intervals: &'a Intervals,
}

impl InLanes for FindSteps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Intervals { from, to, .. } = self.intervals;
        let own = &mut *self.steps;
        for lane in (0..self.intervals.whole32()).step_by(L::COUNT) {
            let start = L::load_rotations(&from[lane..]);
            let chord = chord_of(start, L::load_rotations(&to[lane..]));
            let chord_square = dot(chord, chord);
            let step = FromIdentity {
                vector: step_vector(start, chord),
                cosm1: chord_square * L::all(-0.5),
            };
            chord_square.store(&mut own.chords[lane..lane + L::COUNT]);
            store(&mut own.logs, lane, log(step, &LOG));
        }
    }
}
