//! A recording: copies, dispatches and the barriers between them, over resources that have only numbers.
//!
//! [`Recorded`](crate::gpu::recorded::Recorded) knows the memory of each resource, and writes the steps into a command
//! buffer. A recording that is filled again needs no new memory for as many steps as before.
//!
//! Barriers follow from how kernels use their bindings ([`Access`], which the compiler of the shaders lists). A step
//! waits for the earlier steps that wrote what it reads, or that used what it writes, unless a barrier has ordered them
//! already. Two rules make this exact without knowing addresses: resources do not overlap, except those that are only
//! read; and kernels that only write a resource, and copies into it, write different parts of it.

use std::mem::take;
use std::ops::Range;

use bytemuck::NoUninit;

use crate::shader::{Access, Kernel, WORKGROUP};

/// The most bytes of push constants, for which pipelines have room; Vulkan guarantees 128.
pub(crate) const MAX_PUSHED: usize = 64;

/// A resource of a recording: a range of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Resource(u32);

/// Bytes of a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slice {
    pub(crate) resource: Resource,
    /// The first byte, and the number of bytes; `None` for the whole resource.
    pub(crate) part: Option<(u64, u64)>,
}

impl Resource {
    /// Its place among the resources of the recording.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }

    /// `size` bytes from `start` on.
    pub(crate) fn slice(self, start: u64, size: u64) -> Slice {
        Slice {
            resource: self,
            part: Some((start, size)),
        }
    }
}

impl From<Resource> for Slice {
    fn from(resource: Resource) -> Self {
        Self {
            resource,
            part: None,
        }
    }
}

/// A kernel with a resource for each of its bindings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bound {
    pub(crate) kernel: Kernel,
    bindings: Range<usize>,
}

/// The place of a [`Bound`] kernel among those of the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Set(u32);

impl Set {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// One step of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Step {
    Barrier {
        from: Users,
        to: Users,
    },
    /// As many bytes are copied as the shorter of both has.
    Copy {
        from: Slice,
        to: Slice,
    },
    /// Bytes that are stored in the commands.
    Write {
        to: Slice,
        bytes: Bytes,
    },
    /// Users outside this device own the memory from now on.
    Release {
        slice: Slice,
    },
    Dispatch {
        set: Set,
        /// The push constants, among the bytes of the recording.
        push: Range<usize>,
        groups: [u32; 3],
    },
}

/// The source of bytes that are stored in the commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Bytes {
    /// Bytes of the recording.
    Stored(Range<usize>),
    /// The input with this index, which is given when the recording is executed.
    Input(usize),
}

/// The users of memory on one side of a barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Users {
    Kernel,
    Copy,
    KernelAndCopy,
    Host,
    VertexShader,
    /// All earlier or later work on the queue.
    Any,
}

/// The user of a resource in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum By {
    Kernel,
    Copy,
    Host,
}

/// The last steps of kernels and of copies that may have to be waited for, by their numbers; 0 for none.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    kernel: u32,
    copy: u32,
}

impl Last {
    fn set(&mut self, by: By, step: u32) {
        match by {
            By::Kernel => self.kernel = step,
            By::Copy => self.copy = step,
            By::Host => {} // it is waited for by submitting later
        }
    }

    fn latest(self, other: Self) -> Self {
        Self {
            kernel: self.kernel.max(other.kernel),
            copy: self.copy.max(other.copy),
        }
    }

    /// Which of them come after `ordered`.
    fn after(self, ordered: Self) -> Option<Users> {
        match (self.kernel > ordered.kernel, self.copy > ordered.copy) {
            (false, false) => None,
            (true, false) => Some(Users::Kernel),
            (false, true) => Some(Users::Copy),
            (true, true) => Some(Users::KernelAndCopy),
        }
    }
}

/// The last steps that used a resource.
#[derive(Debug, Clone, Copy, Default)]
struct Uses {
    reads: Last,
    writes: Last,
    /// The last kernel that read and wrote it.
    updated: u32,
}

