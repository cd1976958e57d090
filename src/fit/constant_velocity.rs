//! Twin of `shaders/from_keys/constant_velocity.wgsl`, one component at a time: arcs as
//! polynomials. A smooth method joins a track's only two keys by such an arc. Its coefficients are
//! Taylor's series of sine and cosine about the middle; nothing is sampled and fitted.

use bytemuck::Zeroable as _;

use crate::fit::double::fit::MOST;
use crate::shader::{
    POWERS, PolynomialSegment, SERIES_2, SERIES_3, SERIES_4, SERIES_5, SERIES_6, SERIES_7,
    SERIES_8, SERIES_9, SERIES_10,
};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, Number};
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::norm_squared;

/// Taylor coefficients of the cosine (even powers) and the sine (odd powers).
const SERIES: [f32; POWERS] = [
    1.0, 1.0, SERIES_2, SERIES_3, SERIES_4, SERIES_5, SERIES_6, SERIES_7, SERIES_8, SERIES_9,
    SERIES_10,
];

/// One component of an arc as a polynomial, from that component of its middle and of its tangent
/// there; `square` is the square of the arc's angle in R⁴. Half of that angle is at most pi/4, so
/// the truncation error is at most 2e-9.
#[inline(always)]
pub(crate) fn arc_component<N: Number>(middle: N, tangent: N, square: N) -> [N; POWERS] {
    let mut coefficients = [middle; POWERS];
    let (mut even, mut odd) = (middle, tangent);
    for k in 0..POWERS / 2 {
        coefficients[2 * k + 1] = (odd * N::all(SERIES[2 * k + 1])).canonical();
        (even, odd) = (even * square, odd * square);
        coefficients[2 * k + 2] = (even * N::all(SERIES[2 * k + 2])).canonical();
    }
    coefficients
}

/// The most arcs that wait to be fitted together.
const MOST_WAITING: usize = 64;

/// Pairs of keys whose arcs wait to become polynomials.
#[derive(Default)]
pub(crate) struct SteadyArcs {
    from: Vec<[f32; 4]>,
    to: Vec<[f32; 4]>,
    /// The place of each polynomial among the segments.
    places: Vec<usize>,
}

impl SteadyArcs {
    /// Adds two keys, the second with the sign nearer to the first, and the place of their segment.
    pub(crate) fn push(
        &mut self,
        [from, to]: [[f32; 4]; 2],
        place: usize,
        segments: &mut Vec<PolynomialSegment>,
    ) {
        self.from.push(from);
        self.to.push(to);
        self.places.push(place);
        if self.places.len() == MOST_WAITING {
            self.fit(segments);
        }
    }

    /// Writes the polynomials to their segments, and forgets the keys.
    pub(crate) fn fit(&mut self, segments: &mut Vec<PolynomialSegment>) {
        if self.places.is_empty() {
            return;
        }
        // The lanes of the last vector that have no keys write to one extra segment.
        let whole = self.places.len().next_multiple_of(MOST);
        self.from.resize(whole, [0.0; 4]);
        self.to.resize(whole, [0.0; 4]);
        self.places.resize(whole, segments.len());
        segments.push(PolynomialSegment::zeroed());
        in_lanes(&mut Fit(self, segments));
        segments.pop();
        self.from.clear();
        self.to.clear();
        self.places.clear();
    }
}

struct Fit<'a>(&'a SteadyArcs, &'a mut [PolynomialSegment]);

impl InLanes for Fit<'_> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Self(SteadyArcs { from, to, places }, segments) = self;
        for j in (0..places.len()).step_by(L::COUNT) {
            let (start, end) = (L::load_rotations(&from[j..]), L::load_rotations(&to[j..]));
            let (middle, tangent) = arc_between(start, end);
            let square = norm_squared(tangent);
            let mut powers = [middle; POWERS];
            for c in 0..4 {
                let own = arc_component(middle[c], tangent[c], square);
                for power in 0..POWERS {
                    powers[power][c] = own[power];
                }
            }
            L::store_powers(&powers, segments, &places[j..]);
        }
    }
}
