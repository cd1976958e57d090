//! Steps between the keys of a block's intervals, in vector lanes of f32: from the
//! differences of neighbouring keys, which f32 knows as exactly as the keys.

use crate::method::interpolation::Path;
use crate::prepare::double::intervals::{Intervals, ROOM};
use crate::prepare::single::exp_log::{LOG, Row, log, store};
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;
use crate::twin::small_angle::{FromIdentity, chord_of, step_vector};

/// Up to which inner product of two keys f32 does not know which sign is the nearer one.
const DOUBT: f32 = 1e-3;

/// And from which on two keys may have no path between them.
const OPPOSITE: f32 = -0.99;

/// The squares of chords between keys that [`LOG`] takes.
pub(crate) const LONGEST_CHORD: f32 = 1.0;

/// Steps between the keys of a block's intervals.
pub(crate) struct KeySteps {
    may_flip: bool,
    /// -1 where the sign of an interval's second key is turned.
    pub(crate) flips: Row,
    /// Whether any is.
    pub(crate) any_flips: bool,
    /// The squares of the differences of keys.
    pub(crate) chords: Row,
    /// The steps' logarithms.
    pub(crate) logs: [Row; 3],
    /// Whether f32 may be wrong about a sign.
    pub(crate) are_in_doubt: bool,
}

impl KeySteps {
    pub(crate) fn new(path: Path) -> Self {
        Self {
            may_flip: path == Path::Shortest,
            flips: [1.0; ROOM],
            any_flips: false,
            chords: [0.0; ROOM],
            logs: [[0.0; ROOM]; 3],
            are_in_doubt: false,
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
        let (mut are_in_doubt, mut any_flips) = (false, false);
        for lane in (0..self.intervals.whole32()).step_by(L::COUNT) {
            let start = L::load_rotations(&from[lane..]);
            let [x, y, z, w] = L::load_rotations(&to[lane..]);
            let dot = start[0] * x + start[1] * y + start[2] * z + start[3] * w;
            let flip = if own.may_flip {
                are_in_doubt |= dot.any_within(DOUBT);
                dot.sign()
            } else {
                are_in_doubt |= dot.any_at_most(OPPOSITE);
                L::all(1.0)
            };
            let chord = chord_of(start, [x * flip, y * flip, z * flip, w * flip]);
            let [x, y, z, w] = chord;
            let chord_square = x * x + y * y + z * z + w * w;
            let step = FromIdentity {
                vector: step_vector(start, chord),
                cosm1: chord_square * L::all(-0.5),
            };
            any_flips |= flip.any_at_most(-1.0);
            flip.store(&mut own.flips[lane..lane + L::COUNT]);
            chord_square.store(&mut own.chords[lane..lane + L::COUNT]);
            store(&mut own.logs, lane, log(step, &LOG));
        }
        (own.are_in_doubt, own.any_flips) = (are_in_doubt, any_flips);
    }
}