impl Uses {
    /// The last steps for which another use of the resource must wait.
    fn before(&self, by: By, access: Access) -> Last {
        let mut writes = self.writes;
        match access {
            Access::Read => writes,
            Access::ReadWrite => self.reads.latest(writes),
            Access::Write => {
                // Steps that only write a resource write different parts of it, so they need no barrier between them.
                match by {
                    By::Kernel => writes.kernel = self.updated,
                    By::Copy | By::Host => writes.copy = 0,
                }
                self.reads.latest(writes)
            }
        }
    }
}

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Recording {
    uses: Vec<Uses>,
    bound: Vec<Bound>,
    /// The bindings of all sets, one set after another.
    bindings: Vec<Slice>,
    steps: Vec<Step>,
    /// Push constants and written bytes.
    bytes: Vec<u8>,
    /// The number of steps that use memory.
    count: u32,
    /// For kernels, copies and the host: the earlier steps for which barriers made them wait.
    ordered: [Last; 3],
    /// The last writes of all resources.
    written: Last,
}

impl Recording {
    /// Removes everything.
    pub(crate) fn clear(&mut self) {
        self.clear_steps();
        self.uses.clear();
        self.bound.clear();
        self.bindings.clear();
    }

    /// Removes the steps; resources and sets stay.
    pub(crate) fn clear_steps(&mut self) {
        self.steps.clear();
        self.bytes.clear();
        self.uses.fill(Uses::default());
        (self.count, self.written) = (0, Last::default());
        self.ordered = [Last::default(); 3];
    }

    /// Adds a resource.
    pub(crate) fn resource(&mut self) -> Resource {
        self.uses.push(Uses::default());
        Resource(self.uses.len() as u32 - 1)
    }

    /// Adds a kernel with a resource for each of its bindings.
    pub(crate) fn set(&mut self, kernel: Kernel, bindings: impl IntoIterator<Item = Slice>) -> Set {
        let first = self.bindings.len();
        self.bindings.extend(bindings);
        let bindings = first..self.bindings.len();
        debug_assert_eq!(bindings.len(), kernel.compiled().bindings.len());
        self.bound.push(Bound { kernel, bindings });
        Set(self.bound.len() as u32 - 1)
    }

    /// The kernels with their bindings, in the order in which they were added.
    pub(crate) fn sets(&self) -> impl ExactSizeIterator<Item = (Kernel, &[Slice])> {
        let each = |bound: &Bound| (bound.kernel, bound.bindings.clone());
        (self.bound.iter().map(each)).map(|(kernel, range)| (kernel, &self.bindings[range]))
    }

    /// The places of all sets.
    pub(crate) fn all_sets(&self) -> impl Iterator<Item = Set> + use<> {
        (0..self.bound.len() as u32).map(Set)
    }

    pub(crate) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Bytes that a step refers to.
    pub(crate) fn bytes(&self, range: &Range<usize>) -> &[u8] {
        &self.bytes[range.clone()]
    }

    /// All steps wait for everything that was submitted or recorded before.
    pub(crate) fn wait_for_all(&mut self) {
        self.steps.push(Step::Barrier {
            from: Users::Any,
            to: Users::KernelAndCopy,
        });
    }

    /// A barrier that no step needs, as measurements record it.
    #[cfg(feature = "lab")]
    pub(crate) fn barrier(&mut self, from: Users, to: Users) {
        self.steps.push(Step::Barrier { from, to });
    }

    /// Everything that is submitted or recorded later sees what was written.
    pub(crate) fn publish(&mut self) {
        if let Some(from) = self.written.after(Last::default()) {
            let to = Users::Any;
            self.steps.push(Step::Barrier { from, to });
        }
    }

    /// Gives memory that was written to users outside this device.
    pub(crate) fn release(&mut self, slice: Slice) {
        self.steps.push(Step::Release { slice });
    }

    /// The host sees what was written to a resource, after it has waited.
    pub(crate) fn read_by_host(&mut self, resource: Resource) {
        self.order(By::Host, [(resource.into(), Access::Read)]);
    }

    /// Says that a kernel of an earlier recording of the same commands wrote a resource.
    pub(crate) fn was_written(&mut self, resource: Resource) {
        self.order(By::Kernel, [(resource.into(), Access::Write)]);
    }

