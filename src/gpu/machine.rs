//! The trait `Machine` for a Vulkan device.

use std::sync::Arc;

use rayon::prelude::*;

use crate::cpu::engine::from_keys::UnresolvedRow;
use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::gpu::clip::VulkanClip;
use crate::gpu::crowd::VulkanCrowd;
use crate::gpu::opened::Opened;
use crate::gpu::physical::PhysicalDevice;
use crate::gpu::self_test;
use crate::machine::crowd::{CrowdSource, MachineCrowd};
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::options::{EngineOptions, Timings};
use crate::machine::plan::{Limits, MachineKind, Rows};
use crate::machine::poses::PassRunner;
use crate::machine::reports::{DeviceInfo, KernelCheck, NegativeControl, SelfTestReport};
use crate::machine::{ListedDevice, Machine, MachineClip};
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::prepare::clip_data::ClipData;
use crate::prepare::preparation::SetRequest;
use crate::shader::Form;
use crate::threads::{lock, on_threads};
use crate::work::lists::keys::KeyJob;

impl ListedDevice for PhysicalDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn open(&self, options: &EngineOptions) -> Result<Arc<dyn Machine>, VulkanError> {
        Ok(Arc::new(Opened::new(self, options)?))
    }
}

impl Machine for Opened {
    fn limits(&self) -> Limits {
        let engine = self.engine();
        let arcs_from = engine.prepares_arcs_from;
        Limits {
            kind: MachineKind::Device {
                window: engine.window(),
            },
            memory: engine.clip_bytes(),
            group_bytes: Some(engine.group_bytes),
            prepares_arcs_from: Some(arcs_from).filter(|&from| from < usize::MAX),
            kept_segments: None,
        }
    }

    fn rows(
        &self,
        request: &SetRequest<'_>,
        rows: Rows,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        match rows {
            Rows::FromKeys(curve) => {
                let job = KeyJob { request, curve };
                output.fill(|output| evaluate_from_keys(self, &job, output))
            }
            // On these routes the host evaluates segments itself, because uploading them would take longer.
            Rows::SparseSamples | Rows::Batches { .. } => {
                self.engine().host.rows(request, rows, output)
            }
        }
    }

    fn clip(self: Arc<Self>, data: ClipData) -> Result<Box<dyn MachineClip>, EvaluateError> {
        Ok(Box::new(VulkanClip::new(self, data)?))
    }

    fn passes(
        &self,
        work: &mut dyn FnMut(&dyn PassRunner) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        self.attempt_smaller(|engine| work(engine))
    }

    fn crowd(
        &self,
        source: &CrowdSource<'_>,
    ) -> Result<Option<Box<dyn MachineCrowd>>, VulkanError> {
        Ok(Some(Box::new(VulkanCrowd::new(self.engine(), source)?)))
    }

    fn info(&self) -> Option<&DeviceInfo> {
        Some(&self.info)
    }

    fn self_tests(&self) -> &[SelfTestReport] {
        &self.self_tests
    }

    fn negative_control(&self) -> Result<Option<NegativeControl>, VulkanError> {
        self_test::negative_control(&self.engine()).map(Some)
    }

    fn known_kernels(&self) -> Vec<KernelCheck> {
        self.engine().known_kernels()
    }

    fn check_kernels(
        &self,
        only_unknown: bool,
        each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), VulkanError> {
        self.engine().check_kernels(only_unknown, each)
    }

    fn warm(&self, form: Form, encoding: Encoding) -> Result<(), EvaluateError> {
        self.compile(form, encoding)
    }

    fn validation_messages(&self) -> Vec<String> {
        let device = &self.engine().device;
        device.physical.instance.validation_messages()
    }

    fn take_timings(&self) -> Timings {
        std::mem::take(&mut *lock(&self.engine().timings))
    }
}

/// Rotations that one task searches for unresolved ones.
const SEARCH_CHUNK: usize = 16 * 1024;

/// Evaluates a job directly from keys, and on the CPU the samples that the device marked as unresolved.
fn evaluate_from_keys(
    opened: &Opened,
    job: &KeyJob<'_>,
    output: &mut [[f32; 4]],
) -> Result<(), EvaluateError> {
    opened.attempt_smaller(|engine| engine.evaluate_keys(job, output))?;
    let unresolved = |some: &[[f32; 4]]| some.contains(&UNRESOLVED);
    let is_cubic = matches!(job.curve, KeyCurve::Cubics(_));
    if !is_cubic || !on_threads(|| output.par_chunks(SEARCH_CHUNK).any(unresolved))? {
        return Ok(());
    }
    let (request, engine) = (job.request, opened.engine());
    let first = request.samples.start;
    let resolve = |(output, track)| {
        let key = 0;
        let row = UnresolvedRow {
            track,
            first,
            key,
            output,
        };
        engine.host.resolve(request, std::iter::once(row))
    };
    on_threads(|| {
        let rows = output.par_chunks_mut(request.samples.len());
        rows.zip(request.tracks.clone()).try_for_each(resolve)
    })??;
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::device::Device;
    use crate::engine::Engine;
    use crate::method::SLERP;
    use crate::method::interpolation::Interpolation;
    use crate::time::frames::SampleTimes;
    use crate::tracks::set::TrackSet;

    /// Plans for devices have no rows that only the CPU computes. The test requests such rows nevertheless: the host
    /// must then compute them.
    #[test]
    fn rows_that_a_device_does_not_compute_are_the_hosts() {
        let mut set = TrackSet::new();
        let keys = [0.0, 0.3, 1.1, 0.4].map(Quat::from_rotation_y);
        for _ in 0..3 {
            set.push("", &[0.0, 0.5, 1.25, 2.0], &keys).unwrap();
        }
        let interpolation = Interpolation::from(SLERP);
        let timeline = SampleTimes::fps(7).resolve(3, set.time_span()).unwrap();
        let request = SetRequest::whole(&set, &interpolation, &timeline);
        let rows_of = |engine: &Engine, rows| {
            let mut found = vec![[0.0; 4]; request.len()];
            let output = EncodedOutput::of_values(&mut found);
            engine.machine.rows(&request, rows, output).unwrap();
            found
        };
        let cpu = Engine::new(Device::Cpu).unwrap();
        for device in Device::list().unwrap_or_default() {
            let engine = Engine::new(device).unwrap();
            for rows in [Rows::SparseSamples, Rows::Batches { cuts_tracks: false }] {
                let found = rows_of(&engine, rows);
                assert!(found.iter().all(|value| *value != [0.0; 4]));
                assert_eq!(found, rows_of(&cpu, rows), "{rows:?}");
            }
        }
    }
}
