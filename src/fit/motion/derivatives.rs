//! Angular velocities and accelerations of curves. Their formulas are evaluated in dual numbers of
//! second order, and the results are fitted like the rotations themselves.

use crate::curve::options::{Axes, Quantity};
use crate::fit::double::fit::{FitBlock, Lane32, Samples};
use crate::fit::double::intervals::LANES;
use crate::fit::double::shape::Sampling;
use crate::fit::nodes::Nodes;
use crate::math::dual::Dual;
use crate::math::quaternion::{Quaternion, rotated, step};
use crate::shader::PolynomialSegment;
use crate::simd::lanes::Lanes;

/// The quantity asked for, from a rotation and its derivatives by the parameter; `rate` is the
/// parameter's change per second. The result is a quaternion, or a vector with 0 in the place of w.
pub(crate) fn value(quantity: Quantity, rotation: [Dual; 4], rate: f64) -> Quaternion {
    let at = rotation.map(|dual| dual.value);
    let (derivative, scale, axes) = match quantity {
        Quantity::Rotation => return at,
        Quantity::Velocity(axes) => (rotation.map(|dual| dual.first), rate, axes),
        Quantity::Acceleration(axes) => (rotation.map(|dual| dual.second), rate * rate, axes),
    };
    // ω = 2 q⁻¹ q', and its derivative is the vector part of 2 q⁻¹ q''.
    let [x, y, z, _] = step(at, derivative);
    // Between keys at almost the same time velocities would overflow f32.
    let largest = 0.25 * f64::from(f32::MAX);
    let body = [x, y, z].map(|c| (2.0 * scale * c).clamp(-largest, largest));
    let [x, y, z] = match axes {
        Axes::Body => body,
        // This holds for accelerations too: ω × ω = 0.
        Axes::Parent => rotated(at, body),
    };
    [x, y, z, 0.0]
}

/// Samples velocities or accelerations, curve by curve.
pub(crate) struct Motion;

impl Sampling for Motion {
    #[inline(always)]
    fn fit<L: Lanes, const PAIRS: usize>(
        block: &mut FitBlock,
        nodes: &Nodes<PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let count = block.whole();
        let mut samples = Samples::all([0.0; LANES]);
        let mut scales = [1.0; LANES];
        for (lane, scale) in scales[..count].iter_mut().enumerate() {
            *scale = sample(block, lane, nodes, &mut samples);
        }
        for lane in (0..count).step_by(L::COUNT) {
            block.interpolate(lane, nodes, &samples.at::<L>(lane), segments);
        }
        block.scale(&scales, segments);
    }
}

/// Samples the curve in a lane in a unit near its largest value, and returns that unit. It is a
/// power of two, so that multiplying by it rounds nothing.
fn sample<const PAIRS: usize>(
    block: &FitBlock,
    lane: usize,
    nodes: &Nodes<PAIRS>,
    Samples { middle, even, odd }: &mut Samples<Lane32, PAIRS>,
) -> f32 {
    let curve = block.curve(lane);
    let (at, width) = (block.middles[lane], block.widths[lane]);
    let between = curve.value_at(at);
    let pairs = nodes.at.map(|node| {
        let reach = f64::from(node) * width;
        [curve.value_at(at - reach), curve.value_at(at + reach)]
    });
    let largest = (pairs.as_flattened().as_flattened().iter())
        .chain(&between)
        .fold(0.0f64, |largest, component| largest.max(component.abs()));
    let unit = if largest > 1e-30 {
        f64::from_bits(largest.to_bits() & (0x7ff << 52))
    } else {
        1.0
    };
    for c in 0..4 {
        middle[c][lane] = (between[c] / unit) as f32;
        for (k, [before, after]) in pairs.iter().enumerate() {
            let rise = (after[c] - between[c]) / unit;
            let cosine_minus_one = (before[c] - between[c]) / unit;
            even[k][c][lane] = (rise + cosine_minus_one) as f32;
            odd[k][c][lane] = (rise - cosine_minus_one) as f32;
        }
    }
    unit as f32
}