    /// Copies as many bytes as the shorter of both has.
    pub(crate) fn copy(&mut self, from: impl Into<Slice>, to: impl Into<Slice>) {
        let (from, to) = (from.into(), to.into());
        self.order(By::Copy, [(from, Access::Read), (to, Access::Write)]);
        self.steps.push(Step::Copy { from, to });
    }

    /// Writes some bytes, a multiple of 4, to the first bytes of `to`.
    pub(crate) fn write(&mut self, to: impl Into<Slice>, bytes: &[u8]) {
        let bytes = Bytes::Stored(self.stored(bytes));
        self.write_from(to.into(), bytes);
    }

    /// Writes the bytes of an input, a multiple of 4, to the first bytes of `to`.
    pub(crate) fn write_input(&mut self, to: impl Into<Slice>, input: usize) {
        self.write_from(to.into(), Bytes::Input(input));
    }

    fn write_from(&mut self, to: Slice, bytes: Bytes) {
        self.order(By::Copy, [(to, Access::Write)]);
        self.steps.push(Step::Write { to, bytes });
    }

    /// Runs a kernel with these push constants. Workgroups beyond a device's limit along x continue along y, if they
    /// are one row.
    pub(crate) fn dispatch<T: NoUninit>(&mut self, set: Set, push: &T, groups: [u32; 3]) {
        const { assert!(size_of::<T>() <= MAX_PUSHED) };
        self.dispatch_with(set, bytemuck::bytes_of(push), groups);
    }

    /// As [`Recording::dispatch`].
    pub(crate) fn dispatch_with(&mut self, set: Set, push: &[u8], groups: [u32; 3]) {
        assert!(push.len() <= MAX_PUSHED);
        let push = self.stored(push);
        let Bound { kernel, bindings } = self.bound[set.index()].clone();
        let all = take(&mut self.bindings);
        let accesses = kernel.compiled().bindings.iter().copied();
        self.order(By::Kernel, all[bindings].iter().copied().zip(accesses));
        self.bindings = all;
        self.steps.push(Step::Dispatch { set, push, groups });
    }

    fn stored(&mut self, bytes: &[u8]) -> Range<usize> {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        start..self.bytes.len()
    }

    /// Adds a barrier, if necessary, so that a step with these resources runs after the steps that it needs.
    fn order(&mut self, by: By, uses: impl IntoIterator<Item = (Slice, Access), IntoIter: Clone>) {
        let uses = uses.into_iter();
        let before = (uses.clone())
            .map(|(slice, access)| self.uses[slice.resource.index()].before(by, access))
            .fold(Last::default(), Last::latest);
        let ordered = &mut self.ordered[by as usize];
        if let Some(from) = before.after(*ordered) {
            if from != Users::Copy {
                ordered.kernel = self.count;
            }
            if from != Users::Kernel {
                ordered.copy = self.count;
            }
            let to = match by {
                By::Kernel => Users::Kernel,
                By::Copy => Users::Copy,
                By::Host => Users::Host,
            };
            self.steps.push(Step::Barrier { from, to });
        }
        self.count += 1;
        for (slice, access) in uses {
            let uses = &mut self.uses[slice.resource.index()];
            if access != Access::Write {
                uses.reads.set(by, self.count);
            }
            if access != Access::Read {
                uses.writes.set(by, self.count);
                self.written.set(by, self.count);
            }
            if access == Access::ReadWrite {
                uses.updated = self.count;
            }
        }
    }
}

