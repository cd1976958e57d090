//! Which memory of a device serves what: results, and what the host writes for kernels.

use ash::vk;

use crate::gpu::options::Uploads;

const DIRECT: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::from_raw(
    vk::MemoryPropertyFlags::DEVICE_LOCAL.as_raw()
        | vk::MemoryPropertyFlags::HOST_VISIBLE.as_raw()
        | vk::MemoryPropertyFlags::HOST_COHERENT.as_raw(),
);

/// Memory that is made for other purposes, or needs features that are not enabled.
const SPECIAL: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::from_raw(
    vk::MemoryPropertyFlags::PROTECTED.as_raw()
        | vk::MemoryPropertyFlags::LAZILY_ALLOCATED.as_raw()
        | vk::MemoryPropertyFlags::DEVICE_COHERENT_AMD.as_raw()
        | vk::MemoryPropertyFlags::DEVICE_UNCACHED_AMD.as_raw(),
);

/// An upload is small beside a heap of which it is at most this part. Of the old window of 256 MiB
/// that is 4 MiB, which leaves room for those of other programs.
const SMALL: u64 = 64;

/// Memory of the device that the host writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DirectMemory {
    /// Its memory type.
    pub(crate) memory_type: u32,
    /// The largest upload that goes there by itself.
    pub(crate) largest: u64,
}

/// The memory that is the device's and visible to the host, in the largest heap that has such.
/// Where that is also the largest heap of the device, uploads of any size go there.
pub(crate) fn direct(memory: &vk::PhysicalDeviceMemoryProperties) -> Option<DirectMemory> {
    let heaps = memory.memory_heaps_as_slice();
    let size = |own: &vk::MemoryType| heaps.get(own.heap_index as usize).map_or(0, |h| h.size);
    let local = |h: &&vk::MemoryHeap| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
    let all = heaps.iter().filter(local).map(|h| h.size).max()?;
    let types = (0..).zip(memory.memory_types_as_slice());
    let is_direct =
        |flags: vk::MemoryPropertyFlags| flags.contains(DIRECT) && !flags.intersects(SPECIAL);
    let (memory_type, size) = types
        .filter(|(_, own)| is_direct(own.property_flags))
        .map(|(place, own)| (place, size(own)))
        .reduce(|largest, own| if own.1 > largest.1 { own } else { largest })?;
    let largest = if size >= all { u64::MAX } else { size / SMALL };
    Some(DirectMemory {
        memory_type,
        largest,
    })
}

/// Whether there is memory that is the device's own and that the host caches: kernels write there as
/// fast as anywhere, and the host reads it without a copy.
pub(crate) fn is_unified(memory: &vk::PhysicalDeviceMemoryProperties) -> bool {
    let cached = DIRECT | vk::MemoryPropertyFlags::HOST_CACHED;
    let types = memory.memory_types_as_slice().iter();
    let mut flags = types.map(|own| own.property_flags);
    flags.any(|own| own.contains(cached) && !own.intersects(SPECIAL))
}

/// How often kernels read what is uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KernelReads {
    /// About once: a copy beforehand would cost what it saves.
    Once,
    /// Again and again.
    Often,
}

/// Where the host writes what kernels read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// In the host's memory, where kernels read it.
    Host,
    /// In the device's own.
    Direct,
    /// In the host's memory, from where the device copies it into its own.
    Staged,
}

/// The rule that places uploads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placing {
    pub(crate) uploads: Uploads,
    /// Whether results stay where kernels write them, in memory that the host reads.
    pub(crate) in_place: bool,
    pub(crate) direct: Option<DirectMemory>,
}

impl Placing {
    /// Where an upload goes if there is room.
    pub(crate) fn place(&self, bytes: u64, reads: KernelReads) -> Place {
        let fits = match self.uploads {
            Uploads::Staged => return Place::Staged,
            Uploads::Direct => self.direct.is_some(),
            Uploads::Automatic => self.direct.is_some_and(|own| bytes <= own.largest),
        };
        match fits {
            true => Place::Direct,
            false => self.without_direct(reads),
        }
    }

    /// Where it goes if it cannot be written straight into the device's own memory.
    pub(crate) fn without_direct(&self, reads: KernelReads) -> Place {
        match self.in_place || reads == KernelReads::Once {
            true => Place::Host,
            false => Place::Staged,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::cards::card;

    fn of(name: &str) -> Option<(u32, u64)> {
        direct(&card(name).memory).map(|found| (found.memory_type, found.largest))
    }

    /// All of it where a resizable BAR or shared memory makes the host see everything; a 64th of the
    /// old window; nothing where there is none.
    #[test]
    fn each_card_takes_the_uploads_that_its_memory_is_made_for() {
        let everything = u64::MAX;
        let window = (256 << 20) / 64;
        assert_eq!(of("H200"), Some((4, everything)));
        assert_eq!(of("RTX 4060"), Some((4, everything)));
        assert_eq!(
            of("RTX 4060, no resizable BAR"),
            Some((4, window - (10 << 20) / 64))
        );
        assert_eq!(of("RX 7900 XTX, RADV"), Some((2, everything)));
        assert_eq!(of("RX 7900 XTX, no resizable BAR"), Some((2, window)));
        assert_eq!(of("RX 7900 XTX, AMD's driver"), Some((2, everything)));
        assert_eq!(of("Steam Deck"), Some((2, everything)));
        assert_eq!(of("Arc A770, Mesa 24"), Some((1, everything)));
        assert_eq!(of("Apple M2, MoltenVK"), Some((1, everything)));
        assert_eq!(of("lavapipe"), Some((0, everything)));
        assert_eq!(of("SwiftShader"), Some((0, everything)));
        let mut host_alone = card("H200").memory;
        host_alone.memory_type_count = 4;
        assert_eq!(direct(&host_alone), None);
    }

    #[test]
    fn results_stay_where_memory_is_one_and_cached() {
        for (name, unified) in [
            ("H200", false),
            ("RTX 4060", false),
            ("RX 7900 XTX, RADV", false),
            ("Steam Deck", false), // cached memory is not called the device's there
            ("Arc A770, Mesa 24", false),
            ("Apple M2, MoltenVK", true),
            ("lavapipe", true),
            ("SwiftShader", true),
        ] {
            assert_eq!(is_unified(&card(name).memory), unified, "{name}");
        }
    }

    #[test]
    fn every_upload_is_placed_by_its_size() {
        let direct = Some(DirectMemory {
            memory_type: 4,
            largest: 1000,
        });
        let placing = |uploads, in_place, direct| Placing {
            uploads,
            in_place,
            direct,
        };
        let (once, often) = (KernelReads::Once, KernelReads::Often);
        let card = placing(Uploads::Automatic, false, direct);
        assert_eq!(card.place(1000, often), Place::Direct);
        assert_eq!(card.place(1001, often), Place::Staged);
        assert_eq!(card.place(1001, once), Place::Host);
        let shared = placing(Uploads::Automatic, true, direct);
        assert_eq!(shared.place(1000, often), Place::Direct);
        assert_eq!(shared.place(1001, often), Place::Host);
        let forced = placing(Uploads::Direct, false, direct);
        assert_eq!(forced.place(u64::MAX, once), Place::Direct);
        let forced = placing(Uploads::Direct, false, None);
        assert_eq!(forced.place(1, often), Place::Staged);
        for in_place in [false, true] {
            let staged = placing(Uploads::Staged, in_place, direct);
            assert_eq!(staged.place(1, once), Place::Staged);
        }
        assert_eq!(
            placing(Uploads::Automatic, true, None).place(1, often),
            Place::Host
        );
    }
}
