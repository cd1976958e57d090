//! The trial of the self-test's kernel, and the inputs of its expressions.

use bytemuck::Zeroable as _;

use crate::gpu::kernel_check::{Trial, bytes};
use crate::shader::{Dispatch, Probe, WORKGROUP};

/// The expressions as a trial of their kernel.
pub(crate) fn trial() -> Trial {
    let (probes, dispatch) = (probes(), Dispatch::zeroed());
    let groups = [(probes.len() as u32).div_ceil(WORKGROUP), 1, 1];
    Trial::new([bytes(&probes)], &dispatch, groups)
}

/// Values of ordinary size in random order, and sums that are half-way between floats.
fn probes() -> Vec<Probe> {
    let mut state = 1u32;
    let mut next = || {
        // Numerical Recipes' linear congruential generator. Its quality is sufficient here.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0 // exact, in [-1, 1)
    };
    let mut probes: Vec<Probe> = (0..1000)
        .map(|i| Probe {
            a: next() * 4.0,
            b: next(),
            c: next() * std::f32::consts::FRAC_PI_2,
            n: (next() * (1 << (8 + i % 23)) as f32) as i32,
        })
        .collect();
    let half_ulp = f32::EPSILON / 2.0;
    let (even, odd) = ((1.0, half_ulp), (1.0 + f32::EPSILON, half_ulp));
    let (b, n) = (half_ulp, (1 << 24) + 1);
    probes.extend([even, odd, (-1.0, -half_ulp)].map(|(a, c)| Probe { a, b, c, n }));
    probes
}
