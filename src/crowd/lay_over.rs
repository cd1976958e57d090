//! Blending of the rotations of layers, for many joints at once.

use crate::math::quaternion::{dot, product, step};
use crate::shader::{CHANNELS, ROTATION};
use crate::simd::lanes::{Lanes, MAX_LANES, Number as _, canonical};
use crate::simd::together::Together;
use crate::twin::arc_tangent::{flat_arc_tangent, reciprocal_root, root_by};
use crate::twin::crowd_layers::{Layers, laid_over};
use crate::twin::quaternion::{along, chord, normalised};
use crate::twin::sine_cosine::sine_cosine;

const UNMOVED: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A layer that is blended over the layers below it.
struct Over<'a> {
    weight: f32,
    /// Cells whose first number is a joint's factor of the weight; without a mask the factor is 1.
    mask: Option<&'a [[f32; 4]]>,
    /// The reference pose of an additive layer: the channels of each joint.
    references: Option<&'a [[f32; 4]]>,
    layered: &'a [[f32; 4]],
}

/// Blends the rotations of a layer over the layers below it: [`laid_over`] of every joint.
#[inline(always)]
pub(crate) fn lay_over<L: Lanes>(
    context: &Layers<'_>,
    layer: usize,
    layered: &[[f32; 4]],
    output: &mut [[f32; 4]],
) {
    let entry = &context.entries[layer];
    let (weight, mask) = context.weight_and_mask(entry);
    let is_additive = entry.speed_and_modes >> 31 != 0;
    let over = Over {
        weight,
        mask: entry.has_mask().then_some(mask),
        references: is_additive.then(|| context.references_of(entry)),
        layered,
    };
    over.all::<L>(output);
}

impl Over<'_> {
    #[inline(always)]
    fn all<L: Lanes>(&self, output: &mut [[f32; 4]]) {
        let mut first = 0;
        while first < output.len() {
            let vectors = (output.len() - first).div_ceil(L::COUNT);
            // Only a few variants, because each is compiled for each width. The widest vectors have enough lanes for
            // most skeletons.
            if L::COUNT == MAX_LANES && vectors <= 2 {
                self.some::<L, 2>(first, output);
                first += 2 * L::COUNT;
            } else if L::COUNT == MAX_LANES || vectors <= 4 {
                self.some::<L, 4>(first, output);
                first += 4 * L::COUNT;
            } else {
                self.some::<L, 8>(first, output);
                first += 8 * L::COUNT;
            }
        }
    }

    /// Processes some vectors of joints, from `first` on.
    #[inline(always)]
    fn some<L: Lanes, const VECTORS: usize>(&self, first: usize, output: &mut [[f32; 4]]) {
        let below = load::<L, VECTORS>(output, first);
        let above = load::<L, VECTORS>(self.layered, first);
        let mut weight = Together::all(self.weight);
        if let Some(mask) = self.mask {
            weight = weight * load::<L, VECTORS>(mask, first)[0];
        }
        let (mut from, mut to) = (below, above);
        if let Some(references) = self.references {
            from = load(&[], 0);
            to = step(reference(references, first), above);
        }
        let Some(mut value) = slerp(from, to, weight) else {
            self.one_by_one(first..first + VECTORS * L::COUNT, output);
            return;
        };
        if self.references.is_some() {
            value = normalised(product(below, value));
        } else if self.mask.is_some() {
            for c in 0..4 {
                let inner = weight.where_equal(1.0, above[c], value[c]);
                value[c] = weight.where_equal(0.0, below[c], inner);
            }
        }
        store(canonical(value), output, first);
    }

    /// The same joint by joint, for rotations that are about 90° apart in R⁴, which is rare.
    #[cold]
    #[inline(never)]
    fn one_by_one(&self, joints: std::ops::Range<usize>, output: &mut [[f32; 4]]) {
        for (joint, value) in output
            .iter_mut()
            .enumerate()
            .take(joints.end)
            .skip(joints.start)
        {
            let weight = self
                .mask
                .map_or(self.weight, |mask| self.weight * mask[joint][0]);
            let channel = joint * CHANNELS as usize + ROTATION as usize;
            let reference = self
                .references
                .map_or(UNMOVED, |references| references[channel]);
            let is_additive = self.references.is_some();
            let layer = self.layered[joint];
            *value = laid_over(ROTATION, is_additive, *value, layer, reference, weight);
        }
    }
}

/// [`slerp`](crate::twin::functions::slerp) without the special case of rotations that are about 90° apart in R⁴;
/// then `None`.
#[inline(always)]
fn slerp<L: Lanes, const VECTORS: usize>(
    from: [Together<L, VECTORS>; 4],
    to: [Together<L, VECTORS>; 4],
    t: Together<L, VECTORS>,
) -> Option<[Together<L, VECTORS>; 4]> {
    let (sum, difference) = chord(from, to);
    let square = dot(difference, difference);
    let whole = dot(sum, sum);
    // The reciprocal root of 0 is large but finite. The difference is 0 then, and so is its product with this number.
    let (inverse, to_unit) = (reciprocal_root(square), reciprocal_root(whole));
    let (small, large) = (root_by(square, inverse), root_by(whole, to_unit));
    if (small - large).any_at_least(0.0) {
        return None;
    }
    let half = flat_arc_tangent(small, large);
    let sine_and_cosine = sine_cosine((t + t - Together::all(1.0)) * half);
    Some(along(sum, difference, (to_unit, inverse), sine_and_cosine))
}

