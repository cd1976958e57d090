//! Angular velocities and accelerations of curves. Their formulas are evaluated in dual numbers of
//! second order, and the results are fitted like the rotations themselves.

use std::marker::PhantomData;

use crate::curve::formula::{Formula, NUMBERS};
use crate::curve::options::{Axes, Quantity};
use crate::fit::block::{LANES, load, put};
use crate::fit::exact::fit::FitBlock;
use crate::fit::exact::shape::Sampling;
use crate::fit::nodes::{NodeSamples, Nodes};
use crate::math::canonical::power_of_two;
use crate::math::dual::Dual;
use crate::math::quaternion::{FullRange as _, Real, rotated, step};
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::doubles::Doubles as _;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// The quantity asked for, from a rotation and its derivatives by the parameter; `rate` is the
/// parameter's change per second. The result is a quaternion, or a vector with 0 in the place of w.
#[inline(always)]
pub(crate) fn value<R: Real>(quantity: Quantity, rotation: [Dual<R>; 4], rate: R) -> [R; 4] {
    let at = rotation.map(|dual| dual.value);
    let (derivative, scale, axes) = match quantity {
        Quantity::Rotation => return at,
        Quantity::Velocity(axes) => (rotation.map(|dual| dual.first), rate, axes),
        Quantity::Acceleration(axes) => (rotation.map(|dual| dual.second), rate * rate, axes),
    };
    // ω = 2 q⁻¹ q', and its derivative is the vector part of 2 q⁻¹ q''.
    let [x, y, z, _] = step(at, derivative);
    // No closure: those are not always inlined.
    let twice = R::all(2.0) * scale;
    let body = [clamped(twice * x), clamped(twice * y), clamped(twice * z)];
    let [x, y, z] = match axes {
        Axes::Body => body,
        // This holds for accelerations too: ω × ω = 0.
        Axes::Parent => rotated(at, body),
    };
    [x, y, z, R::all(0.0)]
}

/// Between keys at almost the same time velocities would overflow f32. NaN stays NaN.
#[inline(always)]
pub(crate) fn clamped<R: Real>(x: R) -> R {
    let largest = 0.25 * f64::from(f32::MAX);
    let [low, high] = [-largest, largest].map(R::all);
    let raised = low.up_to(x, x, x.up_to(low, low, x));
    high.up_to(raised, high, raised)
}

/// Samples velocities or accelerations of a formula, curves beside each other.
pub(crate) struct MotionOf<F>(PhantomData<F>);

impl<F: Formula> Sampling for MotionOf<F> {
    #[inline(always)]
    fn fit<L: Lanes, const PAIRS: usize>(
        block: &mut FitBlock,
        nodes: &Nodes<PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let zero = L::Doubles::all(0.0);
        let mut scales = [1.0; LANES];
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let mut numbers = [zero; NUMBERS];
            for (number, &shared) in numbers.iter_mut().zip(&block.shape.shared) {
                *number = L::Doubles::all(shared);
            }
            for (number, lanes) in numbers.iter_mut().zip(&block.numbers) {
                *number = L::Doubles::load(&lanes[lane..]);
            }
            let at = L::Doubles::load(&block.middles[lane..]);
            let width = L::Doubles::load(&block.widths[lane..]);
            let rate = L::Doubles::load(&block.rates[lane..]);
            let mut found = [[zero; 4]; POWERS];
            let mut largest = zero;
            for (i, found) in found[..=2 * PAIRS].iter_mut().enumerate() {
                let t = at + L::Doubles::all(nodes.offset(i)) * width;
                let rotation = F::rotation(&numbers, Dual::parameter(t));
                *found = value(block.quantity, rotation, rate);
                for &c in &*found {
                    largest = c.larger(-c).larger(largest);
                }
            }
            let (unit, _) = largest.each(|largest| (power_of_two(largest), 0.0));
            let mut units = [1.0; MAX_LANES];
            unit.store(&mut units);
            let lanes = lane..(lane + L::COUNT).min(LANES);
            for (scale, unit) in scales[lanes].iter_mut().zip(units) {
                *scale = unit as f32;
            }
            let middle = found[0];
            let mut samples = NodeSamples::all(L::all(0.0));
            for c in 0..4 {
                samples.middle[c] = L::rounded(middle[c] / unit);
                for k in 0..PAIRS {
                    let (before, after) = (found[1 + k][c], found[1 + PAIRS + k][c]);
                    let forward = (after - middle[c]) / unit;
                    let backward = (before - middle[c]) / unit;
                    samples.even[k][c] = L::rounded(forward + backward);
                    samples.odd[k][c] = L::rounded(forward - backward);
                }
            }
            block.interpolate(lane, nodes, &samples, segments);
        }
        block.scale(&scales, segments);
    }
}

/// Samples velocities or accelerations, curve by curve: of those at constant speed, and of formulas that are long.
pub(crate) struct Motion;

