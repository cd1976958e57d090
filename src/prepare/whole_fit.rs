//! Curves from their first key and three half-rotation vectors, in vector lanes of f32: fits
//! of the whole.

use bytemuck::Zeroable as _;

use super::fit::{MOST, Samples, interpolate};
use super::intervals::{LANES, ROOM};
use super::nodes::Nodes;
use super::sample::{SineAndFall, Terms};
use super::turns::exp;
use super::whole_lanes::WholeLanes;
use crate::branchless::{product, scaled, square};
use crate::cpu::{InLanes, Lanes, both, brought_behind, in_lanes};
use crate::segment::PolynomialSegment;

/// Lanes whose curves are to be fitted with as many powers.
pub(super) struct List {
    /// See [`super::fit::TOLERANCE`].
    tolerance: f32,
    count: usize,
    lanes: [u32; ROOM_FOR],
}

/// As many as a block has, and the last vector; a power of two.
const ROOM_FOR: usize = 2 * LANES;

impl List {
    pub(super) fn new(tolerance: f32) -> Self {
        Self {
            tolerance,
            count: 0,
            lanes: [0; ROOM_FOR],
        }
    }

    /// Adds a lane where it `is_wanted`, without a branch.
    #[inline(always)]
    pub(super) fn push_if(&mut self, is_wanted: bool, lane: usize) {
        self.lanes[self.count % ROOM_FOR] = lane as u32;
        self.count += usize::from(is_wanted);
    }

    /// Fits the curves to the segments at their lanes' places, and forgets them; those that
    /// do not fit are `unfit`.
    pub(super) fn fit<const PAIRS: usize>(
        &mut self,
        curves: &WholeLanes,
        nodes: &'static Nodes<PAIRS>,
        places: &[u32; ROOM],
        segments: &mut Vec<PolynomialSegment>,
        unfit: &mut Vec<usize>,
    ) {
        let count = std::mem::take(&mut self.count);
        if count == 0 {
            return;
        }
        // For the last vector's lanes that have no curve.
        segments.push(PolynomialSegment::zeroed());
        in_lanes(&mut FitWhole {
            tolerance: self.tolerance,
            count,
            lanes: &self.lanes,
            curves,
            nodes,
            gains: gains(nodes),
            places,
            segments,
            unfit,
        });
        segments.pop();
    }
}

struct FitWhole<'a, const PAIRS: usize> {
    tolerance: f32,
    count: usize,
    lanes: &'a [u32; ROOM_FOR],
    curves: &'a WholeLanes,
    nodes: &'static Nodes<PAIRS>,
    gains: [[f32; 3]; PAIRS],
    places: &'a [u32; ROOM],
    segments: &'a mut [PolynomialSegment],
    unfit: &'a mut Vec<usize>,
}

impl<const PAIRS: usize> InLanes for FitWhole<'_, PAIRS> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for i in (0..self.count).step_by(L::COUNT) {
            let lanes = &self.lanes[i..i + L::COUNT];
            let own = &lanes[..L::COUNT.min(self.count - i)];
            let [starts, firsts, seconds, thirds] = &self.curves.numbers;
            let start = L::gather_rotations(starts, lanes);
            let [x1, y1, z1, _] = L::gather_rotations(firsts, lanes);
            let [x2, y2, z2, _] = L::gather_rotations(seconds, lanes);
            let [x3, y3, z3, _] = L::gather_rotations(thirds, lanes);
            let vectors = [[x1, y1, z1], [x2, y2, z2], [x3, y3, z3]];
            let samples = samples(start, vectors, &self.gains);
            let mut places = [self.segments.len() - 1; MOST];
            for (place, &lane) in places.iter_mut().zip(own) {
                *place = self.places[lane as usize] as usize;
            }
            let tail = interpolate(true, self.nodes, &samples, &places, self.segments);
            if (-tail).any_at_most(-self.tolerance) {
                let mut tails = [0.0; MOST];
                tail.store(&mut tails[..L::COUNT]);
                let tails = own.iter().zip(tails);
                let unfit = tails.filter(|(_, tail)| *tail > self.tolerance);
                self.unfit.extend(unfit.map(|(&lane, _)| lane as usize));
            }
        }
    }
}

