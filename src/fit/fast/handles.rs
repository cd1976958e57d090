//! Steps, handles and curves in vector lanes of f32, directly from four keys; the Hermite fit then fits the curves as
//! a whole or in two halves.
//!
//! Steps are computed from the differences of neighbouring keys, which are as exact in f32 as the keys, and rotations
//! are stored as their difference from the identity: then rounding errors are small for small angles. Only the vector
//! between the handles is computed in f64, because the rounding errors of all other numbers would add up in it.

use bytemuck::Zeroable;

use crate::fit::block::{Intervals, ROW_LEN, rounded, squared_extent, widened};
use crate::fit::fast::exp_log::{LOG, LONG_LOG, RowF32, load3, log, long_exp, medium_exp, store};
use crate::fit::tangent_weights::KeyWeights;
use crate::math::quaternion::{self, Real as _, dot, minus, product, scaled, square, sum};
use crate::math::ranges::{MEDIUM_WAVES, one_plus};
use crate::shader::KEY_INNER;
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::twin::small_angle::{FromIdentity, chord_of, composed, step_vector};

/// The coefficients of `(x / sin(x) - 1) / u` in powers of u = 1 - cos(x), up to
/// [`LARGEST_COSINE_MINUS_ONE`]; from Chebyshev nodes, within 5e-10.
const MEDIUM_LOG: [f64; 8] = [
    0.333_333_332_749_309,
    0.133_333_465_469_371,
    0.057_137_994_819_463,
    0.025_464_296_345_686,
    0.011_090_593_728_92,
    0.006_946_432_245_739,
    -0.000_581_458_801_535,
    0.003_890_906_082_331,
];

/// An upper bound of 1 - cos(x), where x is the length of any half-rotation vector of a curve with
/// a squared extent of at most [`LONGEST_DIRECT`].
const LARGEST_COSINE_MINUS_ONE: f32 = 0.5645;

/// The largest squared chord between keys for which [`LOG`] is valid.
const LONGEST_CHORD: f32 = 1.0;

/// The largest squared extent of a curve whose f32 numbers are valid.
pub(crate) const LONGEST_DIRECT: f64 = MEDIUM_WAVES.limit;

/// Added to the squared extent of a curve whose numbers may not be valid, so that it exceeds every
/// bound of the fast fits.
const IN_DOUBT: f64 = 2.0;
const _: () = assert!(IN_DOUBT > LONGEST_DIRECT);

const THIRD: f32 = 1.0 / 3.0;
const TWO_THIRDS: f32 = 2.0 / 3.0;

/// The largest square of the half-rotation vectors from which a tangent is computed, and of their sum. Up to it no
/// other branch of the tangent's logarithm is nearer than the principal one.
const LONGEST_TANGENT_PART: f32 = 1.5 * 1.5;

/// Lanes after those of a block, in which curves of earlier blocks wait to be fitted.
pub(crate) const SPARE_LANES: usize = 3 * MAX_LANES;

/// The first key of each curve, its three half-rotation vectors, and its last key.
pub(crate) type CurveNumbers = [[[f32; 4]; ROW_LEN + SPARE_LANES]; 5];

/// The steps, handles and curves of a block's intervals, in f32.
#[derive(Zeroable)]
pub(crate) struct HandlesF32 {
    /// The squares of the differences of keys.
    pub(crate) chords: RowF32,
    /// The steps' logarithms.
    logs: [RowF32; 3],
    /// Handles at the key that the interval starts with, towards the interval before it
    /// and towards this one.
    pub(crate) incoming: [RowF32; 3],
    pub(crate) outgoing: [RowF32; 3],
    /// The largest ratio of a quantity in the tangent to its limit. Up to 1 the f32 handles are valid.
    pub(crate) limit_ratio: RowF32,
    pub(crate) numbers: CurveNumbers,
    /// The squared extent of each curve. It is above [`LONGEST_DIRECT`] where the f32 numbers are
    /// not valid.
    pub(crate) squared_extents: RowF32,
}

impl HandlesF32 {
    pub(crate) fn new() -> Self {
        Self {
            squared_extents: [f32::INFINITY; ROW_LEN],
            ..Self::zeroed()
        }
    }
}

