//! The clips of a robot on a Vulkan device.

use std::fmt;
use std::ops::Range;

use crate::crowd::body_states::BodyTables;
use crate::crowd::device_motions::{in_memory, resident, with_request};
use crate::crowd::states::FrameStep;
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::gpu::external::ExportedResult;
use crate::gpu::motion::{MappedStates, ResidentMotions, StatesRequest, TreeSource};
use crate::output::states::{BodyArray, StoredArray, StoredNumbers};
use crate::pose::tree::TreeFrames;
use crate::shader::{
    ANGULAR_VELOCITY, POSITION, STATE_VECTORS, VECTOR_WORDS, VELOCITY, WORLD_ROTATION,
};

/// The clips of [`BodyTables`] in the memory of a Vulkan device, which computes the joints and bodies of a robot. They have
/// the bits that [`BodyTables::sample_into`] computes on the CPU, and stay in memory of the device. The host uploads 8 bytes
/// for each instance.
///
/// ```
/// use tumble::crowd::{BodyArray, BodyTables, DeviceBodies};
/// use tumble::{Device, Engine};
///
/// /// The positions of all bodies one second after the start of a robot's first clip.
/// fn bodies(tables: &BodyTables, parts: (&[[u32; 4]], &[[f32; 4]])) -> Result<(), Box<dyn std::error::Error>> {
///     let second = tables.tables().ticks_per_second();
///     for device in Device::list()? {
///         let robot = DeviceBodies::new(&Engine::new(device)?, tables, parts)?;
///         let (states, ranges) = robot.sample(&[(0, second)], None, &[BodyArray::Positions])?;
///         let positions: &[[f32; 3]] = tumble::bytemuck::cast_slice(&states.bytes()[ranges[0].clone()]);
///         println!("{positions:?}");
///     }
///     Ok(())
/// }
/// ```
pub struct DeviceBodies {
    resident: ResidentMotions,
    clips: usize,
    frames: TreeFrames,
}

impl DeviceBodies {
    /// Copies tables to the engine's device. The spans and cells are those that belong to the tables.
    ///
    /// # Errors
    /// As [`DeviceMotions::new`](crate::crowd::DeviceMotions::new).
    pub fn new(
        engine: &Engine,
        tables: &BodyTables,
        parts: (&[[u32; 4]], &[[f32; 4]]),
    ) -> Result<Self, CrowdError> {
        let frames = tables.frames();
        let tree = TreeSource {
            frames: &frames.frames,
            picks: &BodyArray::ALL.map(|array| picks(array, frames)).concat(),
        };
        Ok(Self {
            resident: resident(engine, tables.tables(), parts, Some(tree))?,
            clips: tables.tables().clip_count(),
            frames: frames.clone(),
        })
    }

    /// Bytes of the tables in the device's memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.resident.bytes()
    }

    /// Computes states into memory that the host can read, as
    /// [`DeviceMotions::sample`](crate::crowd::DeviceMotions::sample). Also returned are the ranges of the arrays in the
    /// memory, in bytes; each array is `[instance][joint]` or `[instance][body][number]`, f32.
    ///
    /// # Errors
    /// When a clip does not exist, there are more or fewer steps than instances, there is not enough memory, the device
    /// fails, or the work is stopped.
    pub fn sample(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        arrays: &[BodyArray],
    ) -> Result<(MappedStates, Vec<Range<usize>>), CrowdError> {
        let work = |request: &StatesRequest<'_>| self.resident.evaluate(request);
        let (states, ranges) = with_request(self.clips, (at, steps), &self.stored(arrays), work)?;
        Ok((states, ranges.into_iter().map(in_memory).collect()))
    }

    /// As [`DeviceBodies::sample`], into memory of the device that other interfaces on the same card, such as CUDA, can
    /// import. If the other interface can wait for the device, this function returns while the device is still writing.
    ///
    /// # Errors
    /// As [`DeviceBodies::sample`], and when the device cannot export memory.
    pub fn export(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        arrays: &[BodyArray],
    ) -> Result<(ExportedResult, Vec<Range<usize>>), CrowdError> {
        let work = |request: &StatesRequest<'_>| self.resident.export(request);
        let (states, ranges) = with_request(self.clips, (at, steps), &self.stored(arrays), work)?;
        Ok((states, ranges.into_iter().map(in_memory).collect()))
    }

    fn stored(&self, arrays: &[BodyArray]) -> Vec<StoredArray> {
        let stored = |&array: &BodyArray| stored(array, &self.frames);
        arrays.iter().map(stored).collect()
    }
}

impl fmt::Debug for DeviceBodies {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeviceBodies")
            .field("device", &self.resident.device_name())
            .field("clips", &self.clips)
            .field("bytes", &self.bytes())
            .finish_non_exhaustive()
    }
}

/// The 32-bit words of an instance's states of which an array consists, by their indices.
fn picks(array: BodyArray, frames: &TreeFrames) -> Vec<u32> {
    let state = STATE_VECTORS * VECTOR_WORDS;
    let vectors = |list: &[u32], vector: u32, components: &[u32]| {
        let of = |frame: &u32| {
            let first = frame * state + vector * VECTOR_WORDS;
            components.iter().map(move |component| first + component)
        };
        list.iter().flat_map(of).collect()
    };
    match array {
        BodyArray::JointValues => frames.scalars.clone(),
        BodyArray::JointRates => {
            let to_rate = (VELOCITY - POSITION) * VECTOR_WORDS;
            frames.scalars.iter().map(|word| word + to_rate).collect()
        }
        BodyArray::Positions => vectors(&frames.bodies, POSITION, &[0, 1, 2]),
        BodyArray::Rotations if frames.is_w_first => {
            vectors(&frames.bodies, WORLD_ROTATION, &[3, 0, 1, 2])
        }
        BodyArray::Rotations => vectors(&frames.bodies, WORLD_ROTATION, &[0, 1, 2, 3]),
        BodyArray::Velocities => vectors(&frames.points, VELOCITY, &[0, 1, 2]),
        BodyArray::AngularVelocities => vectors(&frames.bodies, ANGULAR_VELOCITY, &[0, 1, 2]),
    }
}

/// The numbers that a kernel stores of an instance. Their words are those of [`picks`], array after array.
fn stored(array: BodyArray, frames: &TreeFrames) -> StoredArray {
    let count = |array: BodyArray| {
        let each = match array.is_of_joints() {
            true => frames.scalars.len(),
            false => frames.bodies.len(),
        };
        (each * array.numbers()) as u32
    };
    let before = BodyArray::ALL.iter().take_while(|&&other| other != array);
    StoredArray {
        numbers: count(array),
        from: StoredNumbers::Picked {
            first: before.map(|&array| count(array)).sum(),
            of_frames: !array.is_of_joints(),
        },
        needs_walk: !array.is_of_joints(),
        needs_velocities: matches!(
            array,
            BodyArray::JointRates | BodyArray::Velocities | BodyArray::AngularVelocities
        ),
    }
}
