//! Runs the steps of a [`Program`].

use std::ops::Range;

use super::operations::{Binary, Operand, Place, Unary};
use super::program::Program;

/// One expression or statement. Each writes its result `to` a place of its own.
pub(super) enum Step {
    /// Cells put together: vectors, arrays and structs, parts of them, and their copies.
    Compose {
        from: Vec<Place>,
        to: Place,
    },
    Unary {
        work: Unary,
        from: Place,
        to: Place,
        count: usize,
    },
    Binary {
        work: &'static dyn Binary,
        operands: [Operand; 2],
        to: Place,
        count: usize,
    },
    Select {
        condition: Operand,
        accept: Place,
        reject: Place,
        to: Place,
        count: usize,
    },
    /// The element of an array or vector `of` so many that is a value, not a variable.
    Element {
        base: Place,
        index: Place,
        of: usize,
        to: Place,
        count: usize,
    },
    /// A pointer to a variable of this frame.
    Local {
        place: Place,
        to: Place,
    },
    /// A pointer to an element, of `count` cells, of what a pointer points to.
    Point {
        base: Place,
        index: Place,
        of: usize,
        to: Place,
        count: usize,
    },
    /// A pointer to a fixed part of what a pointer points to.
    Advance {
        base: Place,
        by: usize,
        to: Place,
    },
    Load {
        pointer: Place,
        to: Place,
        count: usize,
    },
    Store {
        pointer: Place,
        from: Place,
        count: usize,
    },
    /// Four words of a texel buffer.
    Texel {
        buffer: Place,
        index: Place,
        to: Place,
    },
    ArrayLength {
        pointer: Place,
        to: Place,
        stride: usize,
    },
    If {
        condition: Place,
        accept: Vec<Step>,
        reject: Vec<Step>,
    },
    Loop {
        body: Vec<Step>,
        continuing: Vec<Step>,
    },
    Break,
    Return {
        from: Place,
    },
    Call {
        function: usize,
        arguments: Vec<Place>,
        to: Place,
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
    /// Turns of loops so far.
    turns: usize,
    /// Whether anything was read or written outside the memory, or beyond the end of an array.
    is_outside: bool,
}

/// A load or a store of a global variable.
pub(super) struct Touch {
    pub(super) global: usize,
    cells: Range<usize>,
    pub(super) is_store: bool,
    /// Turns of loops before it: invocations that run together take them together.
    pub(super) turn: usize,
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
            turns: 0,
            is_outside: false,
        }
    }

    /// Calls a function; returns its result, or `None` if it went outside the memory.
    pub(super) fn call(&mut self, function: usize, arguments: &[u64]) -> Option<&[u64]> {
        self.stack.clear();
        self.stack.extend_from_slice(arguments);
        (self.is_outside, self.turns) = (false, 0);
        let places: Vec<Place> = (0..arguments.len()).collect();
        let first = self.enter(function, 0, &places, arguments.len());
        let count = self.program.functions[function].result;
        (!self.is_outside).then(|| &self.stack[first..first + count])
    }

    /// Runs a function with arguments from the frame at `caller`, in a frame at `base`. Returns
    /// where its result lies.
    fn enter(&mut self, function: usize, caller: usize, arguments: &[Place], base: usize) -> usize {
        let function = &self.program.functions[function];
        let needed = base + function.size;
        if self.stack.len() < needed {
            self.stack.resize(needed, 0);
        }
        self.stack[base..base + function.start.len()].copy_from_slice(&function.start);
        for (i, place) in arguments.iter().enumerate() {
            self.stack[base + i] = self.stack[caller + place];
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
                turn: self.turns,
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

    fn run(&mut self, steps: &[Step], base: usize, top: usize) -> End {
        for step in steps {
            let frame = &mut self.stack[base..top];
            match *step {
                Step::Compose { ref from, to } => {
                    for (i, &from) in from.iter().enumerate() {
                        frame[to + i] = frame[from];
                    }
                }
                Step::Unary {
                    work,
                    from,
                    to,
                    count,
                } => {
                    for i in 0..count {
                        frame[to + i] = work(frame[from + i]);
                    }
                }
                Step::Binary {
                    work,
                    operands,
                    to,
                    count,
                } => work.run(frame, operands, to, count),
                Step::Select {
                    condition,
                    accept,
                    reject,
                    to,
                    count,
                } => {
                    for i in 0..count {
                        let accepts = frame[condition.place + condition.step * i] != 0;
                        frame[to + i] = frame[if accepts { accept } else { reject } + i];
                    }
                }
                Step::Element {
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
                Step::Local { place, to } => frame[to] = (base + place) as u64,
                Step::Point {
                    base,
                    index,
                    of,
                    to,
                    count,
                } => {
                    let index = inside(frame[index], of, &mut self.is_outside);
                    frame[to] = frame[base] + (index * count) as u64;
                }
                Step::Advance { base, by, to } => frame[to] = frame[base] + by as u64,
                Step::Load { pointer, to, count } => {
                    let pointer = frame[pointer];
                    self.load(pointer, base + to, count);
                }
                Step::Store {
                    pointer,
                    from,
                    count,
                } => {
                    let pointer = frame[pointer];
                    self.store(pointer, base + from, count);
                }
                Step::Texel { buffer, index, to } => {
                    let index = inside(frame[index], MANY, &mut self.is_outside);
                    let texel = frame[buffer] + 4 * index as u64;
                    self.load(texel, base + to, 4);
                }
                Step::ArrayLength {
                    pointer,
                    to,
                    stride,
                } => {
                    let global = (frame[pointer] >> 32) as usize - 1;
                    frame[to] = (self.globals[global].len() / stride) as u64;
                }
                Step::If {
                    condition,
                    ref accept,
                    ref reject,
                } => {
                    let taken = if frame[condition] != 0 {
                        accept
                    } else {
                        reject
                    };
                    match self.run(taken, base, top) {
                        End::Whole => {}
                        end => return end,
                    }
                }
                Step::Loop {
                    ref body,
                    ref continuing,
                } => loop {
                    match self.run(body, base, top) {
                        End::Whole => {}
                        End::Break => break,
                        end => return end,
                    }
                    self.run(continuing, base, top);
                    self.turns += 1;
                },
                Step::Break => return End::Break,
                Step::Return { from } => return End::Return(base + from),
                Step::Call {
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
