//! The engine: sets go in, clips stay on its device, rotations come out.

use std::sync::{Arc, Mutex};

use glam::Quat;

use crate::clip::Clip;
use crate::cpu::engine::CpuEngine;
use crate::device::{Device, EngineOptions, Timings, VulkanDevice};
use crate::from_keys::evaluate::straight;
use crate::gpu::engine::{ClipBuffers, EvaluateError};
use crate::gpu::error::VulkanError;
use crate::gpu::physical::DeviceInfo;
use crate::gpu::recovery::Opened;
use crate::gpu::self_test::CanaryReport;
use crate::method::interpolation::{Interpolation, InterpolationError};
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations};
use crate::prepare::clip_data::{ClipData, Wanted};
use crate::simd::dispatch::{UnknownWidth, VectorWidth};
use crate::time::frames::{Frames, FramesError};
use crate::time::wrap::Sides;
use crate::tracks::set::TrackSet;

/// Why an evaluation failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The samples asked for do not fit the set.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// A track cannot be interpolated as asked.
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    /// The Vulkan device could not be used, or stopped working.
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// The output given is not as large as the result.
    #[error("the output has room for {given} rotations; the result has {needed}")]
    OutputLength {
        /// Rotations that it holds.
        given: usize,
        /// Rotations of the result.
        needed: usize,
    },
    /// The memory given for an encoded result is not as large as it.
    #[error("the output has {given} bytes; the result has {needed}")]
    OutputBytes {
        /// Bytes that it holds.
        given: usize,
        /// Bytes of the result.
        needed: usize,
    },
    /// Poses cannot be put together as asked.
    #[error("{0}")]
    Poses(&'static str),
    /// Velocities and accelerations are no rotations, and cannot be stored as such.
    #[error("{encoding:?} stores rotations, not velocities or accelerations; use F32 or Vector")]
    NotRotations {
        /// What was asked for.
        encoding: Encoding,
    },
    /// The environment's `TUMBLE_VECTOR_WIDTH` names no vector width.
    #[error("TUMBLE_VECTOR_WIDTH: {0}")]
    VectorWidth(#[from] UnknownWidth),
    /// The system refused worker threads.
    #[error("worker threads could not be started: {reason}")]
    Threads {
        /// What the system said.
        reason: String,
    },
}

impl From<EvaluateError> for Error {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Vulkan(error) => Self::Vulkan(error),
            EvaluateError::Frames(error) => Self::Frames(error),
        }
    }
}

/// Keys a track of a set that is prepared as a whole, before it is evaluated.
const LONG_TRACK: usize = 16 * 1024;

/// Evaluates sets on one device.
///
/// ```
/// use glam::Quat;
/// use tumble::{Device, Engine, Frames, TrackSet, method};
///
/// let mut set = TrackSet::new();
/// let keys = [0.0, 1.0, 0.5].map(Quat::from_rotation_y);
/// set.push("door", &[0.0, 1.0, 2.5], &keys)?;
///
/// let engine = Engine::new(Device::Cpu)?;
/// let clip = engine.upload(&set, method::BESSEL_OVERHAUSER)?;
/// let rotations = clip.evaluate(&Frames::fps(25))?;
/// assert_eq!((rotations.tracks(), rotations.samples()), (1, 63));
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

pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}

impl Engine {
    /// Opens a device with the default options.
    ///
    /// # Errors
    /// When the device cannot be opened, or fails a canary.
    pub fn new(device: Device) -> Result<Self, Error> {
        Self::with_options(device, &EngineOptions::default())
    }

    /// The first Vulkan device that opens and passes its canaries, else the CPU.
    ///
    /// # Errors
    /// When the system refuses what the CPU needs.
    pub fn first() -> Result<Self, Error> {
        let exact = Device::list()
            .unwrap_or_default()
            .into_iter()
            .find_map(|device| Self::new(device).ok());
        exact.map_or_else(|| Self::new(Device::Cpu), Ok)
    }

