//! Samples of one track, and the sums of the steps about each of them.

use glam::DQuat;

use crate::math::canonical::canonical;
use crate::math::quaternion::{exp, product, round_quat, unit};
use crate::simd::components::{BLOCK, Components, at, put, put_together, take_apart};
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;
use crate::smooth::kernel::{Smoothing, SmoothingEnds, SmoothingKernel};
use crate::twin::arc_tangent::{arc_tangent, reciprocal_root, root};
use crate::twin::{pose_smooth, pose_steps};

/// The samples of a track among those of others.
#[derive(Clone, Copy)]
pub(crate) struct SampleRow<'a> {
    /// All values; those of the track are every `stride`th from `first` on.
    pub(crate) values: &'a [[f32; 4]],
    pub(crate) first: usize,
    pub(crate) stride: usize,
    pub(crate) count: usize,
}

impl SampleRow<'_> {
    #[inline(always)]
    pub(crate) fn get(&self, sample: usize) -> [f32; 4] {
        self.values[self.first + sample * self.stride]
    }
}

/// One pass over the samples of a track, of which there are at least two.
#[derive(Clone, Copy)]
pub(crate) struct SmoothingPass<'a> {
    pub(crate) smoothing: &'a Smoothing,
    /// The weights of steps.
    pub(crate) weights: &'a [f32],
    pub(crate) are_rotations: bool,
}

impl SmoothingPass<'_> {
    /// The step of a track's samples for an index before the start, within the samples, or after the end.
    #[inline(always)]
    pub(crate) fn step_at(&self, index: isize, samples: usize) -> usize {
        let count = samples as isize - 1;
        if index >= 0 && index < count {
            return index as usize;
        }
        if self.smoothing.ends == SmoothingEnds::Loop {
            return index.rem_euclid(count) as usize;
        }
        // Repeated mirroring: 0 1 2 2 1 0 0 1 2.
        let mirrored = index.rem_euclid(2 * count);
        mirrored.min(2 * count - 1 - mirrored) as usize
    }

    /// Sets the samples next to the ends of a row, for which the cubic kernel has other weights.
    pub(crate) fn set_ends(&self, row: SampleRow<'_>, mut set: impl FnMut(usize, [f32; 4])) {
        let last = row.count - 1;
        let is_cubic = self.smoothing.kernel == SmoothingKernel::Cubic && last >= 3;
        if !is_cubic || self.smoothing.ends == SmoothingEnds::Loop {
            return;
        }
        let mut move_by = |sample: usize, steps: [usize; 3], weights: [f32; 3]| {
            let mut sum = [0.0; 4];
            for (step, weight) in steps.into_iter().zip(weights) {
                let step = pose_steps::pose(row.get(step), row.get(step + 1), self.are_rotations);
                for c in 0..4 {
                    sum[c] += step[c] * weight;
                }
            }
            let value = row.get(sample);
            let moved = match (self.are_rotations, sum.map(f64::from)) {
                (false, _) => pose_smooth::moved(value, sum, false),
                (true, [0.0, 0.0, 0.0, _]) => value,
                (true, [x, y, z, _]) => rotated_by(value, [x, y, z]),
            };
            set(sample, moved);
        };
        let (first, end) = ([0, 1, 2], [last - 1, last - 2, last - 3]);
        let sixth = 1.0 / 6.0;
        move_by(1, first, [-sixth, 2.0 * sixth, -sixth]);
        move_by(last - 1, end, [sixth, -2.0 * sixth, sixth]);
        if self.smoothing.ends == SmoothingEnds::Parabolic {
            move_by(0, first, [1.0, -2.0, 1.0]);
            move_by(last, end, [-1.0, 2.0, -1.0]);
        } else {
            set(0, row.get(0));
            set(last, row.get(last));
        }
    }

    /// A smoothed rotation whose step is too long for the kernels' polynomials, in f64. `step` returns the
    /// neighbouring steps by index: 0 is the step after the sample, -1 the one before.
    pub(crate) fn smoothed_in_f64(
        &self,
        value: [f32; 4],
        step: impl Fn(isize) -> [f32; 3],
    ) -> [f32; 4] {
        let mut sum = [0.0; 3];
        for (m, weight) in (0..).zip(self.weights) {
            let (after, before) = (step(m), step(-1 - m));
            for c in 0..3 {
                sum[c] += (f64::from(after[c]) - f64::from(before[c])) * f64::from(*weight);
            }
        }
        rotated_by(value, sum)
    }
}

