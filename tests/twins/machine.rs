//! Runs the steps of a [`Program`].

use std::ops::Range;

use super::operations::{Binary, CellIndex, Operand, Unary};
use super::program::Program;

/// One expression or statement. Each writes its result to separate cells, from `to` on.
pub(super) enum MachineStep {
    /// Cells put together: vectors, arrays and structs, parts of them, and their copies.
    Compose {
        from: Vec<CellIndex>,
        to: CellIndex,
    },
    Unary {
        work: Unary,
        from: CellIndex,
        to: CellIndex,
        count: usize,
    },
    Binary {
        work: &'static dyn Binary,
        operands: [Operand; 2],
        to: CellIndex,
        count: usize,
    },
    Select {
        condition: Operand,
        accept: CellIndex,
        reject: CellIndex,
        to: CellIndex,
        count: usize,
    },
    /// The element of an array or vector `of` so many that is a value, not a variable.
    Element {
        base: CellIndex,
        index: CellIndex,
        of: usize,
        to: CellIndex,
        count: usize,
    },
    /// A pointer to a variable of this frame.
    Local {
        variable: CellIndex,
        to: CellIndex,
    },
    /// A pointer to an element, of `count` cells, of what a pointer points to.
    Point {
        base: CellIndex,
        index: CellIndex,
        of: usize,
        to: CellIndex,
        count: usize,
    },
    /// A pointer to a fixed part of what a pointer points to.
    Advance {
        base: CellIndex,
        by: usize,
        to: CellIndex,
    },
    Load {
        pointer: CellIndex,
        to: CellIndex,
        count: usize,
    },
    Store {
        pointer: CellIndex,
        from: CellIndex,
        count: usize,
    },
    /// Four words of a texel buffer.
    Texel {
        buffer: CellIndex,
        index: CellIndex,
        to: CellIndex,
    },
    ArrayLength {
        pointer: CellIndex,
        to: CellIndex,
        stride: usize,
    },
    If {
        condition: CellIndex,
        accept: Vec<MachineStep>,
        reject: Vec<MachineStep>,
    },
    Loop {
        body: Vec<MachineStep>,
        continuing: Vec<MachineStep>,
    },
    Break,
    Return {
        from: CellIndex,
    },
    Call {
        function: usize,
        arguments: Vec<CellIndex>,
        to: CellIndex,
        count: usize,
    },
}

/// How a list of steps ended.
enum End {
    Whole,
    Break,
    /// Where the result lies in the stack.
    Return(usize),
}

/// The loops of a call of any kernel take a few hundred iterations.
const MAX_ITERATIONS: usize = 1 << 16;

/// Memory: the frames of the functions that run, and a buffer for each global variable.
///
/// A pointer's upper half is 0 for the stack and 1 + its index for a global; its lower half is the
/// cell there.
pub(super) struct Machine<'a> {
    program: &'a Program,
    stack: Vec<u64>,
    pub(super) globals: Vec<Vec<u64>>,
    /// What was read and written of global variables, where that is asked for.
    pub(super) touches: Option<Vec<Touch>>,
    /// Iterations of loops so far.
    iterations: usize,
    /// Whether anything was read or written outside the memory, or past the end of an array.
    is_outside: bool,
    /// Whether its loops took more than [`MAX_ITERATIONS`].
    is_endless: bool,
}

/// A load or a store of a global variable.
pub(super) struct Touch {
    pub(super) global: usize,
    cells: Range<usize>,
    pub(super) is_store: bool,
    /// Iterations of loops before it: invocations that run together take them together.
    pub(super) iteration: usize,
}

impl Touch {
    /// Its bytes, for a buffer of numbers of four bytes.
    pub(super) fn bytes(&self) -> Range<u64> {
        4 * self.cells.start as u64..4 * self.cells.end as u64
    }
}

pub(super) fn pointer_to_global(index: usize) -> u64 {
    (index as u64 + 1) << 32
}

/// Elements of an array whose length only its buffer tells: more than any buffer has, and few enough
/// that a pointer to any of them stays in the lower half.
pub(super) const MANY: usize = 1 << 24;

/// An index below the number of elements; 0 for one that is not, which is noted.
fn inside(index: u64, of: usize, is_outside: &mut bool) -> usize {
    let is_inside = index < of as u64;
    *is_outside |= !is_inside;
    if is_inside { index as usize } else { 0 }
}

