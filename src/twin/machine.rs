//! The machine on which the generated entry points run: numbers, the memory that kernels share, and workgroups whose
//! invocations wait for each other.

use std::cell::RefCell;
use std::future::Future;
use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Range, Sub};
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

use crate::shader::Kernel;
use crate::twin::entries::{ENTRIES, GLOBALS, Global, PRIVATE, main};

/// The bits of memory that has not been written.
pub(crate) const UNTOUCHED: u32 = u32::MAX;

/// The entry point of a kernel.
pub(crate) struct Entry {
    /// The variables that it binds, in their order.
    pub(crate) bound: &'static [Global],
    /// The variable with the constants of a dispatch.
    pub(crate) pushed: Option<Global>,
    /// The invocations of a workgroup.
    pub(crate) workgroup: u32,
    /// The index of the same kernel where it reads texel buffers.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests compare the variants"))]
    pub(crate) texels: Option<usize>,
}

/// A value that lies in memory.
pub(crate) trait Stored: Copy {
    /// Its words.
    const WORDS: usize;

    fn of_words(words: &[u32]) -> Self;

    fn put(self, words: &mut [u32]);
}

macro_rules! stored_as_bits {
    ($($number:ty: $of:expr, $bits:expr;)+) => {$(
        impl Stored for $number {
            const WORDS: usize = 1;

            #[inline]
            fn of_words(words: &[u32]) -> Self {
                $of(words[0])
            }

            #[inline]
            fn put(self, words: &mut [u32]) {
                words[0] = $bits(self);
            }
        }
    )+};
}
stored_as_bits! {
    u32: |bits| bits, |number| number;
    i32: |bits| bits as i32, |number| number as u32;
    f32: f32::from_bits, f32::to_bits;
}

impl Stored for u64 {
    const WORDS: usize = 2;

    fn of_words(words: &[u32]) -> Self {
        Self::from(words[0]) | Self::from(words[1]) << 32
    }

    fn put(self, words: &mut [u32]) {
        words[..2].copy_from_slice(&[self as u32, (self >> 32) as u32]);
    }
}
impl<T: Stored, const N: usize> Stored for [T; N] {
    const WORDS: usize = N * T::WORDS;

    fn of_words(words: &[u32]) -> Self {
        std::array::from_fn(|i| T::of_words(&words[i * T::WORDS..]))
    }

    fn put(self, words: &mut [u32]) {
        for (i, element) in self.into_iter().enumerate() {
            element.put(&mut words[i * T::WORDS..]);
        }
    }
}

/// The offsets of the members of a struct, in words.
macro_rules! stored {
    ($name:ident, ($($generic:tt)*), $words:literal $(, $member:ident $offset:literal)+) => {
        stored!(@ $name, [$($generic)*], $words $(, $member $offset)+);
    };
    (@ $name:ident, [], $($layout:tt)+) => {
        impl crate::twin::machine::Stored for $name {
            stored!(= $($layout)+);
        }
    };
    (@ $name:ident, [<F>], $($layout:tt)+) => {
        impl<F: Float> crate::twin::machine::Stored for $name<F> {
            stored!(= $($layout)+);
        }
    };
    (= $words:literal $(, $member:ident $offset:literal)+) => {
        const WORDS: usize = $words;

        fn of_words(words: &[u32]) -> Self {
            Self {
                $($member: crate::twin::machine::Stored::of_words(&words[$offset..]),)+
            }
        }

        fn put(self, words: &mut [u32]) {
            $(crate::twin::machine::Stored::put(self.$member, &mut words[$offset..]);)+
        }
    };
}
pub(crate) use stored;

/// A number as a device may compute with it.
pub(crate) trait Float:
    Stored
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    fn of(value: f32) -> Self;

    fn bits(self) -> u32;

    fn of_bits(bits: u32) -> Self {
        Self::of(f32::from_bits(bits))
    }
}

impl Float for f32 {
    #[inline]
    fn of(value: f32) -> Self {
        value
    }

    #[inline]
    fn bits(self) -> u32 {
        self.to_bits()
    }
}

/// Numbers divided as in WGSL: by 0, a number stays.
#[inline]
pub(crate) fn quotient(a: u32, b: u32) -> u32 {
    a.checked_div(b).unwrap_or(a)
}

