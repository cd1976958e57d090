//! The one place where commands are recorded: a [`Recording`] with the memory, the pipelines and the descriptor sets
//! of a device becomes commands of the engine's own submission, or of an application's command buffer.

use std::ops::Deref;
use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::pipeline::Pipeline;
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::names::fields::with_fields;
use crate::shader::Kernel;
use crate::work::recording::{Bytes, Recording, Resource, Slice, Step, Users};

/// The maximum number of bytes that one command may write.
const WRITTEN: usize = 1 << 16;

/// A range of a buffer that a kernel binds.
#[derive(Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) buffer: vk::Buffer,
    /// A view of the whole buffer as texels; null unless kernels read it as a texel buffer.
    pub(crate) view: vk::BufferView,
    pub(crate) offset: u64,
    pub(crate) size: u64,
}

impl Binding {
    /// A range of a buffer that kernels do not read as texels.
    pub(crate) fn range(buffer: vk::Buffer, offset: u64, size: u64) -> Self {
        Self {
            buffer,
            view: vk::BufferView::null(),
            offset,
            size,
        }
    }

    pub(crate) fn whole(buffer: &Buffer) -> Self {
        Self {
            buffer: buffer.raw,
            view: buffer.view,
            offset: 0,
            size: buffer.size,
        }
    }
}

/// A recording on a device. It must be dropped after all submitted work of it has ended.
pub(crate) struct Recorded {
    pub(crate) recording: Recording,
    /// The memory of each resource.
    memory: Vec<Binding>,
    pool: DescriptorPool,
    /// The descriptor set of each kernel of the recording, after [`Recorded::bind`].
    sets: Vec<BoundSet>,
}

/// A descriptor set, and the handles of its pipeline.
#[derive(Clone, Copy)]
struct BoundSet {
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    set: vk::DescriptorSet,
}

impl Recorded {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Self {
        Self {
            recording: Recording::default(),
            memory: Vec::new(),
            pool: DescriptorPool::new(device),
            sets: Vec::new(),
        }
    }

    /// Forgets everything; no submitted work may still use it.
    pub(crate) fn clear(&mut self) {
        self.recording.clear();
        self.memory.clear();
        self.sets.clear();
    }

    /// A resource in this memory.
    pub(crate) fn resource(&mut self, memory: Binding) -> Resource {
        self.memory.push(memory);
        self.recording.resource()
    }

    /// A resource that is a whole buffer.
    pub(crate) fn whole(&mut self, buffer: &Buffer) -> Resource {
        self.resource(Binding::whole(buffer))
    }

    /// Makes the descriptor sets of the kernels. The pipelines must live until the work has ended.
    pub(crate) fn bind<P: Deref<Target = Pipeline>>(
        &mut self,
        mut pipeline: impl FnMut(Kernel) -> Result<P, VulkanError>,
    ) -> Result<(), VulkanError> {
        let Self {
            recording,
            memory,
            pool,
            sets,
        } = self;
        pool.make_room(recording.sets().len() as u32)?;
        for (kernel, bindings) in recording.sets() {
            let pipeline = pipeline(kernel)?;
            let bindings = bindings.iter().map(|slice| found(memory, slice));
            sets.push(BoundSet {
                pipeline: pipeline.raw,
                layout: pipeline.layout,
                set: pool.set(&pipeline, bindings)?,
            });
        }
        Ok(())
    }

    /// Records all steps. `inputs` are the bytes that the recording writes from outside.
    pub(crate) fn record(&self, commands: Commands<'_>, inputs: &[&[u8]]) {
        let mut bound = None;
        for step in self.recording.steps() {
            match step {
                Step::Barrier { from, to } => commands.barrier(*from, *to),
                Step::Copy { from, to } => {
                    commands.copy(found(&self.memory, from), found(&self.memory, to));
                }
                Step::Write { to, bytes } => {
                    let bytes = match bytes {
                        Bytes::Stored(range) => self.recording.bytes(range),
                        Bytes::Input(index) => inputs[*index],
                    };
                    commands.write(found(&self.memory, to), bytes);
                }
                Step::Release { slice } => commands.release(found(&self.memory, slice)),
                Step::Dispatch { set, push, groups } => {
                    let is_bound = bound.replace(*set) == Some(*set);
                    let set = &self.sets[set.index()];
                    if !is_bound {
                        commands.bind(set);
                    }
                    commands.dispatch(set, self.recording.bytes(push), *groups);
                }
            }
        }
    }
}

/// The memory of a part of a resource.
fn found(memory: &[Binding], slice: &Slice) -> Binding {
    let whole = memory[slice.resource.index()];
    match slice.part {
        None => whole,
        Some((start, size)) => Binding {
            offset: whole.offset + start,
            size,
            ..whole
        },
    }
}

