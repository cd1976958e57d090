//! The self-test: before a device is used, it computes some expressions, and every bit is compared with the CPU's.
//! The check of each kernel, when it is first made, is in [`kernel_check`](crate::gpu::kernel_check).

use std::sync::Arc;

use bytemuck::Zeroable as _;

use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::kernel_check::self_test::trial;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::machine::error::VulkanError;
pub(crate) use crate::machine::reports::{NegativeControl, SelfTestReport};
use crate::shader::{Kernel, Reply};

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
    let trial = trial();
    let expected: Vec<Reply> = bytemuck::pod_collect_to_vec(&trial.expected(Kernel::SelfTest));
    let mut replies = vec![Reply::zeroed(); expected.len()];
    let pipeline = Pipeline::new(device, Kernel::SelfTest, exactness)?;
    let output = bytemuck::cast_slice_mut(&mut replies);
    trial.run(&pipeline, output)?;
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
    let reports = self_tests.map(|(name, value)| {
        let pairs = expected.iter().zip(&replies);
        let differing = pairs.filter(|(a, b)| value(a).to_bits() != value(b).to_bits());
        SelfTestReport {
            name,
            total: expected.len(),
            differing: differing.count(),
        }
    });
    Ok(reports.into())
}
