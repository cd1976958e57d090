//! The self-test: before a device is trusted it computes some expressions, and every bit is compared with the
//! CPU's. The check of each kernel, when it is first made, is in [`kernel_check`](crate::gpu::kernel_check).

use std::sync::Arc;

use bytemuck::Zeroable as _;

use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::kernel_check::{Trial, bytes};
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::{Exactness, Pipeline};
pub(crate) use crate::gpu::reports::{NegativeControl, SelfTestReport};
use crate::shader::{Dispatch, Kernel, Probe, Reply, WORKGROUP};
use crate::twin::self_test::reply;

/// Runs every expression on a device.
pub(crate) fn run(engine: &VulkanEngine) -> Result<Vec<SelfTestReport>, VulkanError> {
    expressions(&engine.device, Exactness::Demanded)
}

/// Runs them where the driver is left free to compute otherwise.
pub(crate) fn negative_control(engine: &VulkanEngine) -> Result<NegativeControl, VulkanError> {
    let info = &engine.device.physical.info;
    Ok(NegativeControl {
        expressions: expressions(&engine.device, Exactness::LeftToTheDriver)?,
        must_differ: info.kind == DeviceKind::Cpu && info.name.starts_with("llvmpipe"),
    })
}

type Value = fn(&Reply) -> f32;

/// The single expressions of `shaders/self_test.wgsl`.
fn expressions(
    device: &Arc<LogicalDevice>,
    exactness: Exactness,
) -> Result<Vec<SelfTestReport>, VulkanError> {
    let probes = probes();
    let mut replies = vec![Reply::zeroed(); probes.len()];
    let pipeline = Pipeline::new(device, Kernel::SelfTest, exactness)?;
    let dispatch = Dispatch {
        item_count: probes.len() as u32,
        stride: 1,
        ..Dispatch::zeroed()
    };
    pipeline.run_once(
        &[bytemuck::cast_slice(&probes)],
        bytemuck::bytes_of(&dispatch),
        [(probes.len() as u32).div_ceil(WORKGROUP), 1, 1],
        bytemuck::cast_slice_mut(&mut replies),
    )?;
    let self_tests: [(&str, Value); 10] = [
        ("contraction", |reply| reply.contraction),
        ("re-association of a sum", |reply| reply.reassociation),
        ("rounding to nearest even", |reply| reply.rounding),
        ("re-association of a product", |reply| reply.association),
        ("conversion of integers", |reply| reply.conversion),
        ("cancellation", |reply| reply.cancellation),
        ("sine", |reply| reply.sine),
        ("cosine", |reply| reply.cosine),
        ("root", |reply| reply.root),
        ("arc tangent", |reply| reply.arc_tangent),
    ];
    let expected: Vec<Reply> = probes.iter().map(|&probe| reply(probe)).collect();
    let reports = self_tests.map(|(name, value)| {
        let pairs = expected.iter().zip(&replies);
        let differing = pairs.filter(|(a, b)| value(a).to_bits() != value(b).to_bits());
        SelfTestReport {
            name,
            total: probes.len(),
            differing: differing.count(),
        }
    });
    Ok(reports.into())
}

/// The expressions as a trial of their kernel.
pub(super) fn trial() -> Trial {
    let (probes, dispatch) = (probes(), Dispatch::zeroed());
    let groups = [(probes.len() as u32).div_ceil(WORKGROUP), 1, 1];
    let mut trial = Trial::new([bytes(&probes)], &dispatch, groups);
    for (i, &probe) in probes.iter().enumerate() {
        trial.expect(i, &reply(probe));
    }
    trial
}

/// Values of ordinary size in no order, and sums that lie half way between floats.
fn probes() -> Vec<Probe> {
    let mut state = 1u32;
    let mut next = || {
        // Numerical Recipes' linear congruential generator: any spread will do.
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