/// Vectors of the rotations from the joint `first` on; lanes after the last joint have identity rotations.
#[inline(always)]
fn load<L: Lanes, const VECTORS: usize>(
    rotations: &[[f32; 4]],
    first: usize,
) -> [Together<L, VECTORS>; 4] {
    let mut loaded = [Together::all(0.0); 4];
    for v in 0..VECTORS {
        let rotations = rotations.get(first + v * L::COUNT..).unwrap_or_default();
        let vectors = if rotations.len() >= L::COUNT {
            L::load_rotations(rotations)
        } else {
            let mut end = [UNMOVED; MAX_LANES];
            end[..rotations.len()].copy_from_slice(rotations);
            L::load_rotations(&end)
        };
        for c in 0..4 {
            loaded[c].0[v] = vectors[c];
        }
    }
    loaded
}

/// The reference rotations from the joint `first` on, from the channels of joints.
#[inline(always)]
fn reference<L: Lanes, const VECTORS: usize>(
    channels: &[[f32; 4]],
    first: usize,
) -> [Together<L, VECTORS>; 4] {
    let each = CHANNELS as usize;
    let last = channels.len() / each - 1;
    let mut loaded = [Together::all(0.0); 4];
    for v in 0..VECTORS {
        let mut rows = [0; MAX_LANES];
        for (lane, row) in rows.iter_mut().enumerate().take(L::COUNT) {
            let joint = (first + v * L::COUNT + lane).min(last);
            *row = (joint * each) as u32 + ROTATION;
        }
        let vectors = L::gather_rotations(channels, &rows[..L::COUNT]);
        for c in 0..4 {
            loaded[c].0[v] = vectors[c];
        }
    }
    loaded
}

/// Stores the rotations from the joint `first` on, up to the end of the array.
#[inline(always)]
fn store<L: Lanes, const VECTORS: usize>(
    components: [Together<L, VECTORS>; 4],
    rotations: &mut [[f32; 4]],
    first: usize,
) {
    let [x, y, z, w] = components;
    for v in 0..VECTORS {
        let vectors = [x.0[v], y.0[v], z.0[v], w.0[v]];
        let rotations = rotations
            .get_mut(first + v * L::COUNT..)
            .unwrap_or_default();
        if rotations.len() >= L::COUNT {
            L::store_rotations(vectors, &mut rotations[..L::COUNT]);
        } else {
            let found = L::rotations(vectors);
            rotations.copy_from_slice(&found.as_ref()[..rotations.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::dispatch::{InLanes, VectorWidth, in_lanes_of};

    /// Rotations of so many joints, and a weight in the mask of each.
    struct LayOverCase {
        joints: usize,
        random: fastrand::Rng,
        /// The number of pairs of rotations half a turn apart so far.
        opposite: usize,
    }

    impl LayOverCase {
        fn rotation(&mut self) -> [f32; 4] {
            let random = std::array::from_fn(|_| self.random.f32() - 0.5);
            let whole = std::array::from_fn(|_| f32::from(self.random.i8(-1..=1)));
            let q: [f32; 4] = if self.random.bool() { random } else { whole };
            if dot(q, q) < 1e-3 {
                return UNMOVED;
            }
            normalised(q).map(crate::math::canonical::canonical)
        }
    }

    impl InLanes for LayOverCase {
        const WIDE_IN_TESTS: bool = true;

        fn run<L: Lanes>(&mut self) {
            let mut all =
                || -> Vec<[f32; 4]> { (0..self.joints).map(|_| self.rotation()).collect() };
            let (below, mut above) = (all(), all());
            let references: Vec<[f32; 4]> = (0..3).flat_map(|_| all()).collect();
            for (above, below) in above.iter_mut().zip(&below) {
                match self.random.u32(..8) {
                    0 => *above = *below,
                    1 => *above = below.map(|c| crate::math::canonical::canonical(-c)),
                    2 => *above = [below[1], -below[0], below[3], -below[2]],
                    _ => {}
                }
            }
            let parts = [0.0, 1.0, 0.3, 0.75];
            let mask: Vec<[f32; 4]> = (0..self.joints)
                .map(|_| [parts[self.random.usize(..4)], 0.0, 0.0, 0.0])
                .collect();
            for (weight, has_mask, is_additive) in [
                (0.3, false, false),
                (1.0, true, false),
                (0.3, true, true),
                (1.0, false, true),
            ] {
                let over = Over {
                    weight,
                    mask: has_mask.then_some(&mask[..]),
                    references: is_additive.then_some(&references[..]),
                    layered: &above,
                };
                let mut found = below.clone();
                over.all::<L>(&mut found);
                for joint in 0..self.joints {
                    let (a, b) = (below[joint], above[joint]);
                    let weight = if has_mask {
                        weight * mask[joint][0]
                    } else {
                        weight
                    };
                    let reference = references[joint * CHANNELS as usize + ROTATION as usize];
                    let expected = laid_over(ROTATION, is_additive, a, b, reference, weight);
                    let bits = |q: [f32; 4]| q.map(f32::to_bits);
                    assert_eq!(bits(found[joint]), bits(expected), "{a:?} {b:?} {weight}");
                    self.opposite += usize::from(!is_additive && dot(a, b) == 0.0);
                }
            }
        }
    }

    /// Catches an operation in another order than the twin's, a lane of another joint, and rotations for which
    /// the short form in vectors is not valid.
    #[test]
    fn rotations_are_laid_over_each_other_as_the_twin_does() {
        for width in VectorWidth::available() {
            let random = fastrand::Rng::with_seed(7);
            let mut case = LayOverCase {
                joints: 0,
                random,
                opposite: 0,
            };
            for joints in (1..140).chain([1000]) {
                case.joints = joints;
                in_lanes_of(width, &mut case);
            }
            assert!(case.opposite > 100, "{}", case.opposite);
        }
    }
}
