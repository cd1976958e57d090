//! Cache lines: the unit of streaming stores, which go past the caches, and of requests for memory.

use bytemuck::{Pod, Zeroable};

/// Four rotations, a cache line of most processors.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(C, align(64))]
pub(crate) struct CacheLine(pub(crate) [[f32; 4]; EACH]);

/// Number of rotations in a line.
pub(crate) const EACH: usize = 4;

/// Requests memory that is read soon, so that its way to the caches overlaps with other work. Other processors than x86-64
/// fetch it when it is read.
#[inline(always)]
pub(crate) fn request<T>(memory: &[T]) {
    // Miri knows no prefetches.
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let each = (size_of::<CacheLine>() / size_of::<T>().max(1)).max(1);
        let lines = memory.chunks(each).map(<[T]>::as_ptr);
        // The last element may be in a further line, because the first need not begin one.
        let last = memory.last().map(std::ptr::from_ref);
        for line in lines.chain(last) {
            // SAFETY: a prefetch reads and writes nothing that the program can observe, whatever the address is.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(line.cast()) };
        }
    }
    #[cfg(any(not(target_arch = "x86_64"), miri))]
    let _ = memory;
}
