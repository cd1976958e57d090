//! The clips of a motion library on a Vulkan device.

use std::fmt;
use std::ops::Range;

use crate::crowd::states::{FrameStep, MotionTables, check_clips, check_steps};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::gpu::external::ExportedResult;
use crate::gpu::motion::{
    MappedStates, MotionSource, ResidentMotions, StateSteps, StatesRequest, TreeSource,
};
use crate::machine::error::EvaluateError;
use crate::output::encoding::Encoding;
use crate::output::states::{StateArray, StoredArray};
use crate::shader::MotionSample;

/// The clips of [`MotionTables`] in the memory of a Vulkan device, which computes states of them. The states have the
/// bits that [`MotionTables::sample_into`] and [`MotionTables::differences_into`] compute on the CPU, and stay in
/// memory of the device. The host uploads 8 bytes for each instance.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::crowd::{DeviceMotions, KeyPrecision, MotionBuilder, StateArray};
/// use tumble::{Device, Encoding, Engine, Skeleton, TrackSet, VectorMethod, method};
/// let mut door = TrackSet::new();
/// door.push("door", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
/// let skeleton = Skeleton::new(vec![None], vec![Vec3::X])?;
/// let mut builder = MotionBuilder::new(&skeleton, 705_600, KeyPrecision::Exact)?;
/// builder.push(&door, method::SLERP, VectorMethod::Linear)?;
/// let (tables, spans, cells) = builder.finish();
///
/// for device in Device::list()? {
///     let motions = DeviceMotions::new(&Engine::new(device)?, &tables, (&spans, &cells))?;
///     let arrays = [StateArray::AngularVelocities, StateArray::Rotations];
///     let (states, ranges) = motions.sample(&[(0, 705_600)], None, &arrays, Encoding::SixD)?;
///     let numbers = |array: usize| tumble::bytemuck::cast_slice::<u8, f32>(&states.bytes()[ranges[array].clone()]);
///     assert!((numbers(0)[1] - 0.5).abs() < 1e-6);
///     assert!((numbers(1)[0] - 0.5_f32.cos()).abs() < 1e-6);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DeviceMotions {
    resident: ResidentMotions,
    clips: usize,
}

impl DeviceMotions {
    /// Copies tables to the engine's device. The spans and cells are those that belong to the tables.
    ///
    /// # Errors
    /// * When the engine is the CPU.
    /// * When the spans and cells do not belong to the tables.
    /// * When the tables need more memory than the device or the engine's memory budget has, or more than kernels can
    ///   bind.
    /// * When the device fails.
    pub fn new(
        engine: &Engine,
        tables: &MotionTables,
        parts: (&[[u32; 4]], &[[f32; 4]]),
    ) -> Result<Self, CrowdError> {
        Ok(Self {
            resident: resident(engine, tables, parts, None)?,
            clips: tables.clip_count(),
        })
    }

