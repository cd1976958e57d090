//! Lists of a block's lanes, and the Hermite fit of the curves in them.

use bytemuck::Zeroable as _;

use crate::fit::double::fit::{MOST, Samples};
use crate::fit::double::intervals::{LANES, ROOM};
use crate::fit::single::handles::CurveNumbers;
use crate::fit::single::hermite_fit::{BetweenKeys, KeyFit};
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// A list of lanes.
pub(crate) struct List {
    count: usize,
    lanes: [u32; ROOM_FOR],
}

/// Room for all lanes of a block and the rest of the last vector.
const ROOM_FOR: usize = LANES + MOST;

impl List {
    pub(crate) fn new() -> Self {
        Self {
            count: 0,
            lanes: [0; ROOM_FOR],
        }
    }

    /// Adds a lane of the block.
    #[inline]
    pub(crate) fn push(&mut self, lane: usize) {
        self.lanes[self.count] = lane as u32;
        self.count += 1;
    }

    /// The lanes.
    pub(crate) fn lanes(&self) -> &[u32] {
        &self.lanes[..self.count]
    }

    /// Empties the list.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }
}

/// Fits the curves in the listed lanes into the segments at their places, and empties the list.
pub(crate) fn fit<const PAIRS: usize>(
    how: &impl KeyFit<PAIRS>,
    list: &mut List,
    curves: &CurveNumbers,
    places: &[usize; ROOM],
    prepared: &mut Prepared,
) {
    if list.count == 0 {
        return;
    }
    let segments = &mut prepared.segments.polynomials;
    let count = segments.len();
    // The lanes of the last vector that have no curve write to two extra segments.
    segments.extend([PolynomialSegment::zeroed(); 2]);
    in_lanes(&mut Fit::<_, PAIRS> {
        how,
        list,
        curves,
        places,
        segments,
    });
    segments.truncate(count);
    list.clear();
}

struct Fit<'a, F, const PAIRS: usize> {
    how: &'a F,
    list: &'a List,
    curves: &'a CurveNumbers,
    places: &'a [usize; ROOM],
    /// All segments, and two extra ones at the end.
    segments: &'a mut [PolynomialSegment],
}

impl<F: KeyFit<PAIRS>, const PAIRS: usize> InLanes for Fit<'_, F, PAIRS> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let &List { count, ref lanes } = self.list;
        // Made outside the loop, so that they are cleared only once.
        let mut samples = Samples::<L, PAIRS>::all(L::all(0.0));
        for i in (0..count).step_by(L::COUNT) {
            let lanes = &lanes[i..i + L::COUNT];
            let own = &lanes[..L::COUNT.min(count - i)];
            let [starts, firsts, seconds, thirds, ends] = self.curves;
            let start = L::gather_rotations(starts, lanes);
            let [x1, y1, z1, _] = L::gather_rotations(firsts, lanes);
            let [x2, y2, z2, _] = L::gather_rotations(seconds, lanes);
            let [x3, y3, z3, _] = L::gather_rotations(thirds, lanes);
            let curves = BetweenKeys {
                start,
                vectors: [[x1, y1, z1], [x2, y2, z2], [x3, y3, z3]],
                end: L::gather_rotations(ends, lanes),
            };
            let mut places = [self.segments.len() - 2; MOST];
            for (place, &lane) in places.iter_mut().zip(own) {
                *place = self.places[lane as usize];
            }
            self.how.fit(&mut samples, &curves, &places, self.segments);
        }
    }
}
