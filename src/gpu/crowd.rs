//! A crowd on a Vulkan device: its tables, which stay there.

use std::sync::Arc;

use bytemuck::NoUninit;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::physical::DeviceKind;
use crate::gpu::submission::Binding;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{CrowdDispatch, CrowdEntry, CrowdPlace, Kernel, MOST_WALKED};

/// The fewest instances of a window: so many that windows start at multiples of 256 bytes.
const LEAST_WINDOW: u64 = 32;

/// Bytes of a window's matrices on a software device.
const SOFTWARE_WINDOW: u64 = 8 << 20;

/// Bytes of a matrix.
const MATRIX: u64 = 48;

/// The sizes of a crowd, and what its kernels read of its library ([`VulkanEngine::crowd_table`]).
pub(crate) struct CrowdTables {
    pub(crate) instances: u32,
    /// Where each level of the skeleton below the roots starts among the links, and their end.
    pub(crate) levels: Vec<u32>,
    /// Whether all rotations are arcs or constants.
    pub(crate) only_arcs: bool,
    /// What all dispatches are told.
    pub(crate) arguments: CrowdDispatch,
    pub(crate) clips: Buffer,
    pub(crate) bases: Buffer,
    pub(crate) spans: Buffer,
    pub(crate) channels: Buffer,
    pub(crate) cells: Buffer,
    pub(crate) links: Buffer,
    /// The rows of inverse bind matrices; empty where there are none.
    pub(crate) bind: Buffer,
}

/// A crowd's buffers on a device.
pub(crate) struct DeviceCrowd {
    pub(crate) engine: Arc<VulkanEngine>,
    pub(crate) tables: CrowdTables,
    /// `[instance][layer]`
    pub(crate) entries: Buffer,
}

impl VulkanEngine {
    /// Copies a table of a crowd's library to the device.
    pub(crate) fn crowd_table<T: NoUninit>(
        &self,
        name: &str,
        table: &[T],
    ) -> Result<Buffer, VulkanError> {
        let bytes: &[u8] = bytemuck::cast_slice(table);
        self.check_size("a crowd's library", bytes)?;
        self.resident(name, bytes, &mut Vec::new())
    }
}

impl DeviceCrowd {
    pub(crate) fn new(engine: Arc<VulkanEngine>, tables: CrowdTables) -> Result<Self, VulkanError> {
        let device = &engine.device;
        let own = &tables.arguments;
        let entries = u64::from(tables.instances) * u64::from(own.layers);
        let entries = entries * size_of::<CrowdEntry>() as u64;
        let poses = LEAST_WINDOW * MATRIX * u64::from(own.joints);
        let physical = &device.physical;
        physical.check_range("a crowd's instances", entries)?;
        physical.check_range("a window of a crowd's poses", poses)?;
        Ok(Self {
            entries: Buffer::new(device, "tumble crowd entries", entries, Residence::Device)?,
            engine,
            tables,
        })
    }

    pub(crate) fn bytes(&self, output: CrowdOutput) -> u64 {
        let joints = u64::from(self.tables.instances) * u64::from(self.tables.arguments.joints);
        joints * output.bytes() as u64
    }

    /// Bytes of the places where the layers of an instance stand.
    pub(crate) fn place_bytes(&self) -> u64 {
        let own = &self.tables.arguments;
        size_of::<CrowdPlace>() as u64 * u64::from(own.layers) * u64::from(own.bases)
    }

    /// Instances that are evaluated at once: as many as their results fit the device's limits, and the
    /// memory budget.
    pub(crate) fn window(&self) -> u32 {
        let own = &self.tables.arguments;
        let info = &self.engine.device.physical.info;
        let bytes = self.place_bytes().max(MATRIX * u64::from(own.joints));
        let range = info
            .max_storage_buffer_range
            .min(info.max_memory_allocation_size);
        let budget = self.engine.clip_bytes.map_or(range, |bytes| bytes as u64);
        let mut range = range.min(budget);
        if info.kind == DeviceKind::Cpu {
            // Every kernel goes over a window while it is in the processor's cache.
            range = range.min(SOFTWARE_WINDOW);
        }
        // Vectors are counted in 32 bits.
        let most = (range / bytes).min(u64::from(u32::MAX / 4) / (bytes / 8));
        let all = u64::from(self.tables.instances).next_multiple_of(LEAST_WINDOW);
        (most / LEAST_WINDOW * LEAST_WINDOW).clamp(LEAST_WINDOW, all) as u32
    }

    /// The kernels that run for a result, one after another.
    pub(crate) fn kernels(&self, output: CrowdOutput) -> Vec<Kernel> {
        use CrowdValues::{Model, Rotations, Skinning};
        let is_plain = self.tables.arguments.layers == 1 && self.tables.only_arcs;
        let joints = match (output.values, is_plain) {
            (Rotations, true) => Kernel::CrowdPlainRotations,
            (Rotations, false) => Kernel::CrowdRotations,
            (_, true) => Kernel::CrowdPlainLocals,
            (_, false) => Kernel::CrowdLocals,
        };
        let mut kernels = vec![Kernel::CrowdTimes, joints];
        // Software devices run a workgroup's invocations one after another, and stop at each barrier.
        let fits = self.tables.arguments.joints <= MOST_WALKED;
        let walk = match self.engine.maps_samples && fits {
            true => Kernel::CrowdWalkAll,
            false => Kernel::CrowdWalk,
        };
        let walks = matches!(output.values, Model | Skinning);
        kernels.extend(walks.then_some(walk));
        kernels.extend((output.values == Skinning).then_some(Kernel::CrowdSkin));
        kernels.extend(output.is_half.then_some(Kernel::CrowdHalf));
        kernels
    }

    /// The buffers that a kernel binds: `places` tells where each layer of a window's instances stands,
    /// `values` are in 32 bits, and `output` is what is left of them.
    pub(crate) fn bindings(
        &self,
        kernel: Kernel,
        [places, values, output]: [Binding; 3],
    ) -> Vec<Binding> {
        let (own, whole) = (&self.tables, Binding::whole);
        let entries = whole(&self.entries);
        match kernel {
            Kernel::CrowdTimes => {
                let [clips, bases, spans] = [&own.clips, &own.bases, &own.spans].map(whole);
                vec![entries, clips, bases, spans, places]
            }
            Kernel::CrowdWalk | Kernel::CrowdWalkAll => vec![whole(&own.links), values],
            Kernel::CrowdSkin => vec![whole(&own.bind), values],
            Kernel::CrowdHalf => vec![values, output],
            _ => {
                let (channels, cells) = (whole(&own.channels), whole(&own.cells));
                vec![entries, channels, cells, places, values]
            }
        }
    }
}
