//! Curves from their first key and three half-rotation vectors, in vector lanes of f32: fits
//! of the whole, or of parts of equal length.

use std::ops::Range;

use bytemuck::Zeroable as _;

use super::fit::{MOST, Samples, interpolate};
use super::intervals::{LANES, ROOM, rounded};
use super::part::{Gain, Part};
use super::sample::{AboutMiddle, SineAndFall, about};
use super::sides::Sides;
use super::turns::{exact_exp, long_exp, short_exp, widened};
use super::whole_lanes::CurveNumbers;
use crate::branchless::{normalised, product, scaled, square};
use crate::cpu::{InLanes, Lanes, Number, Turn, both, brought_behind, in_lanes};
use crate::segment::PolynomialSegment;

/// Some lanes.
pub(super) struct List {
    count: usize,
    lanes: [u32; ROOM_FOR],
}

/// As many as a block has, and the last vector; or each for every quarter of it. A power of two.
const ROOM_FOR: usize = 4 * LANES;

impl List {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            lanes: [0; ROOM_FOR],
        }
    }

    /// Adds a lane.
    pub(super) fn push(&mut self, lane: usize) {
        self.push_if(true, lane);
    }

    /// Adds a lane where it `is_wanted`, without a branch.
    #[inline(always)]
    pub(super) fn push_if(&mut self, is_wanted: bool, lane: usize) {
        self.lanes[self.count % ROOM_FOR] = lane as u32;
        self.count += usize::from(is_wanted);
    }

    /// Adds those of some lanes that are wanted: which they are cannot be foreseen.
    #[inline]
    pub(super) fn push_where(
        &mut self,
        lanes: Range<usize>,
        energies: &[f32],
        is_wanted: impl Fn(f32) -> bool,
    ) {
        let mut count = self.count;
        for (lane, &energy) in lanes.zip(energies) {
            self.lanes[count % ROOM_FOR] = lane as u32;
            count += usize::from(is_wanted(energy));
        }
        self.count = count;
    }

    /// Takes the last one away.
    pub(super) fn pop(&mut self) -> Option<usize> {
        self.count = self.count.checked_sub(1)?;
        Some(self.lanes[self.count] as usize)
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The lanes.
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        self.lanes[..self.count].iter().map(|&lane| lane as usize)
    }

    /// Forgets them.
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Fits a part of the curves to the segments at their lanes' places; those that do not
    /// fit are `unfit`.
    pub(super) fn fit<const SAMPLED: usize, const PAIRS: usize>(
        &self,
        part: &Part<SAMPLED, PAIRS>,
        curves: &CurveNumbers,
        places: &[u32; ROOM],
        segments: &mut Vec<PolynomialSegment>,
        unfit: &mut List,
    ) {
        if self.count == 0 {
            return;
        }
        // For the last vector's lanes that have no curve.
        segments.push(PolynomialSegment::zeroed());
        in_lanes(&mut Fit {
            list: self,
            part,
            curves,
            places,
            segments,
            unfit,
        });
        segments.pop();
    }
}

/// Curves that wait until a block of them is full.
pub(super) struct Queue {
    numbers: CurveNumbers,
    list: List,
}

impl Queue {
    pub(super) fn new() -> Self {
        Self {
            numbers: [[[0.0; 4]; ROOM]; 5],
            list: List::new(),
        }
    }

    /// Takes the curve in a lane; gives its own.
    pub(super) fn push(&mut self, numbers: &CurveNumbers, lane: usize) -> usize {
        let own = self.list.count;
        for (waiting, numbers) in self.numbers.iter_mut().zip(numbers) {
            waiting[own] = numbers[lane];
        }
        self.list.push(own);
        own
    }

    pub(super) fn count(&self) -> usize {
        self.list.count
    }

    pub(super) fn is_full(&self) -> bool {
        self.count() == LANES
    }

    /// A curve's numbers.
    pub(super) fn numbers(&self, lane: usize) -> [[f32; 4]; 5] {
        self.numbers.each_ref().map(|all| all[lane])
    }

    /// As [`List::fit`].
    pub(super) fn fit<const SAMPLED: usize, const PAIRS: usize>(
        &self,
        part: &Part<SAMPLED, PAIRS>,
        places: &[u32; ROOM],
        segments: &mut Vec<PolynomialSegment>,
        unfit: &mut List,
    ) {
        self.list.fit(part, &self.numbers, places, segments, unfit);
    }

    /// Forgets them.
    pub(super) fn clear(&mut self) {
        self.list.clear();
    }
}

