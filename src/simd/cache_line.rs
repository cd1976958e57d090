//! Cache lines, the unit of streaming stores, which go past the caches.

use bytemuck::{Pod, Zeroable};

/// Four rotations, a cache line of most processors.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(C, align(64))]
pub(crate) struct CacheLine(pub(crate) [[f32; 4]; EACH]);

/// Number of rotations in a line.
pub(crate) const EACH: usize = 4;
