//! An opened device, and its recovery from errors: a lost device is opened again, and work that runs out of memory is
//! repeated in smaller windows.

use std::any::Any;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::job::ClipBuffers;
use crate::gpu::physical::PhysicalDevice;
use crate::gpu::self_test;
use crate::machine::Machine;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::options::EngineOptions;
use crate::machine::reports::{DeviceInfo, SelfTestReport};
use crate::output::encoding::Encoding;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Form, Kernel};
use crate::threads::exclusive::Exclusive;
use crate::threads::lock;

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
                    // If windows already have the smallest size, another attempt would fail too.
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
        // Worker threads do not wait for `reopening` (`Exclusive::take`), so another thread may have opened the device
        // meanwhile. Then the engine of that thread is kept.
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
