//! The self-test: before a device is used, it computes some expressions, and every bit is compared with the CPU's.
//! The check of each kernel, when it is first made, is in [`kernel_check`](crate::gpu::kernel_check).

use std::sync::Arc;

use bytemuck::Zeroable as _;

use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::kernel_check::self_test::probes;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::gpu::run_once::run_once;
use crate::machine::error::VulkanError;
pub(crate) use crate::machine::reports::{NegativeControl, SelfTestReport};
use crate::shader::{Dispatch, Kernel, Reply, WORKGROUP};
use crate::twin::self_test::reply;

/// Runs every expression on a device.
pub(crate) fn run(engine: &VulkanEngine) -> Result<Vec<SelfTestReport>, VulkanError> {
    expressions(&engine.device, Exactness::Demanded)
}

/// Runs every expression without the decorations that forbid the driver to change it.
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
    run_once(
        &pipeline,
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