/// What the basis functions gain from the middle on, at each node `s`: the first and the
/// third `gains[k][0]` and `gains[k][2]` up to `s`, and the other way round, both negative,
/// up to `-s`; the second `gains[k][1]` and as much.
fn gains<const PAIRS: usize>(nodes: &Nodes<PAIRS>) -> [[f32; 3]; PAIRS] {
    nodes.at.map(|s| {
        let s = f64::from(s);
        [
            (((s - 1.5) * s + 0.75) * s) as f32,
            ((1.5 - 2.0 * s * s) * s) as f32,
            (((s + 1.5) * s + 0.75) * s) as f32,
        ]
    })
}

/// Samples of curves from that key on, with those half-rotation vectors.
#[inline(always)]
fn samples<L: Lanes, const PAIRS: usize>(
    start: [L; 4],
    [w1, w2, w3]: [[L; 3]; 3],
    gains: &[[f32; 3]; PAIRS],
) -> Samples<L, PAIRS> {
    let third_turn = exp(scaled(w3, L::all(0.125)));
    let second_turn = both(exp(scaled(w2, L::all(0.5))), third_turn);
    let turn = both(exp(scaled(w1, L::all(0.875))), second_turn);
    let [x, y, z] = turn.vector;
    let [x, y, z, w] = product(start, [x, y, z, turn.fall]);
    let middle = [x + start[0], y + start[1], z + start[2], w + start[3]];
    let v1 = brought_behind(w1, second_turn);
    let v2 = brought_behind(w2, third_turn);
    let terms = Terms::about_middle(middle, [v1, v2, w3]);
    let (first, second, third) = (square(v1), square(v2), square(w3));
    let mut samples = Samples::all(L::all(0.0));
    samples.middle = middle;
    for (k, &[less, own, more]) in gains.iter().enumerate() {
        let after = [
            turned(less, first),
            turned(own, second),
            turned(more, third),
        ];
        let before = [
            turned(-more, first),
            (-after[1].0, after[1].1),
            turned(-less, third),
        ];
        samples.set_differences(k, terms.differences([before, after]));
    }
    samples
}

/// Coefficients of `(sin(x)/x - 1) / x²` and of `(cos(x) - 1) / x²` in powers of x², for x²
/// up to 0.1536; from Chebyshev nodes, within 1e-9.
const SINC: [f32; 3] = [-0.166_666_67, 0.008_333_296_5, -0.000_197_778_78];
const FALL: [f32; 3] = [-0.5, 0.041_666_34, -0.001_383_185_6];

/// Of a vector with that square, times `gain`.
#[inline(always)]
fn turned<L: Lanes>(gain: f32, square: L) -> SineAndFall<L> {
    let z = square * L::all(gain * gain);
    let gain = L::all(gain);
    let sinc = ((L::all(SINC[2]) * z + L::all(SINC[1])) * z + L::all(SINC[0])) * z;
    let fall = ((L::all(FALL[2]) * z + L::all(FALL[1])) * z + L::all(FALL[0])) * z;
    (gain * sinc + gain, fall)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::fit::LONGEST_WHOLE;
    use crate::prepare::nodes::FULL_NODES;
    use crate::prepare::turns::tests::assert_near;

    /// Catches a wrong digit in a coefficient, and a range that is too short.
    #[test]
    fn waves_hold_for_every_curve_that_is_fitted_whole() {
        let sinc = |z: f64| libm::sin(libm::sqrt(z)) / libm::sqrt(z);
        assert_near(&SINC.map(f64::from), LARGEST, sinc, 1e-9);
        let cosine = |z: f64| libm::cos(libm::sqrt(z));
        assert_near(&FALL.map(f64::from), LARGEST, cosine, 1e-9);
        let gains = gains(&FULL_NODES);
        let most = gains
            .as_flattened()
            .iter()
            .fold(0.0f32, |most, gain| most.max(*gain));
        assert!(f64::from(most * most) * LONGEST_WHOLE < LARGEST);
    }

    const LARGEST: f64 = 0.1536;
}
