//! A Vulkan buffer with its memory, mapped for the host, imported or exported.

use std::ops::Range;
use std::ptr::NonNull;
use std::sync::Arc;

use ash::vk;

use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::physical::external::{FILE, HOST_ALLOCATION, usage};
use crate::gpu::shared_memory::{MemoryKind, Share};
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::shader::PolynomialSegment;

/// The memory of a buffer, by its users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Residence {
    /// The host writes, the device reads.
    Upload,
    /// As `Upload`, in device memory. The host must write in order, and must not read.
    Direct,
    /// Copies write, the host reads.
    Readback,
    /// Kernels write, the host reads.
    InPlace,
    /// Only the device uses it; copies write.
    Device,
    /// Kernels write, and copies read, possibly on another queue.
    Results,
}

impl Residence {
    /// The required and the preferred properties of the memory, the best ones first.
    fn properties(self) -> (vk::MemoryPropertyFlags, &'static [vk::MemoryPropertyFlags]) {
        use vk::MemoryPropertyFlags as Flags;
        const fn all(flags: &[Flags]) -> Flags {
            let (mut all, mut i) = (0, 0);
            while i < flags.len() {
                all |= flags[i].as_raw();
                i += 1;
            }
            Flags::from_raw(all)
        }
        /// Reading uncached memory is dozens of times slower on the host. Therefore cached memory is used even if it
        /// is not coherent (Adreno, older Mali).
        const CACHED: &[Flags] = &[
            all(&[Flags::HOST_COHERENT, Flags::HOST_CACHED]),
            Flags::HOST_CACHED,
            Flags::HOST_COHERENT,
        ];
        /// Device-local memory too, if the host and the device share memory.
        const UNIFIED: &[Flags] = &[
            all(&[
                Flags::HOST_COHERENT,
                Flags::HOST_CACHED,
                Flags::DEVICE_LOCAL,
            ]),
            all(&[Flags::HOST_COHERENT, Flags::HOST_CACHED]),
            all(&[Flags::HOST_CACHED, Flags::DEVICE_LOCAL]),
            Flags::HOST_CACHED,
            Flags::HOST_COHERENT,
        ];
        let written = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        match self {
            Self::Upload => (written, &[]),
            Self::Direct => (written | Flags::DEVICE_LOCAL, &[]),
            Self::Readback => (Flags::HOST_VISIBLE, CACHED),
            Self::InPlace => (Flags::HOST_VISIBLE, UNIFIED),
            Self::Device | Self::Results => (Flags::DEVICE_LOCAL, &[]),
        }
    }
}

/// A storage buffer. If the host uses it, it is mapped during its whole life.
pub(crate) struct Buffer {
    pub(crate) device: Arc<LogicalDevice>,
    pub(crate) raw: vk::Buffer,
    /// A view of the buffer as texels of 16 bytes; null unless kernels read it as a texel buffer.
    pub(crate) view: vk::BufferView,
    memory: Share,
    /// Whether the host must invalidate before reading and flush after writing.
    is_incoherent: bool,
    /// Bytes.
    pub(crate) size: u64,
}

// SAFETY: the pointer is to memory that belongs to the buffer alone; access goes
// through `&self` for reading and `&mut self` for writing.
unsafe impl Send for Buffer {}
// SAFETY: the memory belongs to the buffer alone, and `&self` only reads it.
unsafe impl Sync for Buffer {}

/// The size of the largest element that a kernel reads.
const LEAST: u64 = size_of::<PolynomialSegment>() as u64;

impl Buffer {
    /// Makes a buffer of at least `size` bytes. Even an empty one has room for one element of any kind, because
    /// kernels may read element 0 of a list before they select another.
    pub(crate) fn new(
        device: &Arc<LogicalDevice>,
        name: &str,
        size: u64,
        residence: Residence,
    ) -> Result<Self, VulkanError> {
        let size = size.max(LEAST).next_multiple_of(16);
        let is_read = matches!(
            residence,
            Residence::Upload | Residence::Direct | Residence::Device
        );
        let is_texels = device.reads_texels && is_read;
        // A buffer that is copied on another queue is shared by both families, so that its ownership need not be
        // transferred.
        let is_copied = matches!(residence, Residence::Results | Residence::Readback);
        let families = [QueueLane::Kernels, QueueLane::Copies].map(|lane| device.family(lane));
        let families = (is_copied && families[0] != families[1]).then_some(families);
        let made = Self::without_memory(device, size, is_texels, families, None)?;
        let (mut buffer, mut needs) = made;
        let (required, preferred) = residence.properties();
        let allowed = match (residence, device.placing.direct) {
            (Residence::Direct, Some(direct)) => needs.memory_type_bits & 1 << direct.memory_type,
            _ => needs.memory_type_bits,
        };
        let (physical, properties) = (&device.physical, required.as_raw());
        let memory_type = physical.memory_type(allowed, required, preferred);
        let memory_type = memory_type.ok_or(VulkanError::NoMemoryType { properties })?;
        let kind = MemoryKind {
            memory_type,
            mapped: required.contains(vk::MemoryPropertyFlags::HOST_VISIBLE),
        };
        buffer.is_incoherent = kind.mapped && !physical.is_coherent(memory_type);
        if buffer.is_incoherent {
            // Flushing works on whole atoms, so no two buffers may share an atom.
            let atom = physical.non_coherent_atom;
            needs.alignment = needs.alignment.max(atom);
            needs.size = needs.size.next_multiple_of(atom);
        }
        let memory = device.shared.take(&device.raw, kind, &needs)?;
        buffer.bind(memory, is_texels, name)?;
        Ok(buffer)
    }

