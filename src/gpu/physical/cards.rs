//! Queue families and memory of devices for tests, as their drivers report them: from the drivers' source code and
//! from published reports (vulkan.gpuinfo.org), with rounded sizes.

use ash::vk;
use vk::{MemoryPropertyFlags as M, QueueFlags as Q};

/// The properties on which choices depend.
pub(crate) struct Card {
    pub(crate) families: Vec<vk::QueueFamilyProperties>,
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
}

/// Queue families, each with its number of queues.
fn families(all: &[(Q, u32)]) -> Vec<vk::QueueFamilyProperties> {
    let family = |&(flags, count): &(Q, u32)| {
        vk::QueueFamilyProperties::default()
            .queue_flags(flags)
            .queue_count(count)
    };
    all.iter().map(family).collect()
}

/// Heaps in MiB, with whether they are device-local; and memory types, with their heaps.
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

pub(crate) fn card(name: &str) -> Card {
    let draws = Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER | Q::SPARSE_BINDING;
    let computes = Q::COMPUTE | Q::TRANSFER | Q::SPARSE_BINDING;
    let copies = Q::TRANSFER | Q::SPARSE_BINDING;
    let video = Q::TRANSFER | Q::VIDEO_DECODE_KHR;
    let (local, host) = (M::DEVICE_LOCAL, M::HOST_VISIBLE | M::HOST_COHERENT);
    let cached = host | M::HOST_CACHED;
    let nvidia = |bar| {
        let types = [
            (M::empty(), 1),
            (local, 0),
            (host, 1),
            (cached, 1),
            (local | host, bar),
        ];
        types.to_vec()
    };
    let radeon = |[vram, gtt, visible]: [u32; 3]| {
        let coherent = M::DEVICE_COHERENT_AMD | M::DEVICE_UNCACHED_AMD;
        vec![
            (local, vram),
            (host, gtt),
            (local | host, visible),
            (cached, gtt),
            (local | coherent, vram),
            (local | host | coherent, visible),
        ]
    };
    let h200 = [(draws, 16), (copies, 2), (computes, 8), (video, 7)];
    let flow = Q::TRANSFER | Q::OPTICAL_FLOW_NV;
    let geforce = [
        (draws, 16),
        (copies, 2),
        (computes, 8),
        (video, 1),
        (flow, 1),
    ];
    let radv = [(draws, 1), (computes, 4), (Q::VIDEO_DECODE_KHR, 1)];
    let windows = [(draws, 1), (computes, 2), (copies, 2)];
    let arc = [(draws, 1), (computes, 1), (Q::TRANSFER, 1)];
    let plain = [(Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER, 1); 4];
    let (queues, heaps, types): (&[_], &[_], _) = match name {
        "H200" => (&h200, &[(143_771, true), (96_000, false)], nvidia(0)),
        "RTX 4060" => (&geforce, &[(8188, true), (24_000, false)], nvidia(0)),
        "RTX 4060, no resizable BAR" => {
            let heaps = &[(8188, true), (24_000, false), (246, true)];
            (&geforce, heaps, nvidia(2))
        }
        "RX 7900 XTX, RADV" => {
            let heaps = &[(24_560, true), (32_000, false)];
            (&radv, heaps, radeon([0, 1, 0]))
        }
        "RX 7900 XTX, no resizable BAR" => {
            let heaps = &[(24_304, true), (32_000, false), (256, true)];
            (&radv, heaps, radeon([0, 1, 2]))
        }
        "RX 7900 XTX, AMD's driver" => {
            let heaps = &[(24_560, true), (32_000, false)];
            (&windows, heaps, radeon([0, 1, 0]))
        }
        "Steam Deck" => {
            let heaps = &[(5_000, false), (10_000, true)];
            (&radv[..2], heaps, radeon([1, 0, 1]))
        }
        "Arc A770, Mesa 23" | "Arc A770, Mesa 24" => {
            let count = if name.ends_with("24") { 3 } else { 1 };
            let types = vec![(local, 0), (local | host, 0), (cached, 1)];
            (&arc[..count], &[(16_256, true), (32_000, false)], types)
        }
        "Apple M2, MoltenVK" => {
            let lazy = local | M::LAZILY_ALLOCATED;
            let types = vec![(local, 0), (local | cached, 0), (lazy, 0)];
            (&plain, &[(16_384, true)], types)
        }
        "lavapipe" | "SwiftShader" => {
            let types = vec![(local | cached, 0)];
            (&plain[..1], &[(2_048, true)], types)
        }
        _ => panic!("no card is called {name}"),
    };
    Card {
        families: families(queues),
        memory: memory(heaps, &types),
    }
}