/// An operation on two vectors.
#[inline]
pub(crate) fn both<A: Copy, B: Copy, R, const N: usize>(
    a: [A; N],
    b: [B; N],
    operation: impl Fn(A, B) -> R,
) -> [R; N] {
    std::array::from_fn(|i| operation(a[i], b[i]))
}

/// For each component, that of `accept` where the condition holds, else that of `reject`.
#[inline]
pub(crate) fn choose<T: Copy, const N: usize>(
    conditions: [bool; N],
    accept: [T; N],
    reject: [T; N],
) -> [T; N] {
    std::array::from_fn(|i| if conditions[i] { accept[i] } else { reject[i] })
}

/// Which invocation it is.
#[derive(Clone, Copy)]
pub(crate) struct InvocationIds {
    pub(crate) global_invocation_id: [u32; 3],
    pub(crate) workgroup_id: [u32; 3],
    pub(crate) num_workgroups: [u32; 3],
    pub(crate) local_invocation_index: u32,
    pub(crate) subgroup_id: u32,
    pub(crate) num_subgroups: u32,
    pub(crate) subgroup_invocation_id: u32,
}

/// The lanes of a subgroup, unless [`Memory::with_subgroups_of`] sets another number. No result depends on it.
const SUBGROUP_LANES: u32 = 32;

/// The machine on which an invocation of a kernel runs: its indices and its memory.
pub(crate) trait Machine {
    type F: Float;
    /// Lives as long as a block of statements runs.
    type Block;

    /// The index of the kernel that runs, among [`ENTRIES`].
    fn code(&self) -> usize;

    fn ids(&self) -> InvocationIds;

    /// The number of elements of a buffer; an element has `words` words.
    fn length(&self, global: Global, words: usize) -> u32;

    fn load<T: Stored>(&self, global: Global, at: usize) -> T;

    fn store<T: Stored>(&self, global: Global, at: usize, value: T);

    /// Begins a block of `steps` operations, in a line of the generated file.
    fn block(&self, line: u32, steps: usize) -> Self::Block;

    /// Sets the word that the other lanes of the subgroup can read; with `None` they can read none any more.
    fn show(&self, word: Option<u32>);

    /// The word that a lane of the subgroup shows.
    fn shown(&self, lane: u32) -> Option<u32>;
}

/// Observes the operations of an invocation. `()` observes nothing.
pub(crate) trait Watch {
    type Block;

    /// The location of a load or a store: the one that the kernel states, unless a test plants a wrong one.
    #[cfg_attr(test, track_caller)]
    fn location(&self, at: usize, _words: usize) -> usize {
        at
    }

    fn touch(&self, global: Global, words: Range<usize>, is_store: bool);

    fn block(&self, line: u32, steps: usize) -> Self::Block;
}

impl Watch for () {
    type Block = ();

    #[inline]
    fn touch(&self, _: Global, _: Range<usize>, _: bool) {}

    #[inline]
    fn block(&self, _: u32, _: usize) {}
}

/// A kernel's buffers, the constants of its dispatch, and the memory of a workgroup. A store after the end of a buffer
/// makes it longer; a load after its end gives [`UNTOUCHED`].
pub(crate) struct Memory {
    code: usize,
    variables: Vec<RefCell<Vec<u32>>>,
    /// The variable in whose memory each lies.
    aliases: [Global; GLOBALS],
    output: Global,
    /// The lanes of a subgroup.
    subgroup_lanes: u32,
    /// The words that the invocations of the workgroup show to others of their subgroups.
    shown: RefCell<Vec<Option<u32>>>,
}

