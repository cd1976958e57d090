//! Angular velocities and accelerations of curves. Their formulas are evaluated in dual numbers of
//! second order, and the results are fitted like the rotations themselves.

use std::marker::PhantomData;

use crate::curve::formula::{Formula, NUMBERS, quantity_value};
use crate::fit::block::{LANES, load, put};
use crate::fit::exact::fit::FitBlock;
use crate::fit::exact::sampling::Sampling;
use crate::math::canonical::power_of_two;
use crate::math::dual::Dual;
use crate::math::quaternion::{FullRange as _, Real as _};
use crate::shader::POWERS;
use crate::simd::doubles::Doubles as _;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// Samples velocities or accelerations of a formula, curves beside each other.
pub(crate) struct MotionOf<F>(PhantomData<F>);

impl<F: Formula> Sampling for MotionOf<F> {
    const IS_SCALED: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(block: &mut FitBlock) {
        let zero = L::Doubles::all(0.0);
        let offsets = block.tier.offsets();
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
            for (found, &offset) in found.iter_mut().zip(offsets) {
                let t = at + L::Doubles::all(offset) * width;
                let rotation = F::rotation(&numbers, Dual::parameter(t));
                *found = quantity_value(block.quantity, rotation, rate);
                for &c in &*found {
                    largest = c.larger(-c).larger(largest);
                }
            }
            let (unit, _) = largest.each(|largest| (power_of_two(largest), 0.0));
            let mut units = [1.0; MAX_LANES];
            unit.store(&mut units);
            let lanes = lane..(lane + L::COUNT).min(LANES);
            for (scale, unit) in block.scales[lanes].iter_mut().zip(units) {
                *scale = unit as f32;
            }
            set_in_units::<L>(block, lane, &found, unit);
        }
    }
}

/// Samples velocities or accelerations, one curve at a time: for curves at constant speed, and for long formulas.
pub(crate) struct Motion;

impl Sampling for Motion {
    const IS_SCALED: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(block: &mut FitBlock) {
        let count = block.tier.offsets().len();
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let mut sampled = [[[0.0; MAX_LANES]; 4]; POWERS];
            let mut units = [1.0; MAX_LANES];
            for curve_lane in lane..block.count.min(lane + L::COUNT) {
                let unit = sample(block, curve_lane, curve_lane - lane, &mut sampled);
                (units[curve_lane - lane], block.scales[curve_lane]) = (unit, unit as f32);
            }
            let mut found = [[L::Doubles::all(0.0); 4]; POWERS];
            for (found, sampled) in found[..count].iter_mut().zip(&sampled) {
                *found = load(sampled, 0);
            }
            set_in_units::<L>(block, lane, &found, L::Doubles::load(&units));
        }
    }
}

/// Sets the samples of the curves from `lane` on, divided by their units, from the values found at all nodes.
#[inline(always)]
fn set_in_units<L: Lanes>(
    block: &mut FitBlock,
    lane: usize,
    found: &[[L::Doubles; 4]; POWERS],
    unit: L::Doubles,
) {
    let pairs = block.tier.offsets().len() / 2;
    let middle = found[0];
    let (mut even, mut odd) = ([L::all(0.0); 4], [L::all(0.0); 4]);
    for c in 0..4 {
        even[c] = L::rounded(middle[c] / unit);
    }
    block.set_middle(lane, even);
    for k in 0..pairs {
        let (before, after) = (found[1 + k], found[1 + pairs + k]);
        for c in 0..4 {
            let forward = (after[c] - middle[c]) / unit;
            let backward = (before[c] - middle[c]) / unit;
            even[c] = L::rounded(forward + backward);
            odd[c] = L::rounded(forward - backward);
        }
        block.set_pair(lane, k, even, odd);
    }
}

/// Samples the curve in a lane into the `j`th lane of the vectors found, and returns a unit near
/// its largest value. It is a power of two, so that dividing by it rounds nothing.
fn sample(
    block: &FitBlock,
    lane: usize,
    j: usize,
    found: &mut [[[f64; MAX_LANES]; 4]; POWERS],
) -> f64 {
    let curve = block.curve(lane);
    let (at, width) = (block.middles[lane], block.widths[lane]);
    let mut largest = 0.0f64;
    for (found, &offset) in found.iter_mut().zip(block.tier.offsets()) {
        let value = curve.value_at(at + offset * width);
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
    use crate::curve::options::{Axes, Quantity};
    use crate::fit::exact::fit::{CurvePiece, IntervalCurve, Shape, Tier};
    use crate::fit::exact::sampling::fit;
    use crate::fit::exact::shape::{BERNSTEIN, PRODUCT, ROTATION_VECTOR};
    use crate::math::quaternion::{Quaternion, exp};
    use crate::shader::PolynomialSegment;

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
            (&BERNSTEIN, fit::<MotionOf<Product>>),
            (&PRODUCT, fit::<MotionOf<Product>>),
            (&ROTATION_VECTOR, fit::<MotionOf<RotationVector>>),
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
                            // Some curves do not move, and one rotates by more than half a turn.
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
