//! What is compared: a function of a kernel, inputs for it, and its twin.

use super::cells::{Cells, as_f32};
use super::machine::Machine;
use super::program::Program;
use crate::gpu::kernel_check::random::Random;

/// One call of a function: what goes in, and what its twin makes of it.
#[derive(Default)]
pub(super) struct TwinTrial {
    arguments: Vec<u64>,
    buffers: Vec<(&'static str, Vec<u64>)>,
    /// The buffer of the result; without it, the function returns the result.
    output: Option<&'static str>,
    expected: Vec<u64>,
    samples: usize,
}

/// The value of output cells before the call. A twin expects it where nothing is stored.
pub(super) const UNTOUCHED: u64 = u64::MAX;

impl TwinTrial {
    pub(super) fn argument(&mut self, value: impl Cells) {
        value.put(&mut self.arguments);
    }

    /// Fills a global variable: a buffer, or what comes with a dispatch.
    pub(super) fn global(&mut self, name: &'static str, value: impl Cells) {
        let index = self.buffers.iter().position(|(buffer, _)| *buffer == name);
        let index = index.unwrap_or_else(|| {
            self.buffers.push((name, Vec::new()));
            self.buffers.len() - 1
        });
        let (_, cells) = &mut self.buffers[index];
        cells.clear();
        value.put(cells);
    }

    /// Takes the result from a buffer; all of it, if [`TwinTrial::global`] filled it.
    pub(super) fn output(&mut self, name: &'static str) {
        self.output = Some(name);
    }

    /// Says that the call evaluates so many samples; without it, it is one.
    pub(super) fn samples(&mut self, count: u32) {
        self.samples = count as usize;
    }

    pub(super) fn expect(&mut self, value: impl Cells) {
        value.put(&mut self.expected);
    }
}

/// Makes up one call.
type FillTrial = dyn Fn(&mut Random, &mut TwinTrial);

/// A function of a kernel beside its twin.
pub(super) struct Twin {
    pub(super) kernel: &'static str,
    pub(super) function: &'static str,
    trial: Box<FillTrial>,
}

/// A function that takes all that it needs as arguments, and the one in Rust.
pub(super) fn twin<A: Cells, R: Cells>(
    kernel: &'static str,
    function: &'static str,
    arguments: impl Fn(&mut Random) -> A + 'static,
    twin: impl Fn(A) -> R + 'static,
) -> Twin {
    with_globals(kernel, function, move |random, trial| {
        let arguments = arguments(random);
        arguments.put(&mut trial.arguments);
        trial.expect(twin(arguments));
    })
}

/// A function that reads or writes global variables: `trial` fills them and says what it expects.
pub(super) fn with_globals(
    kernel: &'static str,
    function: &'static str,
    trial: impl Fn(&mut Random, &mut TwinTrial) + 'static,
) -> Twin {
    Twin {
        kernel,
        function,
        trial: Box::new(trial),
    }
}

impl Twin {
    /// The index of a function of its kernel.
    pub(super) fn index_of(&self, name: &str, program: &Program) -> usize {
        let mut all = program.functions.iter();
        let index = all.position(|function| function.name == name);
        index.unwrap_or_else(|| panic!("{} has no function {name}", self.kernel))
    }

    /// Compares every bit of so many samples of random inputs; else the first sample that differs.
    pub(super) fn compare(
        &self,
        program: &Program,
        mut random: Random,
        samples: usize,
    ) -> Result<(), String> {
        let function = self.index_of(self.function, program);
        let mut trial = TwinTrial::default();
        let mut machine = Machine::new(program);
        let mut sample = 0;
        while sample < samples {
            trial.arguments.clear();
            trial.samples = 1;
            trial.expected.clear();
            (self.trial)(&mut random, &mut trial);
            let global = |name: &str| {
                let index = program.globals.iter().position(|global| global == name);
                index.unwrap_or_else(|| panic!("{} has no global {name}", self.kernel))
            };
            for (name, cells) in &trial.buffers {
                machine.globals[global(name)].clone_from(cells);
            }
            let count = trial.expected.len();
            // A buffer that is filled is read and written.
            let is_filled = |name| trial.buffers.iter().any(|(buffer, _)| *buffer == name);
            if let Some(name) = trial.output.filter(|&name| !is_filled(name)) {
                let output = &mut machine.globals[global(name)];
                output.clear();
                output.resize(count, UNTOUCHED);
            }
            let Some(returned) = machine.call(function, &trial.arguments) else {
                let Self {
                    kernel, function, ..
                } = self;
                return Err(format!(
                    "{function} of {kernel} reads or writes outside a buffer, or does not end"
                ));
            };
            let found = match trial.output {
                Some(name) => &machine.globals[global(name)],
                None => returned,
            };
            assert_eq!(found.len(), count, "{}", self.function);
            if *found != trial.expected {
                let wrong = (0..count)
                    .find(|&i| found[i] != trial.expected[i])
                    .unwrap_or(0);
                let [found, expected] = [found, &trial.expected].map(|all| all[wrong]);
                return Err(format!(
                    "{} of {}, sample {sample}, cell {wrong} of {count}: \
                     {found:#x} ({:e}), but the twin has {expected:#x} ({:e})\n\
                     arguments: {:x?}\nglobals: {:x?}",
                    self.function,
                    self.kernel,
                    as_f32(found),
                    as_f32(expected),
                    trial.arguments,
                    trial.buffers,
                ));
            }
            sample += trial.samples;
        }
        Ok(())
    }
}