    /// Imports pages of this process's memory; `None` if the device cannot.
    ///
    /// # Safety
    /// The pages must stay allocated until the buffer is dropped and no submitted work uses it.
    pub(crate) unsafe fn around(
        device: &Arc<LogicalDevice>,
        pages: NonNull<u8>,
        size: u64,
    ) -> Option<Self> {
        let borrows = device.borrows.as_ref()?;
        let pages = pages.as_ptr().cast();
        let mut properties = vk::MemoryHostPointerPropertiesEXT::default();
        // SAFETY: the extension is enabled, and the pages belong to this process.
        let known = unsafe {
            let call = borrows.fp().get_memory_host_pointer_properties_ext;
            call(
                borrows.device(),
                HOST_ALLOCATION,
                pages,
                &raw mut properties,
            )
        };
        known.result().ok()?;
        let (is_texels, handle_type) = (device.reads_texels, Some(HOST_ALLOCATION));
        let made = Self::without_memory(device, size, is_texels, None, handle_type);
        let (mut buffer, needs) = made.ok().filter(|(_, needs)| needs.size <= size)?;
        let required =
            vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let preferred = &[vk::MemoryPropertyFlags::HOST_CACHED];
        let allowed = needs.memory_type_bits & properties.memory_type_bits;
        let memory_type = device.physical.memory_type(allowed, required, preferred)?;
        let mut import = vk::ImportMemoryHostPointerInfoEXT::default()
            .handle_type(HOST_ALLOCATION)
            .host_pointer(pages);
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(size)
            .memory_type_index(memory_type)
            .push_next(&mut import);
        // SAFETY: a valid size and memory type, and the pages belong to this process.
        let memory = unsafe { device.raw.allocate_memory(&info, None) }.ok()?;
        let memory = Share {
            memory,
            size,
            ..Share::default()
        };
        buffer.bind(memory, is_texels, "tumble imported").ok()?;
        Some(buffer)
    }

