//! Memory for results that a caller allocates once and reuses.

use std::fmt;
use std::ops::{Deref, DerefMut};

use glam::Quat;

use crate::memory::{OutOfMemoryError, refuse_more_than_there_is, zeroed};

/// From this many bytes on, allocators request fresh pages from the system each time and release them afterwards.
#[cfg(target_os = "linux")]
const LONG: usize = 32 << 20;

/// The purpose in [`OutOfMemoryError`].
const LABEL: &str = "a result";

/// Memory for a result, initially zero, for functions that write to the caller's memory, such as
/// [`Engine::evaluate_into`](crate::engine::Engine::evaluate_into). On Linux, buffers of 32 MiB or more use huge
/// pages if the system has them, which halves the time to fill fresh memory.
///
/// ```
/// # use glam::Quat;
/// # use tumble::{Device, Engine, Error, SampleTimes, Layout, OutputBuffer, TrackSet, method};
/// # let mut set = TrackSet::new();
/// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)]).unwrap();
/// # let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
/// let frames = SampleTimes::fps(60);
/// let mut rotations = OutputBuffer::new(clip.track_count() * clip.timeline(&frames)?.len())?;
/// clip.evaluate_into(&frames, Layout::TrackMajor, &mut rotations)?;
/// # assert_eq!(rotations[0], Quat::IDENTITY);
/// # Ok::<(), Error>(())
/// ```
pub struct OutputBuffer(BufferMemory);

enum BufferMemory {
    Heap(Vec<Quat>),
    #[cfg(target_os = "linux")]
    HugePages(memmap2::MmapMut),
}

impl OutputBuffer {
    /// Allocates a buffer for `rotations` rotations.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub fn new(rotations: usize) -> Result<Self, OutOfMemoryError> {
        refuse_more_than_there_is::<Quat>(rotations, LABEL)?;
        #[cfg(target_os = "linux")]
        if let Some(bytes) = rotations.checked_mul(size_of::<Quat>())
            && bytes >= LONG
            && let Ok(memory) = memmap2::MmapMut::map_anon(bytes)
        {
            // If the system does not follow this advice, pages have the ordinary size.
            let _ = memory.advise(memmap2::Advice::HugePage);
            return Ok(Self(BufferMemory::HugePages(memory)));
        }
        Ok(Self(BufferMemory::Heap(zeroed(rotations, LABEL)?)))
    }
}

impl Deref for OutputBuffer {
    type Target = [Quat];

    fn deref(&self) -> &[Quat] {
        match &self.0 {
            BufferMemory::Heap(rotations) => rotations,
            #[cfg(target_os = "linux")]
            BufferMemory::HugePages(bytes) => bytemuck::cast_slice(bytes),
        }
    }
}

impl DerefMut for OutputBuffer {
    fn deref_mut(&mut self) -> &mut [Quat] {
        match &mut self.0 {
            BufferMemory::Heap(rotations) => rotations,
            #[cfg(target_os = "linux")]
            BufferMemory::HugePages(bytes) => bytemuck::cast_slice_mut(bytes),
        }
    }
}

impl fmt::Debug for OutputBuffer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OutputBuffer({} rotations)", self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches buffers of a wrong length and contents that are not zero, below and above 32 MiB.
    #[test]
    fn all_that_was_asked_for_is_there() {
        for rotations in [0, 1, 1000, (32 << 20) / 16 - 1, (32 << 20) / 16 + 1] {
            let mut buffer = OutputBuffer::new(rotations).unwrap();
            assert_eq!(buffer.len(), rotations);
            assert!(buffer.iter().all(|q| q.to_array() == [0.0; 4]));
            buffer.fill(Quat::IDENTITY);
            assert_eq!(
                buffer.last().copied(),
                (rotations > 0).then_some(Quat::IDENTITY)
            );
        }
        for rotations in [
            usize::try_from(1_u64 << 44).unwrap_or(usize::MAX / 4),
            usize::MAX / 16,
            usize::MAX,
        ] {
            let refused = OutputBuffer::new(rotations).unwrap_err();
            assert_eq!(refused.bytes, 16 * rotations as u128);
        }
    }
}