    /// Opens a device.
    ///
    /// # Errors
    /// When the device cannot be opened, or fails a canary and
    /// [`EngineOptions::allow_inexact`] is off.
    pub fn with_options(device: Device, options: &EngineOptions) -> Result<Self, Error> {
        VectorWidth::limit()?;
        match device {
            Device::Cpu => {
                let width = options.vector_width.unwrap_or_else(VectorWidth::widest);
                let engine =
                    CpuEngine::new(width, options.threads).map_err(|error| Error::Threads {
                        reason: error.to_string(),
                    })?;
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
        match &*self.backend {
            Backend::Cpu(_) => None,
            Backend::Vulkan(opened) => Some(&opened.info),
        }
    }

    /// How the device did on the canaries; empty on the CPU, which they are
    /// compared with.
    #[must_use]
    pub fn canaries(&self) -> &[CanaryReport] {
        match &*self.backend {
            Backend::Cpu(_) => &[],
            Backend::Vulkan(opened) => &opened.canaries,
        }
    }

    /// What the validation layer has said so far; see [`Device::list_with`].
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        match &*self.backend {
            Backend::Cpu(_) => Vec::new(),
            Backend::Vulkan(opened) => opened.engine().validation_messages(),
        }
    }

    /// Where the time of this engine's evaluations went since this was last asked,
    /// or since it was opened; nothing on the CPU.
    #[must_use]
    pub fn take_timings(&self) -> Timings {
        match &*self.backend {
            Backend::Cpu(_) => Timings::default(),
            Backend::Vulkan(opened) => opened.engine().take_timings(),
        }
    }

    /// Prepares a set for a method and brings it to the device, where it stays.
    ///
    /// # Errors
    /// When a track cannot be interpolated as asked, or the device has not the
    /// memory; [`Engine::evaluate`] works through such a set piece by piece.
    pub fn upload(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
    ) -> Result<Clip, Error> {
        self.upload_wanted(set, interpolation.into(), Wanted::all(set, None), None)
    }

    /// As [`Engine::upload`], what is wanted, into buffers that are no longer needed.
    pub(crate) fn upload_wanted(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        mut wanted: Wanted<'_>,
        spare: Option<ClipBuffers>,
    ) -> Result<Clip, Error> {
        let (data, buffers) = match &*self.backend {
            Backend::Cpu(_) => (ClipData::new(set, interpolation, wanted)?, None),
            Backend::Vulkan(opened) => {
                wanted.group_bytes = Some(opened.engine().group_bytes());
                let data = ClipData::new(set, interpolation, wanted)?;
                let buffers = opened.upload(&data, spare)?;
                (data, Some(Arc::new(buffers)))
            }
        };
        Ok(Clip {
            engine: self.clone(),
            data,
            buffers: Mutex::new(buffers),
        })
    }

    /// Prepares and evaluates in one go, `[track][frame]`. On a Vulkan device a set
    /// larger than its memory (or than [`EngineOptions::memory`]) goes through it
    /// some tracks at a time.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`].
    pub fn evaluate(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
    ) -> Result<Rotations, Error> {
        self.evaluate_as(set, interpolation, frames, Layout::TrackMajor)
    }

    /// As [`Engine::evaluate`], in the given layout.
    ///
    /// # Errors
    /// As [`Engine::upload`] and [`Clip::evaluate`].
    pub fn evaluate_as(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        layout: Layout,
    ) -> Result<Rotations, Error> {
        let interpolation = interpolation.into();
        let tracks = set.track_count();
        let timeline = frames.resolve(tracks, set.time_span())?;
        let samples = timeline.len();
        let on_cpu = matches!(*self.backend, Backend::Cpu(_));
        let by_segments = !(self.is_fused(set, &interpolation, layout)
            || on_cpu && straight(set, &interpolation, &timeline).is_some()
            || self.is_in_stretches(set, &interpolation, &timeline, layout)
            || self
                .key_job(set, 0..tracks, &interpolation, &timeline, layout)
                .is_some());
        if by_segments
            && self
                .pieces(set, 0..tracks, &interpolation, &timeline, layout)
                .len()
                == 1
        {
            let wanted = Wanted {
                only_for: Some(&timeline),
                ..Wanted::all(set, None)
            };
            let clip = self.upload_wanted(set, interpolation, wanted, None)?;
            return clip.evaluate_as(frames, layout);
        }
        let mut quats = OutputBuffer::new(tracks * samples);
        self.evaluate_tracks_into(set, 0..tracks, interpolation, &timeline, layout, &mut quats)?;
        Ok(Rotations::new(Box::new(quats), tracks, samples, layout))
    }

    /// As [`Engine::evaluate_as`], into the caller's memory, which is faster when it
    /// is used again ([`OutputBuffer`]): the first touch of fresh memory costs more than
    /// evaluating.
    ///
    /// # Errors
    /// Also when `output` is not exactly as long as the result.
    pub fn evaluate_into(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let timeline = frames.resolve(set.track_count(), set.time_span())?;
        let tracks = set.track_count();
        let needed = tracks * timeline.len();
        if output.len() != needed {
            let given = output.len();
            return Err(Error::OutputLength { given, needed });
        }
        self.evaluate_tracks_into(
            set,
            0..tracks,
            interpolation.into(),
            &timeline,
            layout,
            output,
        )
    }

    /// Whether preparing and evaluating go hand in hand, track by track: on the CPU,
    /// unless a few long tracks must be shared among the threads.
    pub(crate) fn is_fused(
        &self,
        set: &TrackSet,
        interpolation: &Interpolation,
        layout: Layout,
    ) -> bool {
        let short = set.key_count() <= LONG_TRACK * set.track_count();
        let held = interpolation.sides() == Sides::default();
        let on_cpu = matches!(*self.backend, Backend::Cpu(_));
        on_cpu && layout == Layout::TrackMajor && short && held
    }
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("device", &self.device_name())
            .finish_non_exhaustive()
    }
}