fn rotated_by(value: [f32; 4], half: [f64; 3]) -> [f32; 4] {
    let rotated = DQuat::from_array(product(unit(value), exp(half)));
    round_quat(rotated.normalize().to_array())
}

/// Whether any rotation is 0, without a branch for each.
#[inline(always)]
fn are_any_zero([x, y, z, w]: &Components) -> bool {
    let mut found = 0;
    for i in 0..BLOCK {
        let is_zero = (x[i] == 0.0) & (y[i] == 0.0) & (z[i] == 0.0) & (w[i] == 0.0);
        found |= u32::from(is_zero);
    }
    found != 0
}

impl SampleRow<'_> {
    /// The components of consecutive samples, at most [`BLOCK`] of them.
    #[inline(always)]
    fn load<L: Lanes>(&self, first: usize, count: usize, components: &mut Components) {
        if self.stride == 1 {
            take_apart::<L>(&self.values[self.first + first..][..count], components);
        } else {
            for lane in 0..count {
                put(components, lane, self.get(first + lane));
            }
        }
    }
}

/// [`pose_steps::pose`] of rotations by components: each of its long chains of operations is a separate loop, in
/// which a processor works on several vectors at once.
#[inline(always)]
fn rotation_steps(from: &Components, to: &Components, found: &mut Components) {
    let [mut squares, mut sines, mut ratios] = [[0.0; BLOCK]; 3];
    for (i, square) in squares.iter_mut().enumerate() {
        let rotation = pose_steps::relative_rotation(at(from, i), at(to, i));
        *square = pose_steps::square_of(rotation);
        put(found, i, rotation);
    }
    for ((square, sine), ratio) in squares.iter().zip(&mut sines).zip(&mut ratios) {
        *sine = root(*square);
        *ratio = reciprocal_root(*square);
    }
    for ((sine, cosine), ratio) in sines.iter().zip(&found[3]).zip(&mut ratios) {
        *ratio *= arc_tangent(*sine, *cosine);
    }
    for (i, (square, ratio)) in squares.iter().zip(&ratios).enumerate() {
        let step = pose_steps::scaled(at(found, i), *square, *ratio);
        put(found, i, step.map(canonical));
    }
}

/// Smooths consecutive samples of a row on the CPU.
pub(crate) struct SmoothingBlock<'a> {
    pub(crate) pass: SmoothingPass<'a>,
    pub(crate) row: SampleRow<'a>,
    /// The first of the samples.
    pub(crate) first: usize,
    /// The steps around the samples, from the first that affects the first sample: a list for each component, which
    /// is made once for many blocks.
    pub(crate) steps: &'a mut [Vec<f32>; 4],
    /// As [`SampleRow`]: every `stride`th from `output_start` on is a smoothed sample.
    pub(crate) output: &'a mut [[f32; 4]],
    pub(crate) output_start: usize,
    pub(crate) count: usize,
}