struct Fit<'a, const SAMPLED: usize, const PAIRS: usize> {
    list: &'a List,
    part: &'a Part<SAMPLED, PAIRS>,
    curves: &'a CurveNumbers,
    places: &'a [u32; ROOM],
    segments: &'a mut [PolynomialSegment],
    unfit: &'a mut List,
}

impl<const SAMPLED: usize, const PAIRS: usize> InLanes for Fit<'_, SAMPLED, PAIRS> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        if self.part.is_whole {
            self.fit::<L, true>();
        } else {
            self.fit::<L, false>();
        }
    }
}

impl<const SAMPLED: usize, const PAIRS: usize> Fit<'_, SAMPLED, PAIRS> {
    #[inline(always)]
    fn fit<L: Lanes, const IS_WHOLE: bool>(&mut self) {
        let &List { count, ref lanes } = self.list;
        let tolerance = self.part.tolerance;
        let mut samples = Samples::all(L::all(0.0));
        for i in (0..count).step_by(L::COUNT) {
            let lanes = &lanes[i..i + L::COUNT];
            let own = &lanes[..L::COUNT.min(count - i)];
            let [starts, firsts, seconds, thirds, ends] = self.curves;
            let start = L::gather_rotations(starts, lanes);
            let [x1, y1, z1, _] = L::gather_rotations(firsts, lanes);
            let [x2, y2, z2, _] = L::gather_rotations(seconds, lanes);
            let [x3, y3, z3, _] = L::gather_rotations(thirds, lanes);
            let vectors = [[x1, y1, z1], [x2, y2, z2], [x3, y3, z3]];
            sample::<L, SAMPLED, PAIRS, IS_WHOLE>(&mut samples, start, vectors, self.part);
            if SAMPLED < PAIRS {
                let end = L::gather_rotations(ends, lanes);
                set_ends(&mut samples, [start, end], vectors);
            }
            let mut places = [self.segments.len() - 1; MOST];
            for (place, &lane) in places.iter_mut().zip(own) {
                *place = self.places[lane as usize] as usize;
            }
            let nodes = self.part.nodes;
            let tail = interpolate(true, nodes, &samples, &places, self.segments);
            if (-tail).any_at_most(-tolerance) {
                let mut tails = [0.0; MOST];
                tail.store(&mut tails[..L::COUNT]);
                for (&lane, tail) in own.iter().zip(tails) {
                    self.unfit.push_if(tail > tolerance, lane as usize);
                }
            }
        }
    }
}

/// Samples curves from that key on, with those half-rotation vectors.
#[inline(always)]
fn sample<L: Lanes, const SAMPLED: usize, const PAIRS: usize, const IS_WHOLE: bool>(
    samples: &mut Samples<L, PAIRS>,
    start: [L; 4],
    [w1, w2, w3]: [[L; 3]; 3],
    part: &Part<SAMPLED, PAIRS>,
) {
    let [b1, b2, b3] = part.weights;
    let third_turn = exp::<L, IS_WHOLE>(w3, b3);
    let second_turn = both(exp::<L, IS_WHOLE>(w2, b2), third_turn);
    let middle = if IS_WHOLE {
        let turn = both(exp::<L, IS_WHOLE>(w1, b1), second_turn);
        let [x, y, z] = turn.vector;
        let [x, y, z, w] = product(start, [x, y, z, turn.fall]);
        [x + start[0], y + start[1], z + start[2], w + start[3]]
    } else {
        exact_middle(start, [w1, w2, w3], part.weights)
    };
    let v1 = brought_behind(w1, second_turn);
    let v2 = brought_behind(w2, third_turn);
    let curve = AboutMiddle::new(middle, [v1, v2, w3]);
    let squares = [square(v1), square(v2), square(w3)];
    samples.middle = middle;
    for (k, gains) in part.gains.iter().enumerate() {
        let second = if IS_WHOLE {
            let [_, after] = gains[1];
            let (sine, fall) = turned(L::all(after.gain), L::all(after.squared), squares[1]);
            let sine = Sides {
                before: -sine,
                after: sine,
            };
            (sine, Sides::same(fall))
        } else {
            on_both_sides(gains[1], squares[1])
        };
        let first = on_both_sides(gains[0], squares[0]);
        let third = on_both_sides(gains[2], squares[2]);
        samples.set_differences(k, curve.differences([first, second, third]));
    }
}

