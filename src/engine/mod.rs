//! The engine: sets go in, clips stay on its device, rotations come out.

#[cfg(feature = "vulkan")]
mod application_device;
mod auto;
pub(crate) mod clip;
mod stream;

use std::sync::Arc;
#[cfg(feature = "prove")]
use std::time::Duration;

use crate::checks::check_encoding;
use crate::cpu::engine::CpuEngine;
use crate::device::{Device, VulkanDevice};
use crate::engine::clip::Clip;
use crate::engine::clip::request::Request;
use crate::error::Error;
use crate::evaluate::Backend;
use crate::evaluate::uploaded::Uploaded;
#[cfg(feature = "prove")]
use crate::gpu::engine::choices::EngineChoices;
use crate::gpu::options::{EngineOptions, Timings};
#[cfg(feature = "prove")]
use crate::gpu::physical::details::DeviceDetails;
use crate::gpu::recovery::Opened;
use crate::gpu::reports::{DeviceInfo, KernelCheck, NegativeControl, SelfTestReport};
use crate::gpu::self_test;
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::prepare::preparation::SetRequest;
use crate::simd::dispatch::VectorWidth;
use crate::threads::lock;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::set::TrackSet;

/// The most worker threads that can be asked for.
const MAX_THREADS: usize = 1024;

/// Evaluates sets on one device.
///
/// ```
/// use glam::Quat;
/// use tumble::{Device, Engine, SampleTimes, TrackSet, method};
///
/// let mut set = TrackSet::new();
/// let keys = [0.0, 1.0, 0.5].map(Quat::from_rotation_y);
/// set.push("door", &[0.0, 1.0, 2.5], &keys)?;
///
/// let engine = Engine::new(Device::Cpu)?;
/// let clip = engine.upload(&set, method::BESSEL_OVERHAUSER)?;
/// let rotations = clip.evaluate(&SampleTimes::fps(25))?;
/// assert_eq!((rotations.track_count(), rotations.sample_count()), (1, 63));
/// assert_eq!(rotations.get(0, 25), Some(keys[1]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Cloning is cheap; clones share the device. Calls from several threads are
/// allowed; a Vulkan device serves them one after another.
#[derive(Clone)]
pub struct Engine {
    pub(crate) backend: Arc<Backend>,
}

impl Engine {
    /// Opens a device with the default options.
    ///
    /// # Errors
    /// When the device cannot be opened, or fails the self-test.
    pub fn new(device: Device) -> Result<Self, Error> {
        Self::with_options(device, &EngineOptions::default())
    }

    /// Opens a device.
    ///
    /// ```
    /// use tumble::{Device, Engine, EngineOptions};
    /// let mut options = EngineOptions::default();
    /// options.thread_count = Some(2);
    /// let engine = Engine::with_options(Device::Cpu, &options)?;
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the device cannot be opened, or fails the self-test and
    /// [`EngineOptions::allow_inexact`] is off. Each kernel is checked when an evaluation first needs it, which
    /// is refused with [`VulkanError::InexactKernel`](crate::vulkan::VulkanError::InexactKernel) where it differs.
    pub fn with_options(device: Device, options: &EngineOptions) -> Result<Self, Error> {
        VectorWidth::limit()?;
        match device {
            Device::Cpu => {
                if let Some(requested) = options
                    .thread_count
                    .filter(|n| !(1..=MAX_THREADS).contains(n))
                {
                    let max = MAX_THREADS;
                    return Err(Error::ThreadCount { requested, max });
                }
                let width = options.vector_width.unwrap_or_else(VectorWidth::widest);
                let (stores, memory) = (options.streaming_stores, options.memory);
                let engine = CpuEngine::new(width, stores, options.thread_count, memory)?;
                Ok(Self {
                    backend: Arc::new(Backend::Cpu(engine)),
                })
            }
            Device::Vulkan(VulkanDevice { physical }) => {
                Ok(Self::with_opened(Opened::new(&physical, options)?))
            }
        }
    }

    pub(crate) fn with_opened(opened: Opened) -> Self {
        Self {
            backend: Arc::new(Backend::Vulkan(Box::new(opened))),
        }
    }

    /// The name of its device: the driver's, or `CPU`.
    #[must_use]
    pub fn device_name(&self) -> &str {
        self.device_info().map_or("CPU", |info| &info.name)
    }

    /// What is known of its Vulkan device; `None` on the CPU.
    #[must_use]
    pub fn device_info(&self) -> Option<&DeviceInfo> {
        self.backend.opened().map(|opened| &opened.info)
    }

    /// What Vulkan reports of its device; `None` on the CPU.
    #[cfg(feature = "prove")]
    #[must_use]
    pub fn device_details(&self) -> Option<DeviceDetails> {
        let opened = self.backend.opened()?;
        Some(opened.engine().device.physical.details())
    }

