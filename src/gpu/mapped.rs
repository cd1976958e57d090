//! Results that stay where the device wrote them.

use std::sync::{Arc, Mutex};

use glam::Quat;

use crate::gpu::buffer::Buffer;
use crate::gpu::engine::lock;
use crate::output::rotations::Storage;

/// Output buffers of dropped results, to use again: the first touch of fresh memory costs more
/// than evaluating.
pub(crate) type FreeBuffers = Arc<Mutex<Vec<Buffer>>>;

/// A result in mapped memory. When it is dropped, the buffer goes back to its engine.
pub(crate) struct MappedQuats {
    /// There until it is dropped.
    pub(crate) buffer: Option<Buffer>,
    pub(crate) count: usize,
    pub(crate) free: FreeBuffers,
}

impl Storage for MappedQuats {
    fn quats(&self) -> &[Quat] {
        let all = 0..self.count * size_of::<Quat>();
        let bytes = self.buffer.as_ref().map(|buffer| buffer.bytes(all));
        bytemuck::cast_slice(bytes.unwrap_or_default())
    }
}

/// The most output buffers that are kept for later evaluations.
const KEPT: usize = 4;

impl Drop for MappedQuats {
    fn drop(&mut self) {
        let mut free = lock(&self.free);
        if free.len() == KEPT {
            free.remove(0);
        }
        free.extend(self.buffer.take());
    }
}