/// Users of a device's memory among an application's commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum CommandUsers {
    /// All commands.
    #[default]
    Any,
    /// Compute shaders.
    Kernels,
    /// Copies, fills and updates of buffers.
    Copies,
    /// Compute shaders, copies, fills and updates.
    KernelsAndCopies,
    /// The host.
    Host,
    /// Vertex shaders, and vertex buffers: the queue must support graphics.
    VertexShaders,
}

impl CommandUsers {
    /// All kinds of users.
    pub const ALL: [Self; 6] = [
        Self::Any,
        Self::Kernels,
        Self::Copies,
        Self::KernelsAndCopies,
        Self::Host,
        Self::VertexShaders,
    ];
}

/// The commands of an application that a recorded target is ordered with. The target waits for the earlier commands and
/// their writes, and the later ones see its results. Waiting for fewer kinds of commands takes less time; by default the
/// target waits for all commands, also for drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub struct CommandScopes {
    /// The earlier commands that use the inputs of the target or the memory of its result: the target waits for them.
    pub before: CommandUsers,
    /// The later commands that use the result: they wait for the target.
    pub after: CommandUsers,
}

with_fields! {
    CommandScopes:
    with_before(before: CommandUsers),
    with_after(after: CommandUsers),
}

impl CommandScopes {
    /// For work over memory of its own, which an earlier recording of the same target may still use.
    pub(crate) fn with_earlier_recordings(self) -> Self {
        let before = match self.before {
            CommandUsers::Kernels | CommandUsers::Copies | CommandUsers::KernelsAndCopies => {
                CommandUsers::KernelsAndCopies
            }
            CommandUsers::Any | CommandUsers::Host | CommandUsers::VertexShaders => {
                CommandUsers::Any
            }
        };
        Self { before, ..self }
    }

    /// The users on both sides of a barrier. Where the recording has [`Users::Any`], the application's scopes count.
    fn of_barrier(self, [from, to]: [Users; 2]) -> [Users; 2] {
        let either = |users, named: CommandUsers| match users {
            Users::Any => named.into(),
            others => others,
        };
        [either(from, self.before), either(to, self.after)]
    }
}

impl From<CommandUsers> for Users {
    fn from(users: CommandUsers) -> Self {
        match users {
            CommandUsers::Any => Self::Any,
            CommandUsers::Kernels => Self::Kernel,
            CommandUsers::Copies => Self::Copy,
            CommandUsers::KernelsAndCopies => Self::KernelAndCopy,
            CommandUsers::Host => Self::Host,
            CommandUsers::VertexShaders => Self::VertexShader,
        }
    }
}

/// A command buffer in the recording state: a submission's, or an application's.
#[derive(Clone, Copy)]
pub(crate) struct Commands<'a> {
    device: &'a LogicalDevice,
    raw: vk::CommandBuffer,
    /// The work before and after these commands that their barriers order.
    scopes: CommandScopes,
}

impl<'a> Commands<'a> {
    /// # Safety
    /// The command buffer must belong to this device, must be in the recording state outside a render pass, and its
    /// queue must support the recorded commands. The commands may use only objects of this device, which must live
    /// until the work has ended.
    pub(crate) unsafe fn new(device: &'a LogicalDevice, raw: vk::CommandBuffer) -> Self {
        let scopes = CommandScopes::default();
        Self {
            device,
            raw,
            scopes,
        }
    }

    /// Commands between those of an application.
    pub(crate) fn between(self, scopes: CommandScopes) -> Self {
        Self { scopes, ..self }
    }