impl Memory {
    /// The memory of a kernel: its inputs, in the order of their bindings, and its output.
    pub(crate) fn new<'a>(
        kernel: Kernel,
        inputs: impl ExactSizeIterator<Item = &'a [u8]>,
        arguments: &[u8],
        output: Vec<u32>,
    ) -> Self {
        let code = kernel as usize;
        let (inputs_bound, outputs) = ENTRIES[code].bound.split_at(inputs.len());
        // Kernels that store in one of two precisions have a binding for each.
        let mut memory = Self {
            code,
            variables: vec![RefCell::default(); GLOBALS],
            aliases: Global::ALL,
            output: outputs[0],
            subgroup_lanes: SUBGROUP_LANES,
            shown: RefCell::default(),
        };
        for (&global, input) in inputs_bound.iter().zip(inputs) {
            memory.fill(global, input);
        }
        if let Some(pushed) = ENTRIES[code].pushed {
            memory.fill(pushed, arguments);
        }
        for &other in outputs {
            memory.aliases[other as usize] = outputs[0];
        }
        memory.variables[outputs[0] as usize] = RefCell::new(output);
        memory
    }

    fn fill(&mut self, global: Global, bytes: &[u8]) {
        self.variables[global as usize] = RefCell::new(bytemuck::pod_collect_to_vec(bytes));
    }

    pub(crate) fn into_output(self) -> Vec<u32> {
        self.variables[self.output as usize].take()
    }

    fn words(&self, global: Global) -> &RefCell<Vec<u32>> {
        &self.variables[self.aliases[global as usize] as usize]
    }

    /// Runs the kernel's variant that reads texel buffers from now on, if it has one.
    #[cfg(test)]
    pub(crate) fn read_texels(&mut self) -> bool {
        let texels = ENTRIES[self.code].texels;
        self.code = texels.unwrap_or(self.code);
        texels.is_some()
    }

    /// Sets the number of lanes of a subgroup, a power of two.
    #[cfg(test)]
    pub(crate) fn with_subgroups_of(self, subgroup_lanes: u32) -> Self {
        Self {
            subgroup_lanes,
            ..self
        }
    }

    /// Whether it is a buffer, and not memory of a workgroup or the constants of a dispatch.
    #[cfg(test)]
    pub(crate) fn is_buffer(&self, global: Global) -> bool {
        ENTRIES[self.code].bound.contains(&global)
    }

    /// An invocation that calls single functions.
    #[cfg(test)]
    pub(crate) fn invocation<F: Float, W: Watch>(&self, watch: W) -> Invocation<'_, F, W> {
        let ids = InvocationIds {
            global_invocation_id: [0; 3],
            workgroup_id: [0; 3],
            num_workgroups: [1; 3],
            local_invocation_index: 0,
            subgroup_id: 0,
            num_subgroups: 1,
            subgroup_invocation_id: 0,
        };
        Invocation {
            memory: self,
            ids,
            private: RefCell::default(),
            watch,
            numbers: PhantomData,
        }
    }

    /// Runs all workgroups of a dispatch.
    pub(crate) fn run<F: Float, W: Watch>(&self, groups: [u32; 3], watch: impl Fn(u32) -> W) {
        for z in 0..groups[2] {
            for y in 0..groups[1] {
                for x in 0..groups[0] {
                    self.run_group::<F, W>([x, y, z], groups, &watch);
                }
            }
        }
    }

    /// Runs one workgroup; returns the observer of each invocation.
    pub(crate) fn run_group<F: Float, W: Watch>(
        &self,
        group: [u32; 3],
        groups: [u32; 3],
        watch: impl Fn(u32) -> W,
    ) -> Vec<W> {
        let Entry {
            bound,
            pushed,
            workgroup,
            ..
        } = &ENTRIES[self.code];
        for (variable, global) in self.variables.iter().zip(Global::ALL) {
            if !bound.contains(&global) && *pushed != Some(global) {
                variable.borrow_mut().clear();
            }
        }
        *self.shown.borrow_mut() = vec![None; *workgroup as usize];
        let invocations: Vec<_> = (0..*workgroup)
            .map(|lane| Invocation::<F, W> {
                memory: self,
                ids: InvocationIds {
                    global_invocation_id: [group[0] * workgroup + lane, group[1], group[2]],
                    workgroup_id: group,
                    num_workgroups: groups,
                    local_invocation_index: lane,
                    subgroup_id: lane / self.subgroup_lanes,
                    num_subgroups: workgroup.div_ceil(self.subgroup_lanes),
                    subgroup_invocation_id: lane % self.subgroup_lanes,
                },
                private: RefCell::default(),
                watch: watch(lane),
                numbers: PhantomData,
            })
            .collect();
        let mut running: Vec<Pin<Box<dyn Future<Output = ()> + '_>>> = Vec::new();
        for invocation in &invocations {
            running.push(Box::pin(main(invocation)));
        }
        // Each invocation runs to its next barrier, one after another.
        let mut context = Context::from_waker(Waker::noop());
        while !running.is_empty() {
            running.retain_mut(|invocation| invocation.as_mut().poll(&mut context).is_pending());
        }
        drop(running);
        invocations.into_iter().map(|one| one.watch).collect()
    }
}