impl Sampling for Motion {
    #[inline(always)]
    fn fit<L: Lanes, const PAIRS: usize>(
        block: &mut FitBlock,
        nodes: &Nodes<PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let mut scales = [1.0; LANES];
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let mut found = [[[0.0; MAX_LANES]; 4]; POWERS];
            let mut units = [1.0; MAX_LANES];
            for curve_lane in lane..block.count.min(lane + L::COUNT) {
                let unit = sample(block, curve_lane, nodes, curve_lane - lane, &mut found);
                (units[curve_lane - lane], scales[curve_lane]) = (unit, unit as f32);
            }
            let unit = L::Doubles::load(&units);
            let middle = load(&found[0], 0);
            let mut samples = NodeSamples::all(L::all(0.0));
            for c in 0..4 {
                samples.middle[c] = L::rounded(middle[c] / unit);
                for k in 0..PAIRS {
                    let [before, after] = [1 + k, 1 + PAIRS + k].map(|i| &found[i][c]);
                    let forward = (L::Doubles::load(after) - middle[c]) / unit;
                    let backward = (L::Doubles::load(before) - middle[c]) / unit;
                    samples.even[k][c] = L::rounded(forward + backward);
                    samples.odd[k][c] = L::rounded(forward - backward);
                }
            }
            block.interpolate(lane, nodes, &samples, segments);
        }
        block.scale(&scales, segments);
    }
}

/// Samples the curve in a lane into the `j`th lane of the vectors found, and returns a unit near
/// its largest value. It is a power of two, so that dividing by it rounds nothing.
fn sample<const PAIRS: usize>(
    block: &FitBlock,
    lane: usize,
    nodes: &Nodes<PAIRS>,
    j: usize,
    found: &mut [[[f64; MAX_LANES]; 4]],
) -> f64 {
    let curve = block.curve(lane);
    let (at, width) = (block.middles[lane], block.widths[lane]);
    let mut largest = 0.0f64;
    for (i, found) in found[..=2 * PAIRS].iter_mut().enumerate() {
        let value = curve.value_at(at + nodes.offset(i) * width);
        largest = value
            .iter()
            .fold(largest, |largest, c| largest.max(c.abs()));
        put(found, j, value);
    }
    power_of_two(largest)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::curve::formula::{Product, RotationVector};
    use crate::fit::exact::curve::{CurvePiece, IntervalCurve};
    use crate::fit::exact::fit::Tier;
    use crate::fit::exact::shape::{Shape, fit};
    use crate::math::quaternion::{Quaternion, exp};

    type Fit = fn(&mut FitBlock, &mut [PolynomialSegment]);

    fn fitted(curves: &[IntervalCurve], tier: Tier, fit: Fit) -> Vec<PolynomialSegment> {
        let mut block = FitBlock::new(curves[0].shape, curves[0].quantity, tier);
        block.segment_indices.fill(curves.len());
        for (index, curve) in curves.iter().enumerate() {
            block.push(curve, CurvePiece::WHOLE);
            block.segment_indices[index] = index;
        }
        let mut segments = vec![PolynomialSegment::zeroed(); curves.len() + 1];
        fit(&mut block, &mut segments);
        segments.pop();
        segments
    }

    /// Catches a lane that is computed in another order than alone: velocities have one value, whichever
    /// curves are prepared beside them.
    #[test]
    fn curves_beside_each_other_have_the_bits_of_one_alone() {
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let quantities = [Axes::Body, Axes::Parent]
            .into_iter()
            .flat_map(|axes| [Quantity::Velocity(axes), Quantity::Acceleration(axes)]);
        let shapes: [(&'static Shape, Fit); 3] = [
            (Shape::BERNSTEIN, fit::<MotionOf<Product>>),
            (Shape::PRODUCT, fit::<MotionOf<Product>>),
            (Shape::ROTATION_VECTOR, fit::<MotionOf<RotationVector>>),
        ];
        for quantity in quantities {
            for (shape, in_lanes) in shapes {
                for (tier, reach) in [
                    (Tier::SmallAngle, 0.02),
                    (Tier::Full, 0.2),
                    (Tier::Piece, 4.0),
                ] {
                    let curves: Vec<IntervalCurve> = (0..21)
                        .map(|index| {
                            // Some stand still, and one rotates farther than the first half turn.
                            let reach = reach * f64::from(index % 5);
                            let mut numbers = shape.shared;
                            let key: Quaternion = exp([random(), random(), random()]);
                            numbers[..4].copy_from_slice(&key);
                            for number in &mut numbers[4..shape.per_curve.min(NUMBERS)] {
                                *number = reach * random();
                            }
                            IntervalCurve::new(
                                shape,
                                numbers,
                                quantity,
                                1.0 + 59.0 * random().abs(),
                            )
                        })
                        .collect();
                    let [alone, beside] =
                        [fit::<Motion> as Fit, in_lanes].map(|fit| fitted(&curves, tier, fit));
                    for (index, (alone, beside)) in alone.iter().zip(&beside).enumerate() {
                        let [alone, beside] = [alone, beside].map(bytemuck::bytes_of);
                        assert_eq!(alone, beside, "{quantity:?} {tier:?} curve {index}");
                    }
                }
            }
        }
    }
}