    /// Makes a buffer of at least `size` bytes for results, with a dedicated allocation that may be exported.
    pub(crate) fn exportable(
        device: &Arc<LogicalDevice>,
        name: &str,
        size: u64,
    ) -> Result<Self, VulkanError> {
        let size = size.max(LEAST).next_multiple_of(16);
        let (mut buffer, needs) = Self::without_memory(device, size, false, None, Some(FILE))?;
        let (required, preferred) = Residence::Results.properties();
        let physical = &device.physical;
        let memory_type = physical.memory_type(needs.memory_type_bits, required, preferred);
        let properties = required.as_raw();
        let memory_type = memory_type.ok_or(VulkanError::NoMemoryType { properties })?;
        let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(FILE);
        let mut alone = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer.raw);
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(memory_type)
            .push_next(&mut export)
            .push_next(&mut alone);
        // SAFETY: the size and the type are those that the buffer needs, and it may be exported.
        let memory =
            unsafe { device.raw.allocate_memory(&info, None) }.named("vkAllocateMemory")?;
        let memory = Share {
            memory,
            size: needs.size,
            ..Share::default()
        };
        buffer.bind(memory, false, name)?;
        Ok(buffer)
    }

    /// The buffer's memory, and its size in bytes.
    pub(crate) fn memory(&self) -> (vk::DeviceMemory, u64) {
        (self.memory.memory, self.memory.size)
    }

    /// Makes a buffer without memory, and reports its memory requirements.
    fn without_memory(
        device: &Arc<LogicalDevice>,
        size: u64,
        is_texels: bool,
        families: Option<[u32; 2]>,
        external: Option<vk::ExternalMemoryHandleTypeFlags>,
    ) -> Result<(Self, vk::MemoryRequirements), VulkanError> {
        let mut kinds = vk::ExternalMemoryBufferCreateInfo::default()
            .handle_types(external.unwrap_or_default());
        let mut info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(usage(is_texels));
        if let Some(families) = &families {
            info = info
                .sharing_mode(vk::SharingMode::CONCURRENT)
                .queue_family_indices(families);
        }
        if external.is_some() {
            info = info.push_next(&mut kinds);
        }
        // SAFETY: the device is alive, here and below; created objects are destroyed
        // in `drop`, also when a later step fails.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.named("vkCreateBuffer")?;
        // SAFETY: the buffer was just created.
        let needs = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let buffer = Self {
            device: Arc::clone(device),
            raw,
            view: vk::BufferView::null(),
            memory: Share::default(),
            is_incoherent: false,
            size,
        };
        Ok((buffer, needs))
    }

    fn bind(&mut self, memory: Share, is_texels: bool, name: &str) -> Result<(), VulkanError> {
        let device = &self.device.raw;
        self.memory = memory; // goes with the buffer, also when a later step fails
        // SAFETY: memory of a type that the buffer allows, and nothing else uses this part of it.
        unsafe { device.bind_buffer_memory(self.raw, memory.memory, memory.offset) }
            .named("vkBindBufferMemory")?;
        if is_texels {
            let info = vk::BufferViewCreateInfo::default()
                .buffer(self.raw)
                .format(vk::Format::R32G32B32A32_UINT)
                .range(vk::WHOLE_SIZE);
            // SAFETY: the buffer has memory, is made for this use and not longer than a
            // view may be.
            self.view =
                unsafe { device.create_buffer_view(&info, None) }.named("vkCreateBufferView")?;
        }
        self.device.name(self.raw, name);
        Ok(())
    }

    /// Whether the host can access its bytes.
    pub(crate) fn is_mapped(&self) -> bool {
        self.memory.mapped.is_some()
    }

    /// Whether the host and the device see each other's writes without invalidating and flushing, after fences and
    /// barriers.
    pub(crate) fn is_coherent(&self) -> bool {
        !self.is_incoherent
    }

    /// Makes the device's writes to some mapped bytes visible to the host, after the fence of that work and before
    /// the bytes are read.
    pub(crate) fn invalidate(&self, range: &Range<usize>) -> Result<(), VulkanError> {
        let Some(range) = self.atoms(range) else {
            return Ok(());
        };
        // SAFETY: mapped memory of this device, and whole atoms of it that are the buffer's alone.
        unsafe { self.device.raw.invalidate_mapped_memory_ranges(&[range]) }
            .named("vkInvalidateMappedMemoryRanges")
    }

    /// Makes the host's writes to some mapped bytes visible to the device, before the work is submitted. The device
    /// must not write next to these bytes at the same time.
    pub(crate) fn flush(&self, range: &Range<usize>) -> Result<(), VulkanError> {
        let Some(range) = self.atoms(range) else {
            return Ok(());
        };
        // SAFETY: as in `invalidate`.
        unsafe { self.device.raw.flush_mapped_memory_ranges(&[range]) }
            .named("vkFlushMappedMemoryRanges")
    }

    /// The memory range in whole atoms that contains some bytes; `None` if the memory is coherent or the range is
    /// empty.
    fn atoms(&self, range: &Range<usize>) -> Option<vk::MappedMemoryRange<'static>> {
        if !self.is_incoherent || range.is_empty() {
            return None;
        }
        let atom = self.device.physical.non_coherent_atom;
        let start = (self.memory.offset + range.start as u64) / atom * atom;
        let end = (self.memory.offset + range.end as u64).next_multiple_of(atom);
        Some(
            vk::MappedMemoryRange::default()
                .memory(self.memory.memory)
                .offset(start)
                .size(end - start),
        )
    }

    /// Some of the mapped bytes; empty if the buffer is not mapped or is shorter.
    pub(crate) fn bytes(&self, range: Range<usize>) -> &[u8] {
        match self.memory.mapped {
            // SAFETY: mapped with at least this size for the life of the buffer.
            // Callers read only after the fence of the work that writes the range.
            Some(pointer) if range.start <= range.end && range.end as u64 <= self.size => unsafe {
                std::slice::from_raw_parts(pointer.as_ptr().add(range.start), range.len())
            },
            _ => &[],
        }
    }

    /// Some of the mapped bytes, to write.
    pub(crate) fn bytes_mut(&mut self, range: Range<usize>) -> &mut [u8] {
        match self.memory.mapped {
            // SAFETY: as in `bytes`, and `&mut self` makes this the host's only
            // reference; the device works on other ranges.
            Some(pointer) if range.start <= range.end && range.end as u64 <= self.size => unsafe {
                std::slice::from_raw_parts_mut(pointer.as_ptr().add(range.start), range.len())
            },
            _ => &mut [],
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // SAFETY: created from this device and no longer in use: the code that submits
            // work keeps its buffers until the fence is signalled. Freeing memory
            // unmaps it; null handles are allowed.
            unsafe {
                self.device.raw.destroy_buffer_view(self.view, None);
                self.device.raw.destroy_buffer(self.raw, None);
                self.device.shared.give_back(&self.device.raw, self.memory);
            }
        }
    }
}