    /// Binds a pipeline and the buffers of a set.
    fn bind(self, bound: &BoundSet) {
        let (raw, compute) = (&self.device.raw, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: recording is on, and set and pipeline belong to this device (`new`).
        unsafe {
            raw.cmd_bind_pipeline(self.raw, compute, bound.pipeline);
            raw.cmd_bind_descriptor_sets(self.raw, compute, bound.layout, 0, &[bound.set], &[]);
        }
    }

    /// Records a dispatch of the bound kernel. A row of more workgroups than the limit along x continues along y.
    fn dispatch(self, bound: &BoundSet, constants: &[u8], [x, y, z]: [u32; 3]) {
        let limit = self.device.physical.info.max_compute_work_group_count[0];
        let [x, y, z] = match x > limit {
            true => [limit, x.div_ceil(limit) * y, z],
            false => [x, y, z],
        };
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: as in `bind`, which was called with the same set.
        unsafe {
            (self.device.raw).cmd_push_constants(self.raw, bound.layout, stage, 0, constants);
            self.device.raw.cmd_dispatch(self.raw, x, y, z);
        }
    }

    /// Records a copy of as many bytes as both ranges have.
    fn copy(self, from: Binding, to: Binding) {
        let region = [vk::BufferCopy::default()
            .src_offset(from.offset)
            .dst_offset(to.offset)
            .size(from.size.min(to.size))];
        // SAFETY: recording is on, and both ranges lie within their buffers, which belong to this device (`new`).
        unsafe { (self.device.raw).cmd_copy_buffer(self.raw, from.buffer, to.buffer, &region) };
    }

    /// Records that the first bytes of a buffer, a multiple of 4, are filled with a word.
    #[cfg(feature = "lab")]
    pub(crate) fn fill(self, to: &Buffer, bytes: u64, word: u32) {
        let (raw, bytes) = (&self.device.raw, bytes.min(to.size));
        // SAFETY: as in `copy`; the range lies within the buffer.
        unsafe { raw.cmd_fill_buffer(self.raw, to.raw, 0, bytes, word) };
    }

    /// Records that some bytes, a multiple of 4, are written to a buffer. The bytes are stored in the commands.
    fn write(self, to: Binding, bytes: &[u8]) {
        for (start, part) in (to.offset..).step_by(WRITTEN).zip(bytes.chunks(WRITTEN)) {
            // SAFETY: as in `copy`; the range lies within the buffer, and the bytes are copied into the commands.
            unsafe { (self.device.raw).cmd_update_buffer(self.raw, to.buffer, start, part) };
        }
    }

    /// Records a queue family ownership transfer of a range, which kernels and copies have written, to users outside
    /// this Vulkan instance.
    fn release(self, range: Binding) {
        use vk::{AccessFlags as A, PipelineStageFlags as S};
        let memory = [vk::BufferMemoryBarrier::default()
            .src_access_mask(A::SHADER_WRITE | A::TRANSFER_WRITE)
            .src_queue_family_index(self.device.family(QueueLane::Kernels))
            .dst_queue_family_index(vk::QUEUE_FAMILY_EXTERNAL)
            .buffer(range.buffer)
            .offset(range.offset)
            .size(range.size)];
        let (from, to) = (S::COMPUTE_SHADER | S::TRANSFER, S::BOTTOM_OF_PIPE);
        let (raw, none) = (&self.device.raw, vk::DependencyFlags::empty());
        // SAFETY: as in `copy`; the range lies within the buffer.
        unsafe { raw.cmd_pipeline_barrier(self.raw, from, to, none, &[], &memory, &[]) };
    }

    /// Records a barrier: earlier writes by `from` are visible to `to` afterwards.
    pub(crate) fn barrier(self, from: Users, to: Users) {
        let [from, to] = self.scopes.of_barrier([from, to]);
        let ((source, written), (destination, used)) = (scope(from, true), scope(to, false));
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(written)
            .dst_access_mask(used)];
        let (raw, none) = (&self.device.raw, vk::DependencyFlags::empty());
        // SAFETY: recording is on (`new`).
        unsafe { raw.cmd_pipeline_barrier(self.raw, source, destination, none, &memory, &[], &[]) };
    }
}

/// The stages of users, and how they write, or use, memory.
fn scope(users: Users, writes: bool) -> (vk::PipelineStageFlags, vk::AccessFlags) {
    use vk::{AccessFlags as A, PipelineStageFlags as S};
    match (users, writes) {
        (Users::Kernel, true) => (S::COMPUTE_SHADER, A::SHADER_WRITE),
        (Users::Kernel, false) => (S::COMPUTE_SHADER, A::SHADER_READ | A::SHADER_WRITE),
        (Users::Copy, true) => (S::TRANSFER, A::TRANSFER_WRITE),
        (Users::Copy, false) => (S::TRANSFER, A::TRANSFER_READ | A::TRANSFER_WRITE),
        (Users::KernelAndCopy, _) => {
            let [kernel, copy] = [Users::Kernel, Users::Copy].map(|users| scope(users, writes));
            (kernel.0 | copy.0, kernel.1 | copy.1)
        }
        (Users::Host, true) => (S::HOST, A::HOST_WRITE),
        (Users::Host, false) => (S::HOST, A::HOST_READ),
        (Users::VertexShader, true) => (S::VERTEX_SHADER, A::SHADER_WRITE),
        (Users::VertexShader, false) => (
            S::VERTEX_INPUT | S::VERTEX_SHADER,
            A::VERTEX_ATTRIBUTE_READ | A::UNIFORM_READ | A::SHADER_READ | A::SHADER_WRITE,
        ),
        (Users::Any, true) => (S::ALL_COMMANDS, A::MEMORY_WRITE),
        (Users::Any, false) => (S::ALL_COMMANDS, A::MEMORY_READ | A::MEMORY_WRITE),
    }
}

/// The maximum number of buffers that a kernel binds.
const MAX_BINDINGS: u32 = 10;