/// Sets what curves do at their ends: they pass through the keys, and the derivatives there,
/// `3 q₀ w₁` and `3 q₁ w₃`, are those of the handles.
#[inline(always)]
fn set_ends<L: Lanes, const PAIRS: usize>(
    samples: &mut Samples<L, PAIRS>,
    [start, end]: [[L; 4]; 2],
    [w1, _, w3]: [[L; 3]; 3],
) {
    let middle = samples.middle;
    let three = L::all(3.0);
    let slopes = [
        about(start, scaled(w1, three)),
        about(end, scaled(w3, three)),
    ];
    // Written out: closures are not always inlined.
    let mut differences = [Sides::same(three); 4];
    let mut derivatives = differences;
    for c in 0..4 {
        differences[c].before = start[c] - middle[c];
        differences[c].after = end[c] - middle[c];
        derivatives[c].before = slopes[0][c];
        derivatives[c].after = slopes[1][c];
    }
    samples.set_differences(PAIRS - 2, differences);
    samples.set_slopes(derivatives);
}

/// The exponential of so many times a vector.
#[inline(always)]
fn exp<L: Lanes, const SHORT: bool>(vector: [L; 3], times: f32) -> Turn<L> {
    let vector = scaled(vector, L::all(times));
    if SHORT {
        short_exp(vector)
    } else {
        long_exp(vector)
    }
}

/// Where the turns are longer, f32 would round more than that.
#[inline(always)]
fn exact_middle<L: Lanes>(
    start: [L; 4],
    [w1, w2, w3]: [[L; 3]; 3],
    [b1, b2, b3]: [f32; 3],
) -> [L; 4] {
    let turn = product(exact_exp(w1, b1), exact_exp(w2, b2));
    rounded::<L>(product(
        normalised(widened(start)),
        product(turn, exact_exp(w3, b3)),
    ))
}

#[inline(always)]
fn on_both_sides<L: Lanes>([before, after]: [Gain; 2], square: L) -> SineAndFall<Sides<L>> {
    let gain = Sides {
        before: L::all(before.gain),
        after: L::all(after.gain),
    };
    let squared = Sides {
        before: L::all(before.squared),
        after: L::all(after.squared),
    };
    turned(gain, squared, Sides::same(square))
}

/// Coefficients of `(sin(x)/x - 1) / x²` and of `(cos(x) - 1) / x²` in powers of x², for x²
/// up to 0.201; from Chebyshev nodes, within 3e-9.
const SINC: [f32; 3] = [-0.166_666_67, 0.008_333_27, -0.000_197_583_55];
const FALL: [f32; 3] = [-0.5, 0.041_666_105, -0.001_381_43];

/// Of a vector with that square, times a gain with the square `squared`.
#[inline(always)]
fn turned<N: Number>(gain: N, squared: N, square: N) -> SineAndFall<N> {
    let z = square * squared;
    let sinc = ((N::all(SINC[2]) * z + N::all(SINC[1])) * z + N::all(SINC[0])) * z;
    let fall = ((N::all(FALL[2]) * z + N::all(FALL[1])) * z + N::all(FALL[0])) * z;
    (gain * sinc + gain, fall)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::fit::LONGEST_WHOLE;
    use crate::prepare::part::{HALVES, LONGEST_HALVED, QUARTERS, WHOLE};
    use crate::prepare::turns::tests::assert_near;
    use crate::prepare::whole_lanes::LONGEST_DIRECT;

    /// Catches a wrong digit in a coefficient, and a range that is too short.
    #[test]
    fn waves_hold_for_every_curve_that_is_fitted() {
        let sinc = |z: f64| libm::sin(libm::sqrt(z)) / libm::sqrt(z);
        assert_near(&SINC.map(f64::from), LARGEST, sinc, 3e-9);
        let cosine = |z: f64| libm::cos(libm::sqrt(z));
        assert_near(&FALL.map(f64::from), LARGEST, cosine, 3e-9);
        let of_parts = |parts: &[Part<5, 5>]| parts.iter().flat_map(|part| part.gains).collect();
        for (gains, longest) in [
            (WHOLE.gains.to_vec(), LONGEST_WHOLE),
            (of_parts(&HALVES), LONGEST_HALVED),
            (of_parts(&QUARTERS), LONGEST_DIRECT),
        ] {
            let gains = gains.as_flattened();
            let most = gains
                .iter()
                .flatten()
                .fold(0.0f32, |most, gain| most.max(gain.squared));
            assert!(f64::from(most) * longest < LARGEST);
        }
    }

    const LARGEST: f64 = 0.201;
}