/// Finds the steps between keys.
pub(crate) struct FindSteps<'a> {
    pub(crate) lanes: &'a mut HandlesF32,
    pub(crate) intervals: &'a Intervals,
}

impl InLanes for FindSteps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Intervals { from, to, .. } = self.intervals;
        let lanes = &mut *self.lanes;
        for lane in (0..self.intervals.padded_count_f32()).step_by(L::COUNT) {
            let start = L::load_rotations(&from[lane..]);
            let chord = chord_of(start, L::load_rotations(&to[lane..]));
            let chord_square = dot(chord, chord);
            let step = FromIdentity {
                vector: step_vector(start, chord),
                cosm1: chord_square * L::all(-0.5),
            };
            chord_square.store(&mut lanes.chords[lane..lane + L::COUNT]);
            store(&mut lanes.logs, lane, log(step, &LOG));
        }
    }
}

/// The number of keys with long tangents that are computed together; a block has few of them.
pub(crate) const AT_ONCE: usize = 8;

/// Finds the handles of the keys between intervals, and the curves between handles.
pub(crate) struct FindCurves<'a> {
    pub(crate) lanes: &'a mut HandlesF32,
    pub(crate) weights: &'a KeyWeights,
    pub(crate) intervals: &'a Intervals,
    /// Whether a lane has its curve already.
    pub(crate) known: &'a [bool; ROW_LEN],
    /// Sets the handles for which the range of f32's formulas is too short, in f64:
    /// [`set_long`](crate::fit::fast::long_tangents::set_long).
    pub(crate) set_long: fn(&mut HandlesF32, &[usize], &Intervals),
}

impl InLanes for FindCurves<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        self.handles::<L>();
        self.curves::<L>();
    }
}

