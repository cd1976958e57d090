//! Queue families and memory of devices, as their drivers report them, for tests: those of drivers'
//! sources and of published reports (vulkan.gpuinfo.org), sizes rounded.

use ash::vk;
use vk::{MemoryPropertyFlags as M, QueueFlags as Q};

/// What a choice is made of.
pub(crate) struct Card {
    pub(crate) families: Vec<vk::QueueFamilyProperties>,
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
}

/// Queue families, each with its number of queues.
fn families(all: &[(Q, u32)]) -> Vec<vk::QueueFamilyProperties> {
    let own = |&(flags, count): &(Q, u32)| {
        vk::QueueFamilyProperties::default()
            .queue_flags(flags)
            .queue_count(count)
    };
    all.iter().map(own).collect()
}

/// Heaps in MiB, with whether they are the device's, and types, with their heaps.
fn memory(heaps: &[(u64, bool)], types: &[(M, u32)]) -> vk::PhysicalDeviceMemoryProperties {
    let mut memory = vk::PhysicalDeviceMemoryProperties::default();
    (memory.memory_heap_count, memory.memory_type_count) = (heaps.len() as u32, types.len() as u32);
    for (to, &(size, is_local)) in memory.memory_heaps.iter_mut().zip(heaps) {
        let flags = match is_local {
            true => vk::MemoryHeapFlags::DEVICE_LOCAL,
            false => vk::MemoryHeapFlags::empty(),
        };
        *to = vk::MemoryHeap {
            size: size << 20,
            flags,
        };
    }
    for (to, &(property_flags, heap_index)) in memory.memory_types.iter_mut().zip(types) {
        *to = vk::MemoryType {
            property_flags,
            heap_index,
        };
    }
    memory
}

/// A card by its name here.
pub(crate) fn card(name: &str) -> Card {
    let draws = Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER | Q::SPARSE_BINDING;
    let computes = Q::COMPUTE | Q::TRANSFER | Q::SPARSE_BINDING;
    let copies = Q::TRANSFER | Q::SPARSE_BINDING;
    let video = Q::TRANSFER | Q::VIDEO_DECODE_KHR;
    let (none, local) = (M::empty(), M::DEVICE_LOCAL);
    let host = M::HOST_VISIBLE | M::HOST_COHERENT;
    let cached = host | M::HOST_CACHED;
    let nvidia = |heaps: &[(u64, bool)], bar| {
        let types = [
            (none, 1),
            (local, 0),
            (host, 1),
            (cached, 1),
            (local | host, bar),
        ];
        memory(heaps, &types)
    };
    let geforce = [
        (draws, 16),
        (copies, 2),
        (computes, 8),
        (video, 1),
        (Q::TRANSFER | Q::OPTICAL_FLOW_NV, 1),
    ];
    let radeon = |heaps: &[(u64, bool)], [vram, gtt, visible]: [u32; 3]| {
        let coherent = M::DEVICE_COHERENT_AMD | M::DEVICE_UNCACHED_AMD;
        let types = [
            (local, vram),
            (host, gtt),
            (local | host, visible),
            (cached, gtt),
            (local | coherent, vram),
            (local | host | coherent, visible),
        ];
        memory(heaps, &types)
    };
    let radv = [(draws, 1), (computes, 4), (Q::VIDEO_DECODE_KHR, 1)];
    let (families_of, memory) = match name {
        "H200" => {
            let all = [(draws, 16), (copies, 2), (computes, 8), (video, 7)];
            (
                families(&all),
                nvidia(&[(143_771, true), (96_000, false)], 0),
            )
        }
        "RTX 4060" => {
            let heaps = [(8188, true), (24_000, false)];
            (families(&geforce), nvidia(&heaps, 0))
        }
        "RTX 4060, no resizable BAR" => {
            let heaps = [(8188, true), (24_000, false), (246, true)];
            (families(&geforce), nvidia(&heaps, 2))
        }
        "RX 7900 XTX, RADV" => {
            let heaps = [(24_560, true), (32_000, false)];
            (families(&radv), radeon(&heaps, [0, 1, 0]))
        }
        "RX 7900 XTX, no resizable BAR" => {
            let heaps = [(24_304, true), (32_000, false), (256, true)];
            (families(&radv), radeon(&heaps, [0, 1, 2]))
        }
        "RX 7900 XTX, AMD's driver" => {
            let all = [(draws, 1), (computes, 2), (copies, 2)];
            let heaps = [(24_560, true), (32_000, false)];
            (families(&all), radeon(&heaps, [0, 1, 0]))
        }
        "Steam Deck" => {
            let heaps = [(5_000, false), (10_000, true)];
            (families(&radv[..2]), radeon(&heaps, [1, 0, 1]))
        }
        "Arc A770, Mesa 23" | "Arc A770, Mesa 24" => {
            let all = [(draws, 1), (computes, 1), (Q::TRANSFER, 1)];
            let count = if name.ends_with("24") { 3 } else { 1 };
            let types = [(local, 0), (local | host, 0), (cached, 1)];
            let memory = memory(&[(16_256, true), (32_000, false)], &types);
            (families(&all[..count]), memory)
        }
        "Apple M2, MoltenVK" => {
            let plain = Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER;
            let types = [
                (local, 0),
                (local | cached, 0),
                (local | M::LAZILY_ALLOCATED, 0),
            ];
            (
                families(&[(plain, 1); 4]),
                memory(&[(16_384, true)], &types),
            )
        }
        "lavapipe" | "SwiftShader" => {
            let plain = Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER;
            let types = [(local | cached, 0)];
            (families(&[(plain, 1)]), memory(&[(2_048, true)], &types))
        }
        _ => panic!("no card is called {name}"),
    };
    Card {
        families: families_of,
        memory,
    }
}
