//! Memory of buffers: small buffers share allocations.

use std::ops::Range;
use std::ptr::NonNull;
use std::sync::Mutex;

use ash::vk;

use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::threads::lock;

/// The maximum size of a buffer in a shared allocation in bytes; larger buffers have separate allocations.
const LARGEST: u64 = 512 << 10;
/// The size of a shared allocation in bytes.
const BLOCK: u64 = 4 << 20;

/// The shared allocations (blocks) of a device.
#[derive(Default)]
pub(crate) struct SharedMemory(Mutex<Vec<MemoryBlock>>);

/// The kind of memory for a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MemoryKind {
    pub(crate) memory_type: u32,
    /// Whether the host can access it.
    pub(crate) mapped: bool,
}

/// The memory of one buffer: a part of a block, or a separate allocation.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Share {
    pub(crate) memory: vk::DeviceMemory,
    pub(crate) offset: u64,
    pub(crate) size: u64,
    /// The host's address of the first byte.
    pub(crate) mapped: Option<NonNull<u8>>,
}

struct MemoryBlock {
    kind: MemoryKind,
    whole: Share,
    free: FreeRanges,
}

// SAFETY: the pointer is to mapped memory, which moves between threads together with the block; each range of it belongs
// to exactly one buffer.
unsafe impl Send for MemoryBlock {}

impl SharedMemory {
    pub(crate) fn take(
        &self,
        device: &ash::Device,
        kind: MemoryKind,
        needs: &vk::MemoryRequirements,
    ) -> Result<Share, VulkanError> {
        if needs.size <= LARGEST {
            let mut blocks = lock(&self.0);
            let mut same_kind = blocks.iter_mut().filter(|block| block.kind == kind);
            if let Some(share) = same_kind.find_map(|block| block.share(needs)) {
                return Ok(share);
            }
            match allocate(device, kind, BLOCK) {
                Ok(whole) => {
                    let free = FreeRanges::new(BLOCK);
                    blocks.push(MemoryBlock { kind, whole, free });
                    if let Some(share) = blocks.last_mut().and_then(|block| block.share(needs)) {
                        return Ok(share);
                    }
                }
                Err(error) if error.is_lost() => return Err(error),
                Err(_) => {} // there may be room for the buffer alone
            }
        }
        allocate(device, kind, needs.size)
    }

    /// Takes back the memory of a buffer. An unused block is kept if it is the only one of its kind, so that making
    /// and dropping clips repeatedly allocates nothing.
    ///
    /// # Safety
    /// Nothing may use the memory any more.
    pub(crate) unsafe fn give_back(&self, device: &ash::Device, share: Share) {
        let mut blocks = lock(&self.0);
        let is_origin = |block: &MemoryBlock| block.whole.memory == share.memory;
        let Some(index) = blocks.iter().position(is_origin) else {
            // SAFETY: promised by the caller; null is allowed.
            unsafe { device.free_memory(share.memory, None) };
            return;
        };
        blocks[index]
            .free
            .give(share.offset..share.offset + share.size);
        let kind = blocks[index].kind;
        let is_spare = |block: &&MemoryBlock| block.kind == kind && block.free.is_whole();
        if blocks[index].free.is_whole() && blocks.iter().filter(is_spare).count() > 1 {
            let block = blocks.swap_remove(index);
            // SAFETY: no buffer has a part of it, and the caller promises that no work does.
            unsafe { device.free_memory(block.whole.memory, None) };
        }
    }

    /// Frees all blocks.
    ///
    /// # Safety
    /// Nothing may use the blocks any more.
    pub(crate) unsafe fn free(&self, device: &ash::Device) {
        for block in lock(&self.0).drain(..) {
            // SAFETY: as the caller promises.
            unsafe { device.free_memory(block.whole.memory, None) };
        }
    }
}