impl SmoothingBlock<'_> {
    #[inline(always)]
    fn find_steps<L: Lanes, const ARE_ROTATIONS: bool>(&mut self) {
        let (row, radius) = (self.row, self.pass.weights.len());
        let count = self.count + 2 * radius - 1;
        let rounded = count.next_multiple_of(BLOCK);
        for steps in self.steps.iter_mut() {
            // Padding: the last sums read as many steps as the others.
            steps.resize(rounded + BLOCK, 0.0);
        }
        let before = self.first as isize - radius as isize;
        let (mut from, mut to): (Components, Components) = ([[0.0; BLOCK]; 4], [[0.0; BLOCK]; 4]);
        for lane in (0..rounded).step_by(BLOCK) {
            let lanes = BLOCK.min(count - lane);
            let start = before + lane as isize;
            if start >= 0 && start + (lanes as isize) < row.count as isize {
                row.load::<L>(start as usize, lanes, &mut from);
                row.load::<L>(start as usize + 1, lanes, &mut to);
            } else {
                for i in 0..lanes {
                    let step = self.pass.step_at(start + i as isize, row.count);
                    put(&mut from, i, row.get(step));
                    put(&mut to, i, row.get(step + 1));
                }
            }
            let mut found: Components = [[0.0; BLOCK]; 4];
            if ARE_ROTATIONS {
                rotation_steps(&from, &to, &mut found);
            } else {
                for i in 0..BLOCK {
                    let step = pose_steps::pose(at(&from, i), at(&to, i), false);
                    put(&mut found, i, step);
                }
            }
            for (steps, found) in self.steps.iter_mut().zip(&found) {
                steps[lane..lane + BLOCK].copy_from_slice(found);
            }
        }
    }

    /// The weighted sums of the steps about samples, of which `lane` is the first.
    #[inline(always)]
    fn sums(&self, lane: usize) -> Components {
        let radius = self.pass.weights.len();
        let mut sums: Components = [[0.0; BLOCK]; 4];
        for (sum, steps) in sums.iter_mut().zip(self.steps.iter()) {
            for (m, weight) in self.pass.weights.iter().enumerate() {
                let after = &steps[lane + radius + m..][..BLOCK];
                let before = &steps[lane + radius - 1 - m..][..BLOCK];
                for i in 0..BLOCK {
                    sum[i] += (after[i] - before[i]) * weight;
                }
            }
        }
        sums
    }

    #[inline(always)]
    fn find_values<L: Lanes, const ARE_ROTATIONS: bool>(&mut self) {
        let (row, radius) = (self.row, self.pass.weights.len());
        let mut values: Components = [[0.0; BLOCK]; 4];
        for lane in (0..self.count).step_by(BLOCK) {
            let lanes = BLOCK.min(self.count - lane);
            row.load::<L>(self.first + lane, lanes, &mut values);
            let sums = self.sums(lane);
            let mut moved: Components = [[0.0; BLOCK]; 4];
            for i in 0..BLOCK {
                let value = pose_smooth::moved(at(&values, i), at(&sums, i), ARE_ROTATIONS);
                put(&mut moved, i, value);
            }
            if ARE_ROTATIONS && are_any_zero(&moved) {
                for i in 0..lanes {
                    if at(&moved, i) != [0.0; 4] {
                        continue;
                    }
                    let center = (lane + i + radius) as isize;
                    let value = row.get(self.first + lane + i);
                    let value = self.pass.smoothed_in_f64(value, |step| {
                        let step = (center + step) as usize;
                        [0, 1, 2].map(|c| self.steps[c][step])
                    });
                    put(&mut moved, i, value);
                }
            }
            if row.stride == 1 {
                let output = &mut self.output[self.output_start + lane..][..lanes];
                put_together::<L>(&moved, output);
            } else {
                for i in 0..lanes {
                    self.output[self.output_start + (lane + i) * row.stride] = at(&moved, i);
                }
            }
        }
    }

    /// Smooths vectors by whole rows of components, which have the same weights and need not be separated.
    #[inline(always)]
    fn smooth_side_by_side(&mut self) {
        const EACH: usize = 4 * BLOCK;
        let (row, radius) = (self.row, self.pass.weights.len());
        let values: &[f32] = bytemuck::cast_slice(&row.values[row.first..][..row.count]);
        let count = self.count + 2 * radius - 1;
        let before = self.first as isize - radius as isize;
        let steps = &mut self.steps[0];
        steps.resize(4 * count + EACH, 0.0);
        // The steps inside the row, before its start, and after its end.
        let start = (-before).clamp(0, count as isize);
        let end = (row.count as isize - 1 - before).clamp(start, count as isize);
        let (start, end) = (start as usize, end as usize);
        for i in (0..start).chain(end..count) {
            let step = self.pass.step_at(before + i as isize, row.count);
            let found = pose_steps::pose(row.get(step), row.get(step + 1), false);
            steps[4 * i..][..4].copy_from_slice(&found);
        }
        if start < end {
            let first = (before + start as isize) as usize;
            let (from, to) = (&values[4 * first..], &values[4 * first + 4..]);
            let inner = steps[4 * start..4 * end].iter_mut();
            for ((step, from), to) in inner.zip(from).zip(to) {
                *step = canonical(to - from);
            }
        }
        let values = values[4 * self.first..].chunks(EACH);
        let output = bytemuck::cast_slice_mut(&mut self.output[self.output_start..][..self.count]);
        for (i, (output, values)) in output.chunks_mut(EACH).zip(values).enumerate() {
            let mut sums = [0.0; EACH];
            for (m, weight) in self.pass.weights.iter().enumerate() {
                let after = &steps[EACH * i + 4 * (radius + m)..][..EACH];
                let before = &steps[EACH * i + 4 * (radius - 1 - m)..][..EACH];
                for j in 0..EACH {
                    sums[j] += (after[j] - before[j]) * weight;
                }
            }
            for ((output, value), sum) in output.iter_mut().zip(values).zip(&sums) {
                *output = canonical(value + sum);
            }
        }
    }
}

impl InLanes for SmoothingBlock<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        if self.pass.are_rotations {
            self.find_steps::<L, true>();
            self.find_values::<L, true>();
        } else if self.row.stride == 1 {
            self.smooth_side_by_side();
        } else {
            self.find_steps::<L, false>();
            self.find_values::<L, false>();
        }
    }
}
