//! Angular velocities and accelerations of curves. Their formulas are evaluated in dual numbers of
//! second order, and the results are fitted like the rotations themselves.

use crate::curve::options::{Axes, Quantity};
use crate::fit::block::{LANES, load, put};
use crate::fit::exact::fit::FitBlock;
use crate::fit::exact::shape::Sampling;
use crate::fit::nodes::{NodeSamples, Nodes};
use crate::math::canonical::power_of_two;
use crate::math::dual::Dual;
use crate::math::quaternion::{Quaternion, rotated, step};
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::lanes::{Doubles as _, Lanes, MAX_LANES};

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