impl MemoryBlock {
    fn share(&mut self, needs: &vk::MemoryRequirements) -> Option<Share> {
        let offset = self.free.take(needs.size, needs.alignment)?;
        // SAFETY: the offset lies within the block, which is mapped as a whole.
        let at_offset = |first: NonNull<u8>| unsafe { first.add(offset as usize) };
        Some(Share {
            offset,
            size: needs.size,
            mapped: self.whole.mapped.map(at_offset),
            ..self.whole
        })
    }
}

/// Allocates memory, which stays mapped if the host can access it.
fn allocate(device: &ash::Device, kind: MemoryKind, size: u64) -> Result<Share, VulkanError> {
    let info = vk::MemoryAllocateInfo::default()
        .allocation_size(size)
        .memory_type_index(kind.memory_type);
    // SAFETY: the device is alive, and has this type of memory.
    let memory = unsafe { device.allocate_memory(&info, None) }.named("vkAllocateMemory")?;
    let mut share = Share {
        memory,
        size,
        ..Share::default()
    };
    if kind.mapped {
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: the memory is visible to the host and not mapped yet; it is unmapped when it is freed.
        let mapped = unsafe { device.map_memory(memory, 0, vk::WHOLE_SIZE, flags) };
        let mapped = mapped.named("vkMapMemory").inspect_err(|_| {
            // SAFETY: nothing uses it.
            unsafe { device.free_memory(memory, None) }
        })?;
        share.mapped = NonNull::new(mapped.cast());
    }
    Ok(share)
}

/// The free ranges of a block, in order; no two of them are adjacent.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FreeRanges {
    ranges: Vec<Range<u64>>,
    size: u64,
}

impl FreeRanges {
    fn new(size: u64) -> Self {
        let whole = 0..size;
        Self {
            ranges: vec![whole],
            size,
        }
    }

    fn is_whole(&self) -> bool {
        self.ranges.first() == Some(&(0..self.size))
    }

    /// The first offset at which `size` bytes fit.
    fn take(&mut self, size: u64, alignment: u64) -> Option<u64> {
        let found = self.ranges.iter().enumerate().find_map(|(index, range)| {
            let start = range.start.next_multiple_of(alignment.max(1));
            (start + size <= range.end).then_some((index, start))
        });
        let (index, start) = found?;
        let range = self.ranges[index].clone();
        let rest = [range.start..start, start + size..range.end];
        let rest = rest.into_iter().filter(|rest| !rest.is_empty());
        self.ranges.splice(index..=index, rest);
        Some(start)
    }

    fn give(&mut self, range: Range<u64>) {
        self.ranges.push(range);
        self.ranges.sort_by_key(|range| range.start);
        // Adjacent free ranges are merged.
        self.ranges.dedup_by(|next, merged| {
            let touches = merged.end == next.start;
            if touches {
                merged.end = next.end;
            }
            touches
        });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn parts_never_overlap_and_become_whole_again(
            steps in prop::collection::vec((1u64..400, 0u32..6, 0usize..8), 0..200)
        ) {
            let mut free = FreeRanges::new(4096);
            let mut used_ranges: Vec<Range<u64>> = Vec::new();
            for (size, power, drop) in steps {
                let alignment = 1 << power;
                if drop < 3 && !used_ranges.is_empty() {
                    free.give(used_ranges.swap_remove(drop % used_ranges.len()));
                } else if let Some(start) = free.take(size, alignment) {
                    let range = start..start + size;
                    prop_assert!(start % alignment == 0 && range.end <= 4096);
                    let apart = |other: &Range<u64>| other.end <= range.start || range.end <= other.start;
                    prop_assert!(used_ranges.iter().all(apart), "{range:?} of {used_ranges:?}");
                    used_ranges.push(range);
                }
                let left: u64 = free.ranges.iter().map(|range| range.end - range.start).sum();
                let used: u64 = used_ranges.iter().map(|range| range.end - range.start).sum();
                prop_assert_eq!(left + used, 4096);
                prop_assert!(free.ranges.is_sorted_by(|a, b| a.end < b.start));
            }
            for range in used_ranges {
                free.give(range);
            }
            prop_assert!(free.is_whole());
        }
    }
}