    /// Bytes of the tables in the device's memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.resident.bytes()
    }

    /// Computes states into memory that the host can read. On a device that shares the host's memory, the kernels write
    /// directly into this memory; from other devices the result is copied.
    ///
    /// `at` has a clip and a tick for each instance, as for [`MotionTables::sample_into`]; with `steps`, velocities are
    /// differences, as for [`MotionTables::differences_into`]. `rotations` is the encoding of both arrays of rotations:
    /// [`Encoding::F32`], [`Encoding::Matrix3x3`] or [`Encoding::SixD`]. Also returned are the ranges of the arrays in the
    /// memory, in bytes; each array is `[instance][joint][number]`, f32.
    ///
    /// # Errors
    /// When a clip does not exist, there are more or fewer steps than instances, the encoding is another one, there is not
    /// enough memory, the device fails, or the work is stopped.
    pub fn sample(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        arrays: &[StateArray],
        rotations: Encoding,
    ) -> Result<(MappedStates, Vec<Range<usize>>), CrowdError> {
        let stored = self.stored(arrays, rotations)?;
        let work = |request: &StatesRequest<'_>| self.resident.evaluate(request);
        let (states, ranges) = with_request(self.clips, (at, steps), &stored, work)?;
        Ok((states, ranges.into_iter().map(in_memory).collect()))
    }

    /// As [`DeviceMotions::sample`], into memory of the device that other interfaces on the same card, such as CUDA,
    /// can import. If the other interface can wait for the device, this function returns while the device is still
    /// writing.
    ///
    /// # Errors
    /// As [`DeviceMotions::sample`], and when the device cannot export memory.
    pub fn export(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        arrays: &[StateArray],
        rotations: Encoding,
    ) -> Result<(ExportedResult, Vec<Range<usize>>), CrowdError> {
        let stored = self.stored(arrays, rotations)?;
        let work = |request: &StatesRequest<'_>| self.resident.export(request);
        let (states, ranges) = with_request(self.clips, (at, steps), &stored, work)?;
        Ok((states, ranges.into_iter().map(in_memory).collect()))
    }

    fn stored(
        &self,
        arrays: &[StateArray],
        rotations: Encoding,
    ) -> Result<Vec<StoredArray>, CrowdError> {
        if !matches!(
            rotations,
            Encoding::F32 | Encoding::Matrix3x3(_) | Encoding::SixD
        ) {
            return Err(CrowdError::StateEncoding {
                encoding: rotations,
            });
        }
        let joints = self.resident.joints();
        let stored = |array: &StateArray| array.stored(joints, rotations);
        Ok(arrays.iter().map(stored).collect())
    }
}

/// Copies tables to the engine's device.
pub(super) fn resident(
    engine: &Engine,
    tables: &MotionTables,
    (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
    tree: Option<TreeSource<'_>>,
) -> Result<ResidentMotions, CrowdError> {
    tables.check_parts((spans, cells))?;
    let opened = engine.opened().ok_or(CrowdError::OnCpu)?;
    let source = MotionSource {
        clips: &tables.clips,
        bases: &tables.bases,
        spans: bytemuck::cast_slice(spans),
        channels: &tables.channels,
        cells,
        links: &tables.links,
        joints: tables.joint_count() as u32,
        ticks_per_second: tables.ticks_per_second(),
        tree,
    };
    Ok(ResidentMotions::new(opened.engine(), &source)?)
}

/// Runs work on the instances of a call; there are `clips` clips.
pub(super) fn with_request<T>(
    clips: usize,
    (at, steps): (&[(u32, u32)], Option<&[FrameStep]>),
    arrays: &[StoredArray],
    work: impl FnOnce(&StatesRequest<'_>) -> Result<T, EvaluateError>,
) -> Result<T, CrowdError> {
    check_clips(clips, at)?;
    let sample = |&(clip, tick): &(u32, u32)| MotionSample { clip, tick };
    let samples: Vec<MotionSample> = at.iter().map(sample).collect();
    let steps = match steps {
        None => None,
        Some(steps) => {
            check_steps(steps.len(), at.len())?;
            let ends = [0, 1].map(|end: usize| {
                let sample = |(step, &(clip, _)): (&FrameStep, &(u32, u32))| MotionSample {
                    clip,
                    tick: step.ticks[end],
                };
                steps.iter().zip(at).map(sample).collect()
            });
            let rates = steps.iter().map(|step| step.per_second).collect();
            Some(StateSteps { ends, rates })
        }
    };
    let request = StatesRequest {
        at: &samples,
        steps,
        arrays,
    };
    work(&request).map_err(|error| match error {
        EvaluateError::Vulkan(error) | EvaluateError::NoRoom(error) => error.into(),
        EvaluateError::Set(error) => error.into(),
    })
}

/// A range of memory that exists.
pub(super) fn in_memory(range: Range<u64>) -> Range<usize> {
    range.start as usize..range.end as usize
}

impl fmt::Debug for DeviceMotions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeviceMotions")
            .field("device", &self.resident.device_name())
            .field("clips", &self.clips)
            .field("bytes", &self.bytes())
            .finish_non_exhaustive()
    }
}
