//! The choice of the memory in which the host writes data for kernels.

use ash::vk;

use crate::machine::options::Uploads;

const DIRECT: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::from_raw(
    vk::MemoryPropertyFlags::DEVICE_LOCAL.as_raw()
        | vk::MemoryPropertyFlags::HOST_VISIBLE.as_raw()
        | vk::MemoryPropertyFlags::HOST_COHERENT.as_raw(),
);

/// Memory for other purposes, or that needs features which are not enabled.
const SPECIAL: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::from_raw(
    vk::MemoryPropertyFlags::PROTECTED.as_raw()
        | vk::MemoryPropertyFlags::LAZILY_ALLOCATED.as_raw()
        | vk::MemoryPropertyFlags::DEVICE_COHERENT_AMD.as_raw()
        | vk::MemoryPropertyFlags::DEVICE_UNCACHED_AMD.as_raw(),
);

/// An upload is small if it is at most this fraction of the heap. For the old window of 256 MiB that is 4 MiB, which
/// leaves room for other programs.
const SMALL: u64 = 64;

/// Device-local memory that the host can write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DirectMemory {
    /// The index of the memory type in the device's list.
    pub(crate) memory_type: u32,
    /// The maximum size in bytes of an upload that uses it by default.
    pub(crate) largest: u64,
}

/// Memory that is device-local and host-visible, in the largest heap with such memory. If this is also the device's
/// largest heap, uploads of any size use it.
pub(crate) fn direct(memory: &vk::PhysicalDeviceMemoryProperties) -> Option<DirectMemory> {
    let heaps = memory.memory_heaps_as_slice();
    let size = |memory_type: &vk::MemoryType| {
        heaps
            .get(memory_type.heap_index as usize)
            .map_or(0, |h| h.size)
    };
    let local = |h: &&vk::MemoryHeap| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
    let all = heaps.iter().filter(local).map(|h| h.size).max()?;
    let types = (0..).zip(memory.memory_types_as_slice());
    let is_direct =
        |flags: vk::MemoryPropertyFlags| flags.contains(DIRECT) && !flags.intersects(SPECIAL);
    let (memory_type, size) = types
        .filter(|(_, memory_type)| is_direct(memory_type.property_flags))
        .map(|(index, memory_type)| (index, size(memory_type)))
        .reduce(|largest, next| if next.1 > largest.1 { next } else { largest })?;
    let largest = if size >= all { u64::MAX } else { size / SMALL };
    Some(DirectMemory {
        memory_type,
        largest,
    })
}

/// Whether there is memory that is device-local and cached by the host: kernels write it at full speed, and the host
/// reads it without a copy.
pub(crate) fn is_unified(memory: &vk::PhysicalDeviceMemoryProperties) -> bool {
    let cached = DIRECT | vk::MemoryPropertyFlags::HOST_CACHED;
    let types = memory.memory_types_as_slice().iter();
    let mut flags = types.map(|memory_type| memory_type.property_flags);
    flags.any(|flags| flags.contains(cached) && !flags.intersects(SPECIAL))
}

/// How often kernels read an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KernelReads {
    /// About once: a copy would take as long as it saves.
    Once,
    /// Many times.
    Often,
}

/// The memory of uploads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UploadMemory {
    /// Host memory, which kernels read directly.
    Host,
    /// Device memory, which the host writes.
    Direct,
    /// Host memory, from which the device copies to device memory.
    Staged,
}

/// The rule for the memory of uploads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placing {
    pub(crate) uploads: Uploads,
    /// Whether the host reads results where kernels write them.
    pub(crate) in_place: bool,
    pub(crate) direct: Option<DirectMemory>,
}

impl Placing {
    /// The memory of an upload, if there is room.
    pub(crate) fn memory_for(&self, bytes: u64, reads: KernelReads) -> UploadMemory {
        let fits = match self.uploads {
            Uploads::Staged => return UploadMemory::Staged,
            Uploads::Direct => self.direct.is_some(),
            Uploads::Automatic => self.direct.is_some_and(|direct| bytes <= direct.largest),
        };
        match fits {
            true => UploadMemory::Direct,
            false => self.without_direct(reads),
        }
    }

    /// The memory of an upload that the host cannot write directly to device memory.
    pub(crate) fn without_direct(&self, reads: KernelReads) -> UploadMemory {
        match self.in_place || reads == KernelReads::Once {
            true => UploadMemory::Host,
            false => UploadMemory::Staged,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::physical::cards::card;

    /// With a resizable BAR or shared memory, the host writes uploads of any size directly; without, only up to a 64th
    /// of the window of 256 MiB; with no such memory, none. Results stay in place if the device's memory is the host's
    /// and is cached.
    #[test]
    fn each_card_has_the_memory_that_it_is_made_for() {
        let everything = u64::MAX;
        let window = (256 << 20) / 64;
        let without_bar = window - (10 << 20) / 64;
        for (name, memory_type, largest, unified) in [
            ("H200", 4, everything, false),
            ("RTX 4060", 4, everything, false),
            ("RTX 4060, no resizable BAR", 4, without_bar, false),
            ("RX 7900 XTX, RADV", 2, everything, false),
            ("RX 7900 XTX, no resizable BAR", 2, window, false),
            ("RX 7900 XTX, AMD's driver", 2, everything, false),
            ("Steam Deck", 2, everything, false), // cached memory is not called the device's there
            ("Arc A770, Mesa 24", 1, everything, false),
            ("Apple M2, MoltenVK", 1, everything, true),
            ("lavapipe", 0, everything, true),
            ("SwiftShader", 0, everything, true),
        ] {
            let memory = card(name).memory;
            let found = direct(&memory).map(|found| (found.memory_type, found.largest));
            assert_eq!(found, Some((memory_type, largest)), "{name}");
            assert_eq!(is_unified(&memory), unified, "{name}");
        }
        let mut host_alone = card("H200").memory;
        host_alone.memory_type_count = 4;
        assert_eq!(direct(&host_alone), None);
    }

    #[test]
    fn every_upload_is_placed_by_its_size() {
        use KernelReads::{Often, Once};
        use Uploads::{Automatic, Direct, Staged};
        let some = Some(DirectMemory {
            memory_type: 4,
            largest: 1000,
        });
        for (uploads, in_place, direct, bytes, reads, expected) in [
            (Automatic, false, some, 1000, Often, UploadMemory::Direct),
            (Automatic, false, some, 1001, Often, UploadMemory::Staged),
            (Automatic, false, some, 1001, Once, UploadMemory::Host),
            (Automatic, true, some, 1000, Often, UploadMemory::Direct),
            (Automatic, true, some, 1001, Often, UploadMemory::Host),
            (Automatic, true, None, 1, Often, UploadMemory::Host),
            (Direct, false, some, u64::MAX, Once, UploadMemory::Direct),
            (Direct, false, None, 1, Often, UploadMemory::Staged),
            (Staged, false, some, 1, Once, UploadMemory::Staged),
            (Staged, true, some, 1, Once, UploadMemory::Staged),
        ] {
            let placing = Placing {
                uploads,
                in_place,
                direct,
            };
            let case = (uploads, in_place, bytes);
            assert_eq!(placing.memory_for(bytes, reads), expected, "{case:?}");
        }
    }
}
