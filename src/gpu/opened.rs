//! An opened device as a machine, and its recovery from errors: a lost device is opened again, and work that runs out
//! of memory is repeated in smaller windows.

use std::any::Any;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::gpu::clip::{ClipBuffers, VulkanClip};
use crate::gpu::crowd::VulkanCrowd;
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
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
use crate::shader::{Form, Kernel};
use crate::threads::exclusive::Exclusive;
use crate::threads::{lock, on_threads};
use crate::work::lists::keys::KeyJob;

/// The maximum number of times that a lost device is opened again in one call.
const REOPENINGS: usize = 3;

/// An open Vulkan device, and its properties.
pub(crate) struct Opened {
    /// The engine, which is replaced when the device is lost.
    current: Mutex<Arc<VulkanEngine>>,
    /// Ensures that only one of several callers opens a lost device again.
    reopening: Exclusive<()>,
    options: EngineOptions,
    pub(crate) self_tests: Vec<SelfTestReport>,
    pub(crate) info: DeviceInfo,
}

impl Opened {
    /// The device, if the machine is one.
    pub(crate) fn of(machine: &dyn Machine) -> Option<&Self> {
        let machine: &dyn Any = machine;
        machine.downcast_ref()
    }

    /// Opens a device and runs the self-test; refuses a device that fails it, unless the options
    /// allow inexact ones.
    pub(crate) fn new(
        physical: &PhysicalDevice,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let open = || {
            let device = LogicalDevice::new(physical.clone(), options)?;
            Self::trusted(VulkanEngine::new(device, options), options)
        };
        for _ in 0..REOPENINGS {
            match open() {
                Err(error) if error.is_lost() => {}
                opened => return opened,
            }
        }
        open()
    }

    /// As [`Opened::new`], for a device that is already open.
    pub(crate) fn trusted(
        engine: VulkanEngine,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        Ok(Self {
            self_tests: trust(&engine, options)?,
            info: engine.device.physical.info.clone(),
            current: Mutex::new(Arc::new(engine)),
            reopening: Exclusive::default(),
            options: options.clone(),
        })
    }

    pub(crate) fn engine(&self) -> Arc<VulkanEngine> {
        Arc::clone(&lock(&self.current))
    }

    /// Runs `work`. If the device is lost, opens it again and repeats the work, at most three times; repeated work
    /// gives the same bits.
    fn attempt<T>(
        &self,
        mut work: impl FnMut(&VulkanEngine) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        for _ in 0..REOPENINGS {
            let engine = self.engine();
            engine.device.check_process()?;
            match work(&engine) {
                Err(EvaluateError::Vulkan(error)) if error.is_lost() => {
                    match self.reopen(&engine) {
                        Ok(true) => {}
                        Err(again) if again.is_lost() => {}
                        Ok(false) => return Err(error.into()),
                        Err(other) => return Err(other.into()),
                    }
                }
                done => return done,
            }
        }
        work(&self.engine())
    }

    /// Copies a clip's segments to the device. If memory is short, frees the buffers that are kept for the next
    /// evaluation and tries again.
    pub(crate) fn upload(
        &self,
        clip: &ClipData,
        mut spare: Option<ClipBuffers>,
    ) -> Result<ClipBuffers, EvaluateError> {
        let uploaded = self.attempt(|engine| match engine.upload(clip, spare.take()) {
            Err(error) if error.is_out_of_memory() && engine.give_back() => {
                Ok(engine.upload(clip, None)?)
            }
            done => Ok(done?),
        });
        uploaded.map_err(|error| match error {
            EvaluateError::Vulkan(error) if error.is_out_of_memory() => {
                EvaluateError::NoRoom(error)
            }
            error => error,
        })
    }

    /// Makes the pipelines for segments of a form and for evaluation directly from keys, and stores the driver's
    /// compiled kernels.
    pub(super) fn compile(&self, form: Form, encoding: Encoding) -> Result<(), EvaluateError> {
        self.attempt(|engine| {
            for list in engine.lists() {
                engine.pipeline(Kernel::over_segments(form, list, encoding.row().store))?;
            }
            if form == Form::Arc && engine.prepares_arcs(usize::MAX) {
                engine.pipeline(Kernel::PrepareArcs)?;
            }
            if encoding == Encoding::F32 {
                for kernel in [
                    Kernel::FromKeysArcs,
                    Kernel::FromKeysTwoKeys,
                    Kernel::FromKeysCubics,
                ] {
                    engine.pipeline(kernel)?;
                }
            }
            let device = &engine.device;
            device.pipelines.keep(&device.raw);
            Ok(())
        })
    }

    /// As [`Opened::attempt`]; if memory runs out, repeats the work in windows of half the size, down to 1 MiB.
    pub(crate) fn attempt_smaller<T>(
        &self,
        mut work: impl FnMut(&VulkanEngine) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        loop {
            match self.attempt(&mut work) {
                Err(EvaluateError::Vulkan(error)) if error.is_out_of_memory() => {
                    let engine = self.engine();
                    engine.give_back();
                    // At their minimum, another attempt would fail as well.
                    if !engine.halve_windows() {
                        return Err(error.into());
                    }
                }
                done => return done,
            }
        }
    }

    /// Opens a lost device again and replaces it; false for an application's device, which only the application can
    /// open.
    fn reopen(&self, lost: &Arc<VulkanEngine>) -> Result<bool, VulkanError> {
        let _reopening = self.reopening.take();
        if !Arc::ptr_eq(&self.engine(), lost) {
            return Ok(true); // another thread was faster
        }
        if !lost.device.owned {
            return Ok(false);
        }
        let device = LogicalDevice::new(lost.device.physical.clone(), &self.options)?;
        let engine = VulkanEngine::new(device, &self.options);
        engine.window.store(lost.window(), Ordering::Relaxed);
        trust(&engine, &self.options)?;
        let mut current = lock(&self.current);
        // The engine's threads do not wait for each other.
        if Arc::ptr_eq(&current, lost) {
            *current = Arc::new(engine);
        }
        Ok(true)
    }
}

fn trust(
    engine: &VulkanEngine,
    options: &EngineOptions,
) -> Result<Vec<SelfTestReport>, VulkanError> {
    let self_tests = self_test::run(engine)?;
    let failed = self_tests.iter().find(|check| check.differing > 0);
    if let (Some(check), false) = (failed, options.allow_inexact) {
        return Err(VulkanError::Inexact {
            device: engine.device.physical.info.name.clone(),
            check: check.name,
            differing: check.differing,
            total: check.total,
        });
    }
    Ok(self_tests)
}

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
            memory: engine.clip_bytes,
            group_bytes: Some(engine.group_bytes),
            prepares_arcs_from: Some(arcs_from).filter(|&from| from < usize::MAX),
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
            // The host's segments are evaluated before a device would have them.
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
    let resolve =
        |(output, track): (&mut _, _)| (engine.host).resolve(request, track, (first, 0), output);
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

    /// Plans for devices have no rows that only the CPU computes. If one had, no value would be missing.
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
