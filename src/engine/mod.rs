//! The engine: it evaluates sets, or clips that stay on its device, and returns rotations.

#[cfg(feature = "vulkan")]
mod application_device;
mod auto;
pub(crate) mod clip;
pub(crate) mod groups;
mod representations;
mod stream;

use std::sync::Arc;
#[cfg(feature = "lab")]
use std::time::Duration;

use crate::checks::check_encoding;
use crate::cpu::engine::CpuEngine;
use crate::device::{Device, VulkanDevice};
use crate::engine::clip::Clip;
use crate::engine::clip::request::Request;
use crate::engine::groups::GroupedSet;
use crate::error::Error;
use crate::evaluate;
use crate::evaluate::uploaded::Uploaded;
#[cfg(feature = "lab")]
use crate::gpu::engine::figures::EngineChoices;
#[cfg(feature = "lab")]
use crate::gpu::physical::details::DeviceDetails;
use crate::machine::Machine;
use crate::machine::options::{EngineOptions, Timings};
use crate::machine::plan::Plan;
use crate::machine::reports::{DeviceInfo, KernelCheck, NegativeControl, SelfTestReport};
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::prepare::preparation::SetRequest;
use crate::simd::dispatch::VectorWidth;
use crate::time::frames::SampleTimes;
use crate::tracks::per_track::PerTrack;
use crate::tracks::set::TrackSet;

/// The maximum number of worker threads.
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
/// Clones are cheap and share the device. Several threads may call an engine; a Vulkan device serves the calls one
/// after another.
#[derive(Clone)]
pub struct Engine {
    pub(crate) machine: Arc<dyn Machine>,
}