impl<'a> Machine<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        Self {
            program,
            stack: Vec::new(),
            globals: vec![Vec::new(); program.globals.len()],
            touches: None,
            iterations: 0,
            is_outside: false,
            is_endless: false,
        }
    }

    /// Calls a function; returns its result, or `None` if it went outside the memory or did not end.
    pub(super) fn call(&mut self, function: usize, arguments: &[u64]) -> Option<&[u64]> {
        self.stack.clear();
        self.stack.extend_from_slice(arguments);
        (self.is_outside, self.is_endless, self.iterations) = (false, false, 0);
        let indices: Vec<CellIndex> = (0..arguments.len()).collect();
        let first = self.enter(function, 0, &indices, arguments.len());
        let count = self.program.functions[function].result;
        (!self.is_outside && !self.is_endless).then(|| &self.stack[first..first + count])
    }

    /// Runs a function with arguments from the frame at `caller`, in a frame at `base`. Returns
    /// where its result lies.
    fn enter(
        &mut self,
        function: usize,
        caller: usize,
        arguments: &[CellIndex],
        base: usize,
    ) -> usize {
        let function = &self.program.functions[function];
        let needed = base + function.size;
        if self.stack.len() < needed {
            self.stack.resize(needed, 0);
        }
        self.stack[base..base + function.start.len()].copy_from_slice(&function.start);
        for (i, argument) in arguments.iter().enumerate() {
            self.stack[base + i] = self.stack[caller + argument];
        }
        match self.run(&function.steps, base, needed) {
            End::Return(result) => result,
            _ => base,
        }
    }

    /// The cells that a pointer points to, if they are in the memory.
    fn cells(&self, pointer: u64, count: usize) -> Option<(usize, Range<usize>)> {
        let (memory, first) = ((pointer >> 32) as usize, pointer as u32 as usize);
        let length = match memory {
            0 => self.stack.len(),
            global => self.globals[global - 1].len(),
        };
        (first + count <= length).then_some((memory, first..first + count))
    }

    fn note(&mut self, global: usize, cells: &Range<usize>, is_store: bool) {
        if let Some(touches) = &mut self.touches {
            touches.push(Touch {
                global,
                cells: cells.clone(),
                is_store,
                iteration: self.iterations,
            });
        }
    }

    fn load(&mut self, pointer: u64, to: usize, count: usize) {
        match self.cells(pointer, count) {
            None => self.is_outside = true,
            Some((0, cells)) => self.stack.copy_within(cells, to),
            Some((global, cells)) => {
                self.note(global - 1, &cells, false);
                self.stack[to..to + count].copy_from_slice(&self.globals[global - 1][cells]);
            }
        }
    }

    fn store(&mut self, pointer: u64, from: usize, count: usize) {
        match self.cells(pointer, count) {
            None => self.is_outside = true,
            Some((0, cells)) => self.stack.copy_within(from..from + count, cells.start),
            Some((global, cells)) => {
                self.note(global - 1, &cells, true);
                self.globals[global - 1][cells].copy_from_slice(&self.stack[from..from + count]);
            }
        }
    }

    fn run(&mut self, steps: &[MachineStep], base: usize, top: usize) -> End {
        for step in steps {
            let frame = &mut self.stack[base..top];
            match *step {
                MachineStep::Compose { ref from, to } => {
                    for (i, &from) in from.iter().enumerate() {
                        frame[to + i] = frame[from];
                    }
                }
                MachineStep::Unary {
                    work,
                    from,
                    to,
                    count,
                } => {
                    for i in 0..count {
                        frame[to + i] = work(frame[from + i]);
                    }
                }
                MachineStep::Binary {
                    work,
                    operands,
                    to,
                    count,
                } => work.run(frame, operands, to, count),
                MachineStep::Select {
                    condition,
                    accept,
                    reject,
                    to,
                    count,
                } => {
                    for i in 0..count {
                        let accepts = frame[condition.first + condition.step * i] != 0;
                        frame[to + i] = frame[if accepts { accept } else { reject } + i];
                    }
                }
                MachineStep::Element {
                    base,
                    index,
                    of,
                    to,
                    count,
                } => {
                    let index = inside(frame[index], of, &mut self.is_outside);
                    let first = base + index * count;
                    frame.copy_within(first..first + count, to);
                }
                MachineStep::Local { variable, to } => frame[to] = (base + variable) as u64,
                MachineStep::Point {
                    base,
                    index,
                    of,
                    to,
                    count,
                } => {
                    let index = inside(frame[index], of, &mut self.is_outside);
                    frame[to] = frame[base] + (index * count) as u64;
                }
                MachineStep::Advance { base, by, to } => frame[to] = frame[base] + by as u64,
                MachineStep::Load { pointer, to, count } => {
                    let pointer = frame[pointer];
                    self.load(pointer, base + to, count);
                }
                MachineStep::Store {
                    pointer,
                    from,
                    count,
                } => {
                    let pointer = frame[pointer];
                    self.store(pointer, base + from, count);
                }
                MachineStep::Texel { buffer, index, to } => {
                    let index = inside(frame[index], MANY, &mut self.is_outside);
                    let texel = frame[buffer] + 4 * index as u64;
                    self.load(texel, base + to, 4);
                }
                MachineStep::ArrayLength {
                    pointer,
                    to,
                    stride,
                } => {
                    let global = (frame[pointer] >> 32) as usize - 1;
                    frame[to] = (self.globals[global].len() / stride) as u64;
                }
                MachineStep::If {
                    condition,
                    ref accept,
                    ref reject,
                } => {
                    let branch = if frame[condition] != 0 {
                        accept
                    } else {
                        reject
                    };
                    match self.run(branch, base, top) {
                        End::Whole => {}
                        end => return end,
                    }
                }
                MachineStep::Loop {
                    ref body,
                    ref continuing,
                } => loop {
                    match self.run(body, base, top) {
                        End::Whole => {}
                        End::Break => break,
                        end => return end,
                    }
                    self.run(continuing, base, top);
                    self.iterations += 1;
                    self.is_endless |= self.iterations > MAX_ITERATIONS;
                    if self.is_endless {
                        return End::Return(base);
                    }
                },
                MachineStep::Break => return End::Break,
                MachineStep::Return { from } => return End::Return(base + from),
                MachineStep::Call {
                    function,
                    ref arguments,
                    to,
                    count,
                } => {
                    let result = self.enter(function, base, arguments, top);
                    self.stack.copy_within(result..result + count, base + to);
                }
            }
        }
        End::Whole
    }
}