/// The workgroups for this number of invocations, along x.
pub(crate) fn workgroups(invocations: u32) -> [u32; 3] {
    [invocations.div_ceil(WORKGROUP), 1, 1]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The steps of a recording, one a letter or two: `[kernel>copy]` is a barrier, `D` a dispatch, `C` a copy, `W` a
    /// write, `R` a release.
    pub(crate) fn letters(recording: &Recording) -> String {
        let each = |step: &Step| match step {
            Step::Barrier { from, to } => format!("[{from:?}>{to:?}]"),
            Step::Copy { .. } => "C".to_owned(),
            Step::Write { .. } => "W".to_owned(),
            Step::Dispatch { .. } => "D".to_owned(),
            Step::Release { .. } => "R".to_owned(),
        };
        recording.steps().iter().map(each).collect()
    }

    /// A recording, and so many resources.
    fn recording<const N: usize>() -> (Recording, [Resource; N]) {
        let mut recording = Recording::default();
        let resources = [(); N].map(|()| recording.resource());
        (recording, resources)
    }

    fn dispatch(recording: &mut Recording, kernel: Kernel, resources: &[Resource]) {
        let bindings = resources.iter().map(|&resource| Slice::from(resource));
        let set = recording.set(kernel, bindings);
        recording.dispatch(set, &[0u32; 2], workgroups(1));
    }

    #[test]
    fn copies_that_kernels_read_need_one_barrier() {
        let (mut all, [staged, one, other, weights, result, host]) = recording();
        all.copy(staged, one);
        all.copy(staged, other);
        dispatch(&mut all, Kernel::PosesMix, &[one, other, weights, result]);
        dispatch(&mut all, Kernel::PosesMix, &[one, other, weights, result]);
        all.copy(result, host);
        all.read_by_host(host);
        let steps = "CC[Copy>Kernel]DD[Kernel>Copy]C[Copy>Host]";
        assert_eq!(letters(&all), steps);
    }

    /// Dispatches that only write a resource need no barrier, those that also read it do.
    #[test]
    fn what_a_kernel_reads_orders_it() {
        let (mut all, [links, local, matrices]) = recording();
        dispatch(&mut all, Kernel::CrowdHalf, &[local, matrices]);
        dispatch(&mut all, Kernel::CrowdHalf, &[local, matrices]);
        dispatch(&mut all, Kernel::CrowdWalk, &[links, matrices]);
        dispatch(&mut all, Kernel::CrowdWalk, &[links, matrices]);
        dispatch(&mut all, Kernel::CrowdHalf, &[local, matrices]);
        dispatch(&mut all, Kernel::CrowdHalf, &[local, matrices]);
        // The step overwrites values that an earlier step reads.
        dispatch(&mut all, Kernel::CrowdHalf, &[matrices, local]);
        let order = "[Kernel>Kernel]";
        assert_eq!(
            letters(&all),
            format!("DD{order}D{order}D{order}DD{order}D")
        );
    }

    #[test]
    fn values_of_the_host_are_written_behind_those_of_kernels() {
        let (mut all, [read, result]) = recording();
        all.wait_for_all();
        dispatch(&mut all, Kernel::PosesSteps, &[read, result]);
        all.write(result.slice(0, 4), &[1; 4]);
        all.write(result.slice(16, 4), &[2; 4]);
        all.publish();
        all.release(result.into());
        let steps = "[Any>KernelAndCopy]D[Kernel>Copy]WW[KernelAndCopy>Any]R";
        assert_eq!(letters(&all), steps);
        let Step::Write { bytes, .. } = &all.steps()[4] else {
            panic!("{:?}", all.steps());
        };
        assert_eq!(*bytes, Bytes::Stored(12..16));
        assert_eq!(all.bytes(&(12..16)), [2; 4]);
    }

    /// A recording that is filled again has the same steps, of which none is waited for.
    #[test]
    fn cleared_steps_leave_nothing_to_wait_for() {
        let (mut all, [read, result]) = recording();
        let set = all.set(Kernel::PosesSteps, [read.into(), result.into()]);
        for _ in 0..2 {
            all.clear_steps();
            all.write_input(read, 0);
            all.dispatch(set, &[0u32; 2], workgroups(65));
            assert_eq!(letters(&all), "W[Copy>Kernel]D");
            assert!(matches!(
                all.steps()[2],
                Step::Dispatch {
                    groups: [2, 1, 1],
                    ..
                }
            ));
        }
        assert_eq!(all.all_sets().collect::<Vec<_>>(), [set]);
    }

    /// Waits for the writes of another recording of the same commands.
    #[test]
    fn earlier_kernels_are_waited_for() {
        let (mut all, [result, host]) = recording();
        all.was_written(result);
        all.copy(result, host);
        all.read_by_host(host);
        assert_eq!(letters(&all), "[Kernel>Copy]C[Copy>Host]");
    }
}