    /// What was chosen for its device; `None` on the CPU.
    #[cfg(feature = "prove")]
    #[must_use]
    pub fn choices(&self) -> Option<EngineChoices> {
        Some(self.backend.opened()?.engine().choices())
    }

    /// The results of the device's self-test as it was opened, one report for each expression; empty on the
    /// CPU, which devices are compared with.
    #[must_use]
    pub fn self_tests(&self) -> &[SelfTestReport] {
        self.backend
            .opened()
            .map_or(&[], |opened| &opened.self_tests)
    }

    /// Compiles every kernel, one after the other, and says how long the driver took, with its caches as they
    /// are. `each` gets the name and the time, and goes on while it returns true. Nothing is kept.
    ///
    /// # Errors
    /// When the device fails. On the CPU there is nothing to compile.
    #[cfg(feature = "prove")]
    pub fn compile_kernels(
        &self,
        each: &mut dyn FnMut(&'static str, Duration) -> bool,
    ) -> Result<(), Error> {
        let Some(opened) = self.backend.opened() else {
            return Ok(());
        };
        Ok(opened.engine().compile_kernels(each)?)
    }

    /// Runs every kernel of the table on the device beside its twin on the CPU, and compares every bit: small
    /// inputs, ordinary ones and hostile ones. Evaluations check each kernel by itself when they first need it,
    /// unless it is known to be exact on this device, from this process or an earlier one; this checks all of
    /// them whatever is known. A kernel that differs is no error here. Empty on the CPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn check_kernels(&self) -> Result<Vec<KernelCheck>, Error> {
        self.kernel_checks(false)
    }

    /// As [`Engine::check_kernels`], one kernel after the other: `each` gets the check, and goes on while it
    /// returns true.
    ///
    /// # Errors
    /// When the device fails.
    #[cfg(feature = "prove")]
    pub fn check_kernels_while(
        &self,
        each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), Error> {
        let Some(opened) = self.backend.opened() else {
            return Ok(());
        };
        Ok(opened.engine().check_kernels(false, each)?)
    }

    /// As [`Engine::check_kernels`], but for the kernels that are known to be exact on this device, which are
    /// listed as [`remembered`](KernelCheck::remembered).
    ///
    /// # Errors
    /// When the device fails.
    pub fn check_unknown_kernels(&self) -> Result<Vec<KernelCheck>, Error> {
        self.kernel_checks(true)
    }

    /// The kernels that the device may be given, without running any: those that are known to be exact on it are
    /// [`remembered`](KernelCheck::remembered), and of the others nothing was compared. Empty on the CPU.
    #[must_use]
    pub fn known_kernels(&self) -> Vec<KernelCheck> {
        let known = |opened: &Opened| opened.engine().known_kernels();
        self.backend.opened().map_or_else(Vec::new, known)
    }

    fn kernel_checks(&self, only_unknown: bool) -> Result<Vec<KernelCheck>, Error> {
        let Some(opened) = self.backend.opened() else {
            return Ok(Vec::new());
        };
        let mut checks = Vec::new();
        let mut each = |check| {
            checks.push(check);
            true
        };
        opened.engine().check_kernels(only_unknown, &mut each)?;
        Ok(checks)
    }