/// Waits until all invocations of the workgroup have arrived.
pub(crate) async fn barrier() {
    let mut has_arrived = false;
    let wait = std::future::poll_fn(|_| match std::mem::replace(&mut has_arrived, true) {
        true => Poll::Ready(()),
        false => Poll::Pending,
    });
    pin!(wait).await;
}

/// A bit for each lane of the subgroup that runs and whose condition holds, the lowest for the first lane.
pub(crate) async fn ballot(machine: &impl Machine, condition: bool) -> [u32; 4] {
    machine.show(Some(condition.into()));
    barrier().await;
    let word = |i: u32| {
        let lanes = (0..u32::BITS).filter(|bit| machine.shown(32 * i + bit) == Some(1));
        lanes.map(|bit| 1 << bit).sum()
    };
    let found = [0, 1, 2, 3].map(word);
    hide(machine).await;
    found
}

/// The value of a lane of the subgroup.
pub(crate) async fn shuffled<T: Stored>(machine: &impl Machine, value: T, lane: u32) -> T {
    const { assert!(T::WORDS == 1) };
    let mut word = [0];
    value.put(&mut word);
    machine.show(Some(word[0]));
    barrier().await;
    let found = machine.shown(lane).unwrap_or(UNTOUCHED);
    hide(machine).await;
    T::of_words(&[found])
}

/// Waits until all lanes have read the values of the others, then removes the value of this lane.
async fn hide(machine: &impl Machine) {
    barrier().await;
    machine.show(None);
}

/// One invocation of a kernel.
pub(crate) struct Invocation<'a, F, W> {
    memory: &'a Memory,
    ids: InvocationIds,
    /// The words of its own variables.
    private: RefCell<Vec<(Global, usize, u32)>>,
    watch: W,
    numbers: PhantomData<F>,
}

/// No value in memory has more words.
const MAX_WORDS: usize = 64;

impl<F: Float, W: Watch> Machine for Invocation<'_, F, W> {
    type F = F;
    type Block = W::Block;

    fn code(&self) -> usize {
        self.memory.code
    }

    fn ids(&self) -> InvocationIds {
        self.ids
    }

    fn length(&self, global: Global, words: usize) -> u32 {
        (self.memory.words(global).borrow().len() / words) as u32
    }

    #[cfg_attr(test, track_caller)]
    fn load<T: Stored>(&self, global: Global, at: usize) -> T {
        let at = self.watch.location(at, T::WORDS);
        let mut words = [UNTOUCHED; MAX_WORDS];
        let found = &mut words[..T::WORDS];
        if PRIVATE.contains(&global) {
            for &(variable, word, value) in &*self.private.borrow() {
                if variable == global && (at..at + T::WORDS).contains(&word) {
                    found[word - at] = value;
                }
            }
        } else {
            self.watch.touch(global, at..at + T::WORDS, false);
            let all = self.memory.words(global).borrow();
            let there = all.get(at..).unwrap_or_default();
            let there = &there[..there.len().min(T::WORDS)];
            found[..there.len()].copy_from_slice(there);
        }
        T::of_words(found)
    }

    #[cfg_attr(test, track_caller)]
    fn store<T: Stored>(&self, global: Global, at: usize, value: T) {
        let at = self.watch.location(at, T::WORDS);
        let mut words = [0; MAX_WORDS];
        let words = &mut words[..T::WORDS];
        value.put(words);
        if PRIVATE.contains(&global) {
            let mut private = self.private.borrow_mut();
            let words = words.iter().enumerate();
            private.extend(words.map(|(i, &word)| (global, at + i, word)));
        } else {
            self.watch.touch(global, at..at + T::WORDS, true);
            let mut all = self.memory.words(global).borrow_mut();
            let end = at + T::WORDS;
            if all.len() < end {
                all.resize(end, UNTOUCHED);
            }
            all[at..end].copy_from_slice(words);
        }
    }

    fn block(&self, line: u32, steps: usize) -> W::Block {
        self.watch.block(line, steps)
    }

    fn show(&self, word: Option<u32>) {
        let invocation = self.ids.local_invocation_index;
        self.memory.shown.borrow_mut()[invocation as usize] = word;
    }

    fn shown(&self, lane: u32) -> Option<u32> {
        let invocation = self.ids.subgroup_id * self.memory.subgroup_lanes + lane;
        let is_lane = lane < self.memory.subgroup_lanes;
        let shown = self.memory.shown.borrow();
        (*shown.get(invocation as usize)?).filter(|_| is_lane)
    }
}
