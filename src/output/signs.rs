//! Signs of results. `q` and `-q` are the same rotation, but programs that interpolate linearly between samples
//! rotate by more than 180° if neighbouring samples differ in sign. Therefore written rotations have the sign that is
//! nearer to the track's previous sample.

use glam::{Quat, Vec4};

use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// The cosine of half the angle between two rotations; negative if their signs differ.
#[inline]
fn cosine(a: Quat, b: Quat) -> f32 {
    (a.x * b.x + a.y * b.y) + (a.z * b.z + a.w * b.w)
}

/// Whether two neighbouring rotations differ in sign: `-after` is nearer to `before` than `after` is. Near angles of
/// 180° the result depends on rounding, which is the same on every processor.
#[must_use]
#[inline]
pub fn signs_differ(before: Quat, after: Quat) -> bool {
    cosine(before, after) < 0.0
}

/// Changes the signs of rotations, in the order `[sample][track]`, to those that are nearer to the previous sample.
pub fn continue_signs(rotations: &mut [Quat], tracks: usize) {
    for next in tracks..rotations.len() {
        if signs_differ(rotations[next - tracks], rotations[next]) {
            rotations[next] = -rotations[next];
        }
    }
}

/// Whether [`continue_signs`] would change any rotation.
#[must_use]
pub fn signs_jump(rotations: &[Quat], tracks: usize) -> bool {
    let after = rotations.get(tracks..).unwrap_or_default();
    if tracks != 1 {
        // The loop has no branch for each rotation, because lists are long and signs seldom change.
        let mut blocks = rotations.chunks(BLOCK).zip(after.chunks(BLOCK));
        return blocks.any(|(before, after)| jump(before, after));
    }
    let mut rest = rotations;
    loop {
        let mut near = NearBlocks {
            rotations: rest,
            count: 0,
        };
        in_lanes(&mut near);
        rest = &rest[near.count * BLOCK..];
        let after = rest.get(1..).unwrap_or_default();
        if after.is_empty() {
            return false;
        }
        let count = after.len().min(BLOCK);
        if jump(&rest[..count], &after[..count]) {
            return true;
        }
        rest = &rest[count..];
    }
}

/// Whether any pair of rotations at the same index differs in sign.
#[inline]
fn jump(before: &[Quat], after: &[Quat]) -> bool {
    let least = before.iter().zip(after).fold(0.0f32, |least, (a, b)| {
        let cosine = cosine(*a, *b);
        if cosine < least { cosine } else { least }
    });
    least < 0.0
}

/// The number of rotations that are compared before a branch on the result.
const BLOCK: usize = 48;

/// Counts the blocks of one track, up to the first with large differences, whose sum shows that no neighbouring
/// rotations differ in sign. The sum takes one instruction for each vector; cosines take seven for each rotation.
struct NearBlocks<'a> {
    rotations: &'a [Quat],
    count: usize,
}

impl NearBlocks<'_> {
    /// If two of `BLOCK + 1` unit vectors are more than 90° apart, these two add up to less than √2, and the sum of
    /// all is shorter than `BLOCK - 1 + √2`. The constant is larger by more than the errors of norms and sums.
    const LONGEST: f32 = (BLOCK - 1) as f32 + 1.43;
}

impl InLanes for NearBlocks<'_> {
    const WIDE_IN_TESTS: bool = true;

    #[inline(always)]
    #[allow(clippy::disallowed_methods)] // the length of a sum, with room for its rounding
    fn run<L: Lanes>(&mut self) {
        // A block is read with the first rotation of the next block, because signs are compared with the next
        // rotation.
        while let Some(block) = self
            .rotations
            .get(self.count * BLOCK..)
            .and_then(|rest| rest.first_chunk::<{ BLOCK + 1 }>())
        {
            let components: &[f32] = bytemuck::cast_slice(&block[..BLOCK]);
            // The sums of four rotations side by side.
            let mut sums = [0.0; 16];
            for next in components.as_chunks::<16>().0 {
                for (sum, component) in sums.iter_mut().zip(next) {
                    *sum += component;
                }
            }
            let part = |from: usize| Vec4::from_slice(&sums[from..from + 4]);
            let sum = (part(0) + part(4)) + (part(8) + part(12)) + Vec4::from(block[BLOCK]);
            let is_near = sum.length_squared() > Self::LONGEST * Self::LONGEST;
            if !is_near {
                return;
            }
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests lists with as many rotations as a block, one fewer and one more; with slow and with fast rotations.
    #[test]
    fn a_jump_is_found_wherever_it_is() {
        for step in [0.0, 0.01, 0.3, 1.5] {
            let rotation = |at: usize| Quat::from_rotation_z(step * at as f32);
            for count in [
                2,
                3,
                17,
                BLOCK - 1,
                BLOCK,
                BLOCK + 1,
                BLOCK + 2,
                3 * BLOCK + 5,
            ] {
                let smooth: Vec<Quat> = (0..count).map(rotation).collect();
                assert!(!signs_jump(&smooth, 1), "{step} {count}");
                for from in [1, count / 2, count - 2, count - 1, BLOCK, BLOCK + 1] {
                    let from = from.clamp(1, count - 1);
                    let mut jumps = smooth.clone();
                    for behind in &mut jumps[from..] {
                        *behind = -*behind;
                    }
                    assert!(signs_jump(&jumps, 1), "{step} {count} {from}");
                    continue_signs(&mut jumps, 1);
                    assert_eq!(jumps, smooth);
                }
            }
        }
        assert!(!signs_jump(&[], 1));
        assert!(!signs_jump(&[Quat::IDENTITY], 1));
    }
}