    /// Runs the expressions of the self-test without what forbids the driver to compute them otherwise, to see that
    /// the comparison finds a driver that does. `None` on the CPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn negative_control(&self) -> Result<Option<NegativeControl>, Error> {
        let Some(opened) = self.backend.opened() else {
            return Ok(None);
        };
        Ok(Some(self_test::negative_control(&opened.engine())?))
    }

    /// The messages of the validation layer so far; see [`Device::list_with`].
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        let messages = |opened: &Opened| {
            let device = &opened.engine().device;
            device.physical.instance.validation_messages()
        };
        self.backend.opened().map_or_else(Vec::new, messages)
    }

    /// Where the time of this engine's evaluations went since this was last asked,
    /// or since it was opened; nothing on the CPU.
    #[must_use]
    pub fn take_timings(&self) -> Timings {
        let timings = |opened: &Opened| std::mem::take(&mut *lock(&opened.engine().timings));
        self.backend.opened().map_or_else(Timings::default, timings)
    }

    /// Prepares a set for a method and brings it to the device, where it stays. Where that would take more than
    /// [`EngineOptions::memory`], the clip has the keys instead, and each evaluation prepares them piece by
    /// piece: the same bits, but slower.
    ///
    /// # Errors
    /// When a track cannot be interpolated as asked, or there is not the memory;
    /// [`Engine::evaluate`] works through such a set piece by piece.
    pub fn upload(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
    ) -> Result<Clip, Error> {
        let uploaded = Uploaded::whole(&self.backend, set, interpolation.into())?;
        Ok(Clip::new(self.clone(), uploaded))
    }

    /// A request for the samples that `frames` means, of a set that need not be uploaded: of all tracks, track by
    /// track, as values of four f32, unless it says otherwise. Only what the samples need is prepared. On a Vulkan
    /// device a set larger than its memory (or than [`EngineOptions::memory`]) goes through it some tracks at a
    /// time.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Engine, Error, SampleTimes, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// let engine = Engine::new(Device::Cpu)?;
    /// let frames = SampleTimes::fps(60);
    /// let second = engine.request(&set, method::SLERP, &frames).tracks(1..2).evaluate()?;
    /// assert_eq!(second.get(0, 60), Some(keys[1]));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn request<'a>(
        &'a self,
        set: &'a TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &'a SampleTimes,
    ) -> Request<'a> {
        Request::of_set(self, set, interpolation.into(), frames)
    }

    /// Prepares and evaluates in one go, `[track][frame]`: short for
    /// [`request`](Engine::request)`(set, interpolation, frames).`[`evaluate`](Request::evaluate)`()`.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`]; also when the quantity is a velocity or an
    /// acceleration.
    pub fn evaluate(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
    ) -> Result<Rotations, Error> {
        self.request(set, interpolation, frames).evaluate()
    }

    /// The angular velocity or acceleration of every track at every sample, as
    /// [`Interpolation::quantity`] says: short for [`request`](Engine::request)`(set, interpolation,
    /// frames).`[`layout`](Request::layout)`(layout).`[`rates`](Request::rates)`()`.
    ///
    /// # Errors
    /// As [`Engine::evaluate`]; also when the quantity is the rotation.
    #[doc(alias = "angular velocity")]
    #[doc(alias = "angular acceleration")]
    pub fn rates(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        self.request(set, interpolation, frames)
            .layout(layout)
            .rates()
    }

    pub(crate) fn samples<T>(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let request = SetRequest::whole(set, &interpolation, timeline);
        let storage = (self.backend).evaluate(&request, layout)?;
        let (tracks, samples) = (set.track_count(), timeline.len());
        Ok(Samples::new(storage, tracks, samples, layout))
    }

    /// Into memory of the result's type: short for [`request`](Engine::request)`(set, interpolation,
    /// frames).`[`layout`](Request::layout)`(layout).`[`evaluate_into`](Request::evaluate_into)`(output)`, which takes
    /// memory of any type. [`Quat`](glam::Quat) takes rotations, [`Vec4`](glam::Vec4) velocities and accelerations,
    /// `[f32; 4]` either. It is faster when it is used again ([`OutputBuffer`](crate::output::buffer::OutputBuffer)):
    /// the first touch of fresh memory costs more than evaluating. Memory that is aligned to 16 bytes is filled
    /// without a copy.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`]; also when `output` is not exactly as long as the
    /// result, or of another type.
    pub fn evaluate_into<R: OutputValue>(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
        output: &mut [R],
    ) -> Result<(), Error> {
        self.request(set, interpolation, frames)
            .layout(layout)
            .evaluate_values_into(output)
    }

    /// Compiles the kernels for results of these, which a Vulkan device else does when the first of them
    /// is asked for: some milliseconds each, on some drivers seconds. What was compiled is kept for later
    /// processes. The CPU has nothing to compile.
    ///
    /// ```
    /// # use tumble::{Device, Encoding, Engine, method};
    /// # let engine = Engine::new(Device::Cpu)?;
    /// engine.warm(method::BESSEL_OVERHAUSER, Encoding::F32)?; // while a level loads
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the encoding is for rotations and the quantity is another, or the device fails.
    pub fn warm(
        &self,
        interpolation: impl Into<Interpolation>,
        encoding: Encoding,
    ) -> Result<(), Error> {
        let interpolation = interpolation.into();
        check_encoding(encoding, interpolation.quantity)?;
        match self.backend.opened() {
            Some(opened) => Ok(opened.warm(interpolation.form(), encoding)?),
            None => Ok(()),
        }
    }

    /// Describes in words how a set would be evaluated: whether it is prepared, and in what
    /// pieces. All routes give the same bits.
    ///
    /// # Errors
    /// When the frames do not fit the set.
    pub fn explain_route(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<String, Error> {
        let timeline = frames.resolve(set.track_count(), set.time_span())?;
        let interpolation = interpolation.into();
        let request = SetRequest::whole(set, &interpolation, &timeline);
        let route = (self.backend).route(&request, layout);
        Ok(route.to_string())
    }
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("device", &self.device_name())
            .finish_non_exhaustive()
    }
}