impl Engine {
    /// Opens a device with the default options.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
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
    /// * When the device cannot be opened.
    /// * When the options are out of range.
    /// * When the device fails the self-test, and [`EngineOptions::allow_inexact`] is off.
    ///
    /// Each kernel is checked later, when an evaluation first needs it; if it differs from the CPU, that evaluation
    /// fails with [`VulkanError::InexactKernel`](crate::vulkan::VulkanError::InexactKernel).
    pub fn with_options(device: Device, options: &EngineOptions) -> Result<Self, Error> {
        VectorWidth::limit().map_err(Error::VectorWidth)?;
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
                let (threads, kept) = (options.thread_count, options.kept_segments);
                let engine = CpuEngine::new(width, stores, threads, memory, kept)?;
                Ok(Self {
                    machine: Arc::new(engine),
                })
            }
            Device::Vulkan(VulkanDevice { listed }) => Ok(Self {
                machine: listed.open(options)?,
            }),
        }
    }

    /// The name of the device: the driver's name for it, or `CPU`.
    #[must_use]
    pub fn device_name(&self) -> &str {
        self.device_info().map_or("CPU", |info| &info.name)
    }

    /// Name, kind and limits of the Vulkan device; `None` on the CPU.
    #[must_use]
    pub fn device_info(&self) -> Option<&DeviceInfo> {
        self.machine.info()
    }

    /// All details that Vulkan reports of the device; `None` on the CPU.
    #[cfg(feature = "lab")]
    #[must_use]
    pub fn device_details(&self) -> Option<DeviceDetails> {
        Some(self.opened()?.engine().device.physical.details())
    }

    /// The engine's choices for its device; `None` on the CPU.
    #[cfg(feature = "lab")]
    #[must_use]
    pub fn choices(&self) -> Option<EngineChoices> {
        Some(self.opened()?.engine().choices())
    }

    /// The results of the self-test that ran when the device was opened, one report for each expression; empty on the
    /// CPU, with which devices are compared.
    #[must_use]
    pub fn self_tests(&self) -> &[SelfTestReport] {
        self.machine.self_tests()
    }

    /// Compiles every kernel, one after the other, and calls `each` with its name and the time that the driver took.
    ///
    /// The driver's caches are used as they are, and the compiled kernels are not kept. Compilation continues while
    /// `each` returns true. On the CPU, `each` is not called.
    ///
    /// # Errors
    /// When the device fails.
    #[cfg(feature = "lab")]
    pub fn compile_kernels(
        &self,
        each: &mut dyn FnMut(&'static str, Duration) -> bool,
    ) -> Result<(), Error> {
        match self.opened() {
            Some(opened) => Ok(opened.engine().compile_kernels(each)?),
            None => Ok(()),
        }
    }

    /// Compares every kernel on the device with its twin on the CPU, bit by bit, for small, ordinary and extreme
    /// inputs.
    ///
    /// Evaluations check only the kernels that they need, each before its first use, unless a check in this process or
    /// an earlier one has found the kernel exact on this device. This function checks all kernels. A kernel that
    /// differs is listed in the result; this is not an error. The result is empty on the CPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn check_kernels(&self) -> Result<Vec<KernelCheck>, Error> {
        self.kernel_checks(false)
    }

    /// As [`Engine::check_kernels`], with a call of `each` after every kernel; continues while `each` returns true.
    ///
    /// # Errors
    /// When the device fails.
    #[cfg(feature = "lab")]
    pub fn check_kernels_while(
        &self,
        each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), Error> {
        Ok(self.machine.check_kernels(false, each)?)
    }

    /// As [`Engine::check_kernels`], without running the kernels that are known to be exact on this device; they are
    /// listed as [`remembered`](KernelCheck::remembered).
    ///
    /// # Errors
    /// When the device fails.
    pub fn check_unknown_kernels(&self) -> Result<Vec<KernelCheck>, Error> {
        self.kernel_checks(true)
    }

    /// Lists the kernels for this device without running any. Kernels that are known to be exact on it are
    /// [`remembered`](KernelCheck::remembered); for the others no values were compared. Empty on the CPU.
    #[must_use]
    pub fn known_kernels(&self) -> Vec<KernelCheck> {
        self.machine.known_kernels()
    }

    fn kernel_checks(&self, only_unknown: bool) -> Result<Vec<KernelCheck>, Error> {
        let mut checks = Vec::new();
        let mut each = |check| {
            checks.push(check);
            true
        };
        self.machine.check_kernels(only_unknown, &mut each)?;
        Ok(checks)
    }

    /// Runs the self-test's expressions without the decorations that forbid the driver to change them, to show that
    /// the comparison detects such changes. `None` on the CPU.
    ///
    /// # Errors
    /// When the device fails.
    pub fn negative_control(&self) -> Result<Option<NegativeControl>, Error> {
        Ok(self.machine.negative_control()?)
    }

    /// The messages of the validation layer so far; see [`Device::list_validated`].
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        self.machine.validation_messages()
    }

    /// Returns the times of this engine's evaluations since the last call, or since the engine was opened; zero on
    /// the CPU.
    #[must_use]
    pub fn take_timings(&self) -> Timings {
        self.machine.take_timings()
    }

    /// Prepares a set for one interpolation of all tracks, or for [one for each](PerTrack), and stores it on the device as
    /// a clip.
    ///
    /// On the CPU, a clip whose segments would exceed [`EngineOptions::kept_segments`] or [`EngineOptions::memory`]
    /// keeps its keys instead, if samples can be computed from them ([`Clip::bytes_per_key`]). If both segments and
    /// keys would take more than [`EngineOptions::memory`], the clip keeps the set. Each evaluation then prepares the
    /// set piece by piece, which is slower and gives the same bits.
    ///
    /// # Errors
    /// * When a track cannot be interpolated as requested.
    /// * When the interpolations are for another number of tracks, or have several quantities.
    /// * When there is not enough memory. [`Engine::evaluate`] evaluates sets that are larger than memory, piece by
    ///   piece.
    /// * When the device fails.
    pub fn upload(
        &self,
        set: &TrackSet,
        interpolations: impl Into<PerTrack<Interpolation>>,
    ) -> Result<Clip, Error> {
        let (interpolations, tracks) = (interpolations.into(), set.track_count());
        let keys = set.key_count();
        let Some(interpolation) = interpolations.uniform(tracks) else {
            let grouped = GroupedSet::new(self, set, interpolations);
            return Ok(Clip::of_groups(self.clone(), grouped.prepared()?, keys));
        };
        let uploaded = Uploaded::whole(&self.machine, set, interpolation)?;
        Ok(Clip::new(self.clone(), uploaded, keys))
    }

    /// Starts a request for the samples of a set at these times, by one interpolation for all tracks, or by [one for
    /// each](PerTrack). The set need not be uploaded.
    ///
    /// By default the result has all tracks, track by track, with four f32 per value. Only the segments that the
    /// samples need are prepared. On a Vulkan device a set larger than its memory (or than [`EngineOptions::memory`])
    /// is evaluated some tracks at a time.
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
        interpolations: impl Into<PerTrack<Interpolation>>,
        times: &'a SampleTimes,
    ) -> Request<'a> {
        Request::of_set(self, set, interpolations.into(), times)
    }

    /// Prepares and evaluates a set, `[track][frame]`. Short for [`request`](Engine::request)`(set, interpolations,
    /// times).`[`evaluate`](Request::evaluate)`()`.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`]; also when the quantity is a velocity or an acceleration.
    pub fn evaluate(
        &self,
        set: &TrackSet,
        interpolations: impl Into<PerTrack<Interpolation>>,
        times: &SampleTimes,
    ) -> Result<Rotations, Error> {
        self.request(set, interpolations, times).evaluate()
    }

    /// Evaluates the angular velocity or acceleration ([`Interpolation::quantity`]) of every track at every sample.
    /// Short for [`request`](Engine::request)`(set, interpolation,
    /// times).`[`layout`](Request::layout)`(layout).`[`rates`](Request::rates)`()`.
    ///
    /// # Errors
    /// As [`Engine::evaluate`], but the quantity must not be the rotation.
    #[doc(alias = "angular velocity")]
    #[doc(alias = "angular acceleration")]
    pub fn rates(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        self.request(set, interpolation, times)
            .layout(layout)
            .rates()
    }

    /// The values of a request of any quantity.
    pub(crate) fn samples<T>(
        &self,
        request: &SetRequest<'_>,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let plan = self.plan(request, layout, Encoding::F32, None);
        let storage = evaluate::evaluate(&self.machine, request, &plan)?;
        let (tracks, samples) = (request.tracks.len(), request.samples.len());
        Ok(Samples::new(storage, tracks, samples, layout))
    }

    /// How the engine evaluates a request; with `chunk`, as a stream in chunks of so many values.
    pub(crate) fn plan(
        &self,
        request: &SetRequest<'_>,
        layout: Layout,
        encoding: Encoding,
        chunk: Option<usize>,
    ) -> Plan {
        Plan::of(request, layout, encoding, chunk, &self.machine.limits())
    }

    /// Evaluates into memory of the result's type: [`Quat`](glam::Quat) for rotations, [`Vec4`](glam::Vec4) for
    /// velocities and accelerations, or `[f32; 4]` for both. Short for [`request`](Engine::request)`(set,
    /// interpolations,
    /// times).`[`layout`](Request::layout)`(layout).`[`evaluate_into`](Request::evaluate_into)`(output)`, which
    /// accepts memory of any type.
    ///
    /// Reuse the memory: the first access to fresh memory takes longer than the evaluation
    /// ([`OutputBuffer`](crate::output::buffer::OutputBuffer)). Memory that is aligned to 16 bytes is filled without
    /// a copy.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`], but for any quantity; also when `output` is not exactly as long
    /// as the result, or its type does not fit the quantity.
    pub fn evaluate_into<R: OutputValue>(
        &self,
        set: &TrackSet,
        interpolations: impl Into<PerTrack<Interpolation>>,
        times: &SampleTimes,
        layout: Layout,
        output: &mut [R],
    ) -> Result<(), Error> {
        self.request(set, interpolations, times)
            .layout(layout)
            .evaluate_values_into(output)
    }

    /// Compiles the kernels for results of this interpolation and encoding, which takes some milliseconds for each,
    /// on some drivers seconds.
    ///
    /// Without this call, a Vulkan device compiles them at the first such request. Compiled kernels are cached for
    /// later processes. The CPU does nothing.
    ///
    /// ```
    /// # use tumble::{Device, Encoding, Engine, method};
    /// # let engine = Engine::new(Device::Cpu)?;
    /// engine.warm(method::BESSEL_OVERHAUSER, Encoding::F32)?; // while a level loads
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the encoding is for rotations and the quantity is a velocity or an acceleration, or the device fails.
    pub fn warm(
        &self,
        interpolation: impl Into<Interpolation>,
        encoding: Encoding,
    ) -> Result<(), Error> {
        let interpolation = interpolation.into();
        check_encoding(encoding, interpolation.quantity)?;
        Ok(self.machine.warm(interpolation.form(), encoding)?)
    }

    /// Describes in words how a whole set would be evaluated in f32: whether it is prepared, and in which pieces. All
    /// routes give the same bits. Short for [`request`](Engine::request)`(set, interpolations,
    /// times).`[`layout`](Request::layout)`(layout).`[`explain`](Request::explain)`()`, which also knows encodings and
    /// parts of a set.
    ///
    /// # Errors
    /// As [`Request::size`].
    pub fn explain_route(
        &self,
        set: &TrackSet,
        interpolations: impl Into<PerTrack<Interpolation>>,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<String, Error> {
        self.request(set, interpolations, times)
            .layout(layout)
            .explain()
    }
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("device", &self.device_name())
            .finish_non_exhaustive()
    }
}
