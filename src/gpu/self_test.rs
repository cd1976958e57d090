//! The self-test: before a device is trusted it computes a fixed set of inputs, and every bit is
//! compared with the CPU's.

use crate::gpu::error::{EvaluateError, VulkanError};
use crate::shader::{Dispatch, Kernel, Probe, Reply, WORKGROUP};
use std::sync::Arc;

use bytemuck::Zeroable as _;
use glam::{DVec3, Quat};

use crate::cpu::engine::CpuEngine;
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::{Job, VulkanEngine};
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::math::canonical::round_quat;
use crate::math::quaternion::exp;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::slerp::SLERP;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, Wanted};
use crate::simd::dispatch::VectorWidth;
use crate::time::frames::Frames;
use crate::tracks::set::TrackSet;
use crate::twin::self_test::reply;

/// How a device did on one check of the self-test.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SelfTestReport {
    /// What it looks for.
    pub name: &'static str,
    /// Results compared.
    pub total: usize,
    /// Results with other bits than the CPU's.
    pub differing: usize,
}

/// Runs every check on a device.
pub(crate) fn run(engine: &VulkanEngine) -> Result<Vec<SelfTestReport>, VulkanError> {
    let mut reports = expressions(&engine.device, Exactness::Demanded)?;
    for (name, method) in [
        ("arc kernel", SLERP),
        ("polynomial kernel", BESSEL_OVERHAUSER),
    ] {
        let set = hostile_set();
        let wanted = Wanted {
            group_bytes: Some(engine.group_bytes),
            ..Wanted::all(&set)
        };
        let clip = ClipData::new(&set, method.into(), wanted).expect("the set suits every method");
        let cpu = CpuEngine::on_shared_threads(VectorWidth::Baseline);
        let buffers = engine.upload(&clip, None)?;
        let mut report = SelfTestReport {
            name,
            total: 0,
            differing: 0,
        };
        for frames in [
            Frames::fps(24),
            Frames::at(vec![0.0, 0.017, 1.3, 1.31, 4.9, 5.0, 5.0001]),
        ] {
            let timeline = frames
                .resolve(clip.track_count(), clip.time_span)
                .expect("a few frames");
            let whole = Window::whole(clip.track_count(), timeline.len(), Layout::TrackMajor);
            let mut expected = vec![Quat::IDENTITY; whole.len()];
            let mut found = expected.clone();
            cpu.evaluate(&clip, &timeline, &whole, &mut expected)
                .expect("short gaps");
            let job = Job {
                clip: &clip,
                buffers: &buffers,
                timeline: &timeline,
                encoding: Encoding::F32,
            };
            match engine.evaluate_into(job, &whole, bytemuck::cast_slice_mut(&mut found)) {
                Err(EvaluateError::Vulkan(error)) => return Err(error),
                done => done.expect("short gaps"),
            }
            report.total += whole.len();
            report.differing += differing(&expected, &found);
        }
        reports.push(report);
    }
    Ok(reports)
}

/// Rotations whose bits differ.
fn differing(a: &[Quat], b: &[Quat]) -> usize {
    let bits = |q: &Quat| q.to_array().map(f32::to_bits);
    a.iter().zip(b).filter(|(a, b)| bits(a) != bits(b)).count()
}

/// Five seconds of uneven keys on several axes, with steps from tiny to large.
fn hostile_set() -> TrackSet {
    let mut set = TrackSet::new();
    let times = [0.0, 0.04, 1.0, 1.25, 2.5, 4.0, 5.0];
    for (track, size) in [1e-20, 1e-7, 0.02, 0.8, 1.5].into_iter().enumerate() {
        let keys: Vec<Quat> = (0..times.len())
            .map(|i| {
                let turn = (i * i + track) as f64 * size;
                let axis = DVec3::new(1.0, track as f64 - 1.5, (i % 3) as f64 * 0.3);
                Quat::from_array(round_quat(exp((axis * (turn / 2.0)).to_array())))
            })
            .collect();
        set.push("", &times, &keys).expect("unit keys");
    }
    set
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
            n: (next() * 2.0f32.powi(8 + i % 23)) as i32,
        })
        .collect();
    let half_ulp = f32::EPSILON / 2.0;
    let (even, odd) = ((1.0, half_ulp), (1.0 + f32::EPSILON, half_ulp));
    let (b, n) = (half_ulp, (1 << 24) + 1);
    probes.extend([even, odd, (-1.0, -half_ulp)].map(|(a, c)| Probe { a, b, c, n }));
    probes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::options::EngineOptions;
    use crate::gpu::physical::{DeviceKind, list};

    /// A comparison that cannot fail proves nothing: without the decorations lavapipe folds `(a +
    /// b) - a`, and that check must fail.
    #[test]
    fn it_fails_on_a_driver_that_is_left_free() {
        let devices = list(false).unwrap_or_default();
        let lavapipe = devices
            .into_iter()
            .find(|d| d.info.kind == DeviceKind::Cpu && d.info.name.starts_with("llvmpipe"));
        let Some(lavapipe) = lavapipe else {
            assert!(std::env::var_os("CI").is_none(), "CI must have lavapipe");
            eprintln!("NO LAVAPIPE: the negative control did not run");
            return;
        };
        let device = LogicalDevice::new(lavapipe, &EngineOptions::default()).unwrap();
        let differing = |exactness| {
            let reports = expressions(&device, exactness).unwrap();
            reports
                .iter()
                .map(|report| (report.name, report.differing))
                .collect::<Vec<_>>()
        };
        assert!(differing(Exactness::Demanded).iter().all(|(_, n)| *n == 0));
        let free = differing(Exactness::LeftToTheDriver);
        let (name, wrong) = free[1];
        assert_eq!(name, "re-association of a sum");
        assert!(wrong > 100, "{free:?}");
    }
}