impl FindCurves<'_> {
    #[inline(always)]
    fn handles<L: Lanes>(&mut self) {
        let (weights, intervals) = (self.weights, self.intervals);
        let lanes = &mut *self.lanes;
        let (mut long_tangents, mut long_count) = ([0; ROW_LEN], 0);
        for lane in (0..intervals.padded_count_f32()).step_by(L::COUNT) {
            let key = lane + 1;
            if !self.known[lane..key + L::COUNT].contains(&false) {
                continue;
            }
            let [before, after, to_end, kind] = weights.load::<L>(key);
            let left = scaled(load3::<L>(&lanes.logs, lane), before);
            let right = scaled(load3::<L>(&lanes.logs, key), after);
            let rotation = composed(long_exp(left), long_exp(right));
            let tangent = log(rotation, &LONG_LOG);
            let to_start = L::all(THIRD) - to_end;
            store(&mut lanes.incoming, key, scaled(tangent, to_start));
            store(&mut lanes.outgoing, key, scaled(tangent, to_end));
            // 2/3 of `KEY_UNKNOWN` is 4/3, which exceeds the limit of 1, so the intervals at such a key are in doubt.
            let kind = kind * L::all(2.0 / 3.0);
            let parts = square(left).larger(square(right).larger(square(sum(left, right))));
            let limit_ratio = parts * L::all(1.0 / LONGEST_TANGENT_PART);
            let limit_ratio = limit_ratio.larger(kind).larger(-rotation.cosm1);
            limit_ratio.store(&mut lanes.limit_ratio[key..key + L::COUNT]);
            if (-limit_ratio).any_at_most(-1.0) {
                for key in key..key + L::COUNT {
                    let is_long =
                        lanes.limit_ratio[key] >= 1.0 && weights.keys[key].kind == KEY_INNER;
                    long_tangents[long_count] = key;
                    long_count += usize::from(is_long);
                }
            }
        }
        for keys in long_tangents[..long_count].chunks(AT_ONCE) {
            (self.set_long)(lanes, keys, intervals);
        }
    }

    #[inline(always)]
    fn curves<L: Lanes>(&mut self) {
        let (weights, intervals) = (self.weights, self.intervals);
        let whole = &mut *self.lanes;
        for lane in (0..intervals.padded_count_f32()).step_by(L::COUNT) {
            let (this, next) = (lane + 1, lane + 2);
            if !self.known[this..this + L::COUNT].contains(&false) {
                continue;
            }
            let log = load3::<L>(&whole.logs, this);
            let outgoing = load3::<L>(&whole.outgoing, this);
            let incoming = load3::<L>(&whole.incoming, next);
            // At the ends of a track the handle is 0 so far. For parabolic ends it is replaced here.
            let parabola = scaled(log, L::all(TWO_THIRDS));
            let [_, _, _, first] = weights.load::<L>(this);
            let [_, _, _, last] = weights.load::<L>(next);
            let (at_first, at_last) = (at_end(first), at_end(last));
            let w1 = sum(outgoing, scaled(minus(parabola, incoming), at_first));
            let w3 = sum(incoming, scaled(minus(parabola, outgoing), at_last));
            let start = L::load_rotations(&intervals.from[this..]);
            let end = L::load_rotations(&intervals.to[this..]);
            let (w2, cosine_minus_one) = between::<L>(w1, [start, end], w3);
            let chord = L::load(&whole.chords[this..]);
            let before = L::load(&whole.chords[lane..]);
            let after = L::load(&whole.chords[next..]);
            let chords = before.larger(chord.larger(after)) * L::all(1.0 / LONGEST_CHORD);
            let limit_ratio =
                L::load(&whole.limit_ratio[this..]).larger(L::load(&whole.limit_ratio[next..]));
            let limit_ratio = limit_ratio
                .larger(chords)
                .larger(cosine_minus_one * L::all(-1.0 / LARGEST_COSINE_MINUS_ONE));
            // 0 where everything is valid, otherwise `IN_DOUBT`. NaN counts as in doubt, because its `sign` is 1.
            let half = L::all(0.5 * IN_DOUBT as f32);
            let doubt = (limit_ratio - L::all(1.0)).sign() * half + half;
            let squared_extent = squared_extent([w1, w2, w3]) + doubt;
            let none = L::all(0.0);
            let numbers = [
                start,
                [w1[0], w1[1], w1[2], none],
                [w2[0], w2[1], w2[2], none],
                [w3[0], w3[1], w3[2], none],
                end,
            ];
            squared_extent.store(&mut whole.squared_extents[this..this + L::COUNT]);
            for (i, all) in whole.numbers.iter_mut().enumerate() {
                L::store_rotations(numbers[i], &mut all[this..this + L::COUNT]);
            }
        }
    }
}

/// `w₂ = log(exp(-w₁) q₀⁻¹ q₁ exp(-w₃))`, and the cosine of its angle minus one.
#[inline(always)]
fn between<L: Lanes>(w1: [L; 3], [start, end]: [[L; 4]; 2], w3: [L; 3]) -> ([L; 3], L) {
    let all = L::Doubles::all;
    let (start, end) = (widened(start), widened(end));
    let [x, y, z, w] = quaternion::step(start, end);
    // Keys have norm 1 to f32's precision: one step of Newton's method normalises both.
    let scale = all(1.5) - all(0.5) * dot(start, start) * dot(end, end);
    let step = [x * scale, y * scale, z * scale, w * scale];
    let [x, y, z, w] = product(product(medium_exp(w1, -1.0), step), medium_exp(w3, -1.0));
    let u = all(1.0) - w;
    let vector = scaled([x, y, z], one_plus(&MEDIUM_LOG, u));
    (rounded(vector), L::rounded(-u))
}

/// 1 for `KEY_AT_END`, 0 for `KEY_INNER` and `KEY_UNKNOWN`.
#[inline(always)]
fn at_end<L: Lanes>(kind: L) -> L {
    kind * (L::all(2.0) - kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fast::exp_log::tests::{assert_near, longer};

    /// Catches a wrong digit in a coefficient, and a range that is too short.
    #[test]
    fn logarithms_hold_for_every_curve_that_is_fitted() {
        assert_near(
            &MEDIUM_LOG,
            f64::from(LARGEST_COSINE_MINUS_ONE),
            longer,
            5e-10,
        );
        assert!(1.0 - LONGEST_DIRECT.sqrt().cos() < f64::from(LARGEST_COSINE_MINUS_ONE));
    }
}
