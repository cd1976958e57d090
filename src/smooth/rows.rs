//! Rows of samples, a row a track, with the steps beyond their ends.

use glam::DQuat;

use crate::math::canonical::round_quat;
use crate::math::quaternion::{exp, product, unit};
use crate::smooth::kernel::{Smoothing, SmoothingEnds, SmoothingKernel};
use crate::twin::pose_smooth::moved;

/// Writes the steps of a row with those beyond its ends: `radius` before them and `radius` after.
/// `steps` are the steps within the row, one fewer than its samples.
pub(crate) fn padded(steps: &[[f32; 4]], radius: usize, is_loop: bool, output: &mut [[f32; 4]]) {
    let count = steps.len() as isize;
    for (i, own) in output.iter_mut().enumerate() {
        let place = i as isize - radius as isize;
        *own = match count {
            0 => [0.0; 4],
            _ if is_loop => steps[place.rem_euclid(count) as usize],
            _ => {
                // Mirrored again and again: 0 1 2 2 1 0 0 1 2.
                let there = place.rem_euclid(2 * count);
                steps[there.min(2 * count - 1 - there) as usize]
            }
        };
    }
}

/// Sets the samples next to the ends of a row, where the cubic kernel has other weights.
pub(crate) fn set_ends(
    smoothing: &Smoothing,
    values: &[[f32; 4]],
    steps: &[[f32; 4]],
    are_rotations: bool,
    output: &mut [[f32; 4]],
) {
    let last = values.len().saturating_sub(1);
    let is_cubic = smoothing.kernel == SmoothingKernel::Cubic && last >= 3;
    if !is_cubic || smoothing.ends == SmoothingEnds::Loop {
        return;
    }
    let mut set = |place: usize, own: [usize; 3], weights: [f32; 3]| {
        let mut sum = [0.0; 4];
        for (step, weight) in own.into_iter().zip(weights) {
            for c in 0..4 {
                sum[c] += steps[step][c] * weight;
            }
        }
        output[place] = match are_rotations {
            true => turned(values[place], sum),
            false => moved(values[place], sum, false),
        };
    };
    let (first, end) = ([0, 1, 2], [last - 1, last - 2, last - 3]);
    let sixth = 1.0 / 6.0;
    set(1, first, [-sixth, 2.0 * sixth, -sixth]);
    set(last - 1, end, [sixth, -2.0 * sixth, sixth]);
    if smoothing.ends == SmoothingEnds::Parabolic {
        set(0, first, [1.0, -2.0, 1.0]);
        set(last, end, [-1.0, 2.0, -1.0]);
    } else {
        (output[0], output[last]) = (values[0], values[last]);
    }
}

/// What a kernel left 0 because it turns too far for its polynomials, in f64.
pub(crate) fn turned_far(
    values: &[[f32; 4]],
    steps: &[[f32; 4]],
    weights: &[f32],
    output: &mut [[f32; 4]],
) {
    let radius = weights.len();
    for (place, own) in output
        .iter_mut()
        .enumerate()
        .filter(|(_, own)| **own == [0.0; 4])
    {
        let mut sum = [0.0; 4];
        for (m, weight) in weights.iter().enumerate() {
            let (after, before) = (steps[place + radius + m], steps[place + radius - 1 - m]);
            for c in 0..3 {
                sum[c] += (f64::from(after[c]) - f64::from(before[c])) * f64::from(*weight);
            }
        }
        *own = turned_by(values[place], [sum[0], sum[1], sum[2]]);
    }
}

fn turned(value: [f32; 4], sum: [f32; 4]) -> [f32; 4] {
    let [x, y, z, _] = sum.map(f64::from);
    match [x, y, z] {
        [0.0, 0.0, 0.0] => value,
        half => turned_by(value, half),
    }
}

fn turned_by(value: [f32; 4], half: [f64; 3]) -> [f32; 4] {
    let own = DQuat::from_array(product(unit(value), exp(half)));
    round_quat(own.normalize().to_array())
}
