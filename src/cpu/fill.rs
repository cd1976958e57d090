//! Filling memory by streaming stores: the rate that evaluation is compared with.

use glam::Quat;

use crate::simd::dispatch::{InLanesInto, VectorWidth, fence, in_lanes_into};
use crate::simd::lanes::Lanes;
use crate::simd::line::Line;

/// Stores one rotation everywhere.
struct Fill([f32; 4]);

impl InLanesInto<(), [Line]> for Fill {
    const WIDE_IN_TESTS: bool = true;
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, (): &(), lines: &mut [Line]) {
        let value = L::repeated(self.0);
        for block in bytemuck::cast_slice_mut::<Line, L::Block>(lines) {
            value.store_past_caches(block);
        }
        fence();
    }
}

impl VectorWidth {
    /// Fills `output` with one rotation by streaming stores, on some processors the fastest way to
    /// write more than the caches hold: a limit with which the speed of evaluation is compared.
    pub fn fill_past_caches(self, output: &mut [Quat], value: Quat) {
        let rotations: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let (before, lines, after) = bytemuck::pod_align_to_mut(rotations);
        let value = value.to_array();
        before.fill(value);
        in_lanes_into(self, &Fill(value), &(), lines);
        after.fill(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_filled_from_any_start() {
        let value = Quat::from_array([1.0, 2.0, 3.0, 4.0]);
        for width in VectorWidth::available() {
            for (start, count) in (0..5).flat_map(|start| [0, 1, 7, 100].map(|n| (start, n))) {
                let mut memory = vec![Quat::IDENTITY; 110];
                width.fill_past_caches(&mut memory[start..start + count], value);
                for (i, found) in memory.iter().enumerate() {
                    let is_inside = (start..start + count).contains(&i);
                    assert_eq!(*found, if is_inside { value } else { Quat::IDENTITY });
                }
            }
        }
    }
}