/// A pool of descriptor sets. It must be dropped after all submitted work with its sets has ended.
struct DescriptorPool {
    device: Arc<LogicalDevice>,
    /// Null while the pool has no room.
    raw: vk::DescriptorPool,
    /// The number of sets for which it has room.
    room: u32,
}

impl DescriptorPool {
    /// A pool without room.
    fn new(device: &Arc<LogicalDevice>) -> Self {
        Self {
            device: Arc::clone(device),
            raw: vk::DescriptorPool::null(),
            room: 0,
        }
    }

    /// Frees all sets, which no submitted work may use any more, and makes room for `sets` sets.
    fn make_room(&mut self, sets: u32) -> Result<(), VulkanError> {
        let raw = &self.device.raw;
        if sets <= self.room {
            if self.room > 0 {
                let flags = vk::DescriptorPoolResetFlags::empty();
                // SAFETY: no set is in use.
                unsafe { raw.reset_descriptor_pool(self.raw, flags) }
                    .named("vkResetDescriptorPool")?;
            }
            return Ok(());
        }
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        ]
        .map(|kind| {
            vk::DescriptorPoolSize::default()
                .ty(kind)
                .descriptor_count(sets * MAX_BINDINGS)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets)
            .pool_sizes(&sizes);
        // SAFETY: no set of the old pool is in use; null is allowed.
        unsafe { raw.destroy_descriptor_pool(self.raw, None) };
        (self.raw, self.room) = (vk::DescriptorPool::null(), 0);
        // SAFETY: the device is alive; the pool is destroyed above or in `drop`.
        self.raw =
            unsafe { raw.create_descriptor_pool(&info, None) }.named("vkCreateDescriptorPool")?;
        self.room = sets;
        Ok(())
    }

    /// A set with one buffer for each binding of a pipeline.
    fn set(
        &mut self,
        pipeline: &Pipeline,
        bindings: impl Iterator<Item = Binding>,
    ) -> Result<vk::DescriptorSet, VulkanError> {
        let raw = &self.device.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.raw)
            .set_layouts(&layouts);
        // SAFETY: `make_room` made room for this set.
        let set =
            unsafe { raw.allocate_descriptor_sets(&info) }.named("vkAllocateDescriptorSets")?[0];
        for (index, binding) in (0..).zip(bindings) {
            let info = [vk::DescriptorBufferInfo::default()
                .buffer(binding.buffer)
                .offset(binding.offset)
                .range(binding.size)];
            let views = [binding.view];
            let kind = pipeline.kind(index);
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(index)
                .descriptor_type(kind);
            let write = match kind {
                vk::DescriptorType::STORAGE_BUFFER => write.buffer_info(&info),
                _ => write.texel_buffer_view(&views),
            };
            // SAFETY: nothing uses the set yet, and the buffers are alive.
            unsafe { raw.update_descriptor_sets(&[write], &[]) };
        }
        Ok(set)
    }
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // SAFETY: created from this device, and no submitted work uses its sets any more (see the
            // type); null is allowed.
            unsafe { self.device.raw.destroy_descriptor_pool(self.raw, None) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory that belongs to a pass or to a crowd alone was used by its kernels and copies only.
    #[test]
    fn earlier_recordings_of_a_target_are_waited_for() {
        use CommandUsers::{Any, Copies, Host, Kernels, KernelsAndCopies, VertexShaders};
        for (before, waited_for) in [
            (Any, Any),
            (Kernels, KernelsAndCopies),
            (Copies, KernelsAndCopies),
            (KernelsAndCopies, KernelsAndCopies),
            (Host, Any),
            (VertexShaders, Any),
        ] {
            let scopes = CommandScopes {
                before,
                after: Kernels,
            };
            let found = scopes.with_earlier_recordings();
            assert_eq!((found.before, found.after), (waited_for, Kernels));
        }
    }

    #[test]
    fn barriers_to_other_commands_are_for_the_users_that_the_application_names() {
        let scopes = CommandScopes {
            before: CommandUsers::Copies,
            after: CommandUsers::Host,
        };
        let of = |from, to| scopes.of_barrier([from, to]);
        let (any, kernel) = (Users::Any, Users::Kernel);
        assert_eq!(
            of(any, Users::KernelAndCopy),
            [Users::Copy, Users::KernelAndCopy]
        );
        assert_eq!(of(kernel, any), [kernel, Users::Host]);
        let drawn = CommandScopes::default().with_after(CommandUsers::VertexShaders);
        assert_eq!(
            drawn.of_barrier([kernel, any]),
            [kernel, Users::VertexShader]
        );
        assert_eq!(of(kernel, Users::Copy), [kernel, Users::Copy]);
        assert_eq!(CommandScopes::default().of_barrier([any, any]), [any, any]);
    }
}
