//! Exit codes, and the failures that lead to them.

use std::io;

use tumble::Error;
use tumble::vulkan::VulkanError;
use tumble_formats::output::OutputError;
use tumble_formats::printable::printable;
use tumble_formats::{Code, Diagnostic};

use crate::messages::words;

pub(crate) const DONE: u8 = 0;
pub(crate) const BUG: u8 = 1;
pub(crate) const USAGE: u8 = 2;
pub(crate) const SOME_INPUTS: u8 = 3;
pub(crate) const ALL_INPUTS: u8 = 4;
pub(crate) const NO_VULKAN: u8 = 5;
pub(crate) const DEVICE: u8 = 6;
pub(crate) const OUTPUT: u8 = 7;
pub(crate) const DIFFERENCE: u8 = 8;
/// 128 + SIGPIPE, as a shell reports a program that the signal ended.
pub(crate) const BROKEN_PIPE: u8 = 141;

/// Why a command ends early. An empty message is a quiet end.
#[derive(Debug, Clone)]
pub(crate) struct Failure {
    pub(crate) code: u8,
    message: String,
    /// Lines below it.
    more: Vec<String>,
    /// Whether the message is printed unchanged, without `error:` before it.
    plain: bool,
    /// Whether one output cannot be written, but others may be.
    is_of_one: bool,
    /// The code of the first error of an input.
    input_code: Option<Code>,
    /// The messages of the errors in an input, which were printed before.
    causes: Vec<String>,
}

impl Failure {
    pub(crate) fn new(code: u8, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
            more: Vec::new(),
            plain: false,
            is_of_one: false,
            input_code: None,
            causes: Vec::new(),
        }
    }

    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::new(USAGE, message)
    }

    /// A failure without a message: it has been reported.
    pub(crate) fn quiet(code: u8) -> Self {
        Self::new(code, "")
    }

    /// The same, of an input.
    pub(crate) fn of(mut self, input: &str) -> Self {
        self.message = format!("{input}: {}", self.message);
        self
    }

    /// The same, with a hint after the message.
    pub(crate) fn hinted(mut self, hint: &str) -> Self {
        self.message.push_str(hint);
        self
    }

    /// The same with lines below it.
    pub(crate) fn with_lines(mut self, lines: impl IntoIterator<Item = String>) -> Self {
        self.more.extend(lines);
        self
    }

    /// Data could not be written. A closed pipe needs no message.
    pub(crate) fn writing(name: &str, error: &io::Error) -> Self {
        let message = match error.kind() {
            io::ErrorKind::BrokenPipe => return Self::quiet(BROKEN_PIPE),
            io::ErrorKind::InvalidFilename => {
                format!("{name}: cannot be written: {error}; give its input a shorter name")
            }
            _ => format!("{name}: cannot be written: {error}"),
        };
        Self {
            is_of_one: is_of_one(error),
            ..Self::new(OUTPUT, message)
        }
    }

    /// The failure of an input all of whose parts were refused.
    pub(crate) fn parts(refused: &[Diagnostic]) -> Self {
        let mut each = refused.iter().map(ToString::to_string);
        let first = each.next().unwrap_or_default();
        Self {
            more: each.collect(),
            plain: true,
            input_code: refused.first().map(|fault| fault.code),
            ..Self::new(ALL_INPUTS, first)
        }
    }

    /// An input was refused; the diagnostic has another format.
    pub(crate) fn input(diagnostic: &Diagnostic, hint: &str) -> Self {
        let message = format!("{diagnostic}{hint}");
        Self {
            plain: true,
            input_code: Some(diagnostic.code),
            ..Self::new(ALL_INPUTS, message)
        }
    }

    /// An output was refused: it makes no sense, or the system refuses it.
    pub(crate) fn output(error: &OutputError) -> Self {
        match error {
            OutputError::Write { path, source } => {
                Self::writing(&path.display().to_string(), source)
            }
            OutputError::Moved { .. } => Self::new(OUTPUT, error.to_string()),
            OutputError::NoDirectory { .. } => Self {
                is_of_one: true,
                ..Self::new(OUTPUT, error.to_string())
            },
            _ => Self::usage(error.to_string()),
        }
    }

    /// An evaluation failed: the request, the input or the device is to blame.
    pub(crate) fn evaluating(input: &str, error: &Error) -> Self {
        let code = match error {
            Error::OutOfMemory(error) => {
                return Self::memory(input, error.purpose, error.bytes as f64, None);
            }
            Error::SampleTimes(_) => USAGE,
            Error::Vulkan(
                VulkanError::NoLoader { .. } | VulkanError::NoDevice | VulkanError::NoNvidiaDriver,
            ) => NO_VULKAN,
            Error::Vulkan(_) | Error::Threads(_) => DEVICE,
            Error::Interpolation(_) => ALL_INPUTS,
            _ => BUG,
        };
        Self::new(code, format!("{input}: {error}"))
    }

    /// A result of an input does not fit into memory; results of other inputs may fit. `free` is the memory that was
    /// free.
    pub(crate) fn memory(input: &str, result: &str, bytes: f64, free: Option<u64>) -> Self {
        let limit = free.map_or_else(
            || "less memory is free".to_owned(),
            |free| format!("{} of memory are free", words::bytes(free as f64)),
        );
        Self {
            code: ALL_INPUTS,
            ..Self::room(input, result, bytes, &limit)
        }
    }

    /// A result of an input does not fit on the disk; results of other inputs may fit. `limit` says how much is free.
    pub(crate) fn room(input: &str, result: &str, bytes: f64, limit: &str) -> Self {
        let amount = words::bytes(bytes);
        let message = format!(
            "{input}: {amount} ({bytes} bytes) are needed for {result}, and {limit}; ask for fewer frames (--fps, \
             --start, --end)"
        );
        Self {
            is_of_one: true,
            ..Self::new(OUTPUT, message)
        }
    }

    /// The request needs Vulkan, and there is none.
    pub(crate) fn no_vulkan(error: &VulkanError) -> Self {
        Self::new(NO_VULKAN, format!("no Vulkan device: {error}"))
    }

    /// Its text, as [`Failure::report`] prints it.
    pub(crate) fn into_message(self) -> String {
        let lines = std::iter::once(&self.message).chain(&self.more);
        let lines: Vec<_> = lines.map(|line| printable(line)).collect();
        lines.join("\n")
    }

    /// The code of the error of an input.
    pub(crate) fn input_code(&self) -> Option<Code> {
        self.input_code
    }

    /// Its message.
    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    /// The same failure with the messages of the errors, which were printed already. The manifest and JSON contain
    /// them.
    pub(crate) fn with_causes(self, causes: Vec<String>) -> Self {
        Self { causes, ..self }
    }

    /// The messages of the errors in an input, if the failure's message is a summary of them.
    pub(crate) fn causes(&self) -> &[String] {
        &self.causes
    }

    /// Whether the next input would fail in the same way.
    pub(crate) fn is_final(&self) -> bool {
        !(self.is_of_one || matches!(self.code, USAGE | SOME_INPUTS | ALL_INPUTS))
    }

    /// Says why, on standard error, and gives the exit code.
    pub(crate) fn report(&self) -> u8 {
        if self.plain {
            words::line(&self.message);
        } else if !self.message.is_empty() {
            words::error(&self.message);
        }
        for line in &self.more {
            words::line(line);
        }
        self.code
    }
}

/// Whether the error concerns only this file: its name, its folder or its length.
fn is_of_one(error: &io::Error) -> bool {
    use io::ErrorKind::{
        AlreadyExists, DirectoryNotEmpty, FileTooLarge, InvalidFilename, InvalidInput,
        IsADirectory, NotADirectory, NotFound, PermissionDenied,
    };
    matches!(
        error.kind(),
        AlreadyExists
            | DirectoryNotEmpty
            | FileTooLarge
            | InvalidFilename
            | InvalidInput
            | IsADirectory
            | NotADirectory
            | NotFound
            | PermissionDenied
    )
}

/// The outcomes of a command's inputs. A failure is reported and the others go on, unless they would fail
/// alike; a single input ends with the exit code of its failure.
pub(crate) struct Outcomes {
    total: usize,
    failed: usize,
    /// The number of inputs with results of some animations only.
    failed_in_part: usize,
    /// The failure that ends the command.
    end: Option<Failure>,
}

impl Outcomes {
    /// The outcomes of a command with that many inputs, none of which has one yet.
    pub(crate) fn of(total: usize) -> Self {
        Self {
            total,
            failed: 0,
            failed_in_part: 0,
            end: None,
        }
    }

    /// Whether the command ends before its other inputs.
    pub(crate) fn is_ended(&self) -> bool {
        self.end.is_some()
    }

    /// Ends the command.
    pub(crate) fn end(&mut self, failure: Failure) {
        self.end.get_or_insert(failure);
    }

    /// Adds the outcome of an input.
    pub(crate) fn add(&mut self, outcome: Result<(), Failure>) {
        self.add_reporting(outcome, |failure| {
            failure.report();
        });
    }

    /// As [`Outcomes::add`]; a failure that does not end the command is reported by `report`.
    pub(crate) fn add_reporting(
        &mut self,
        outcome: Result<(), Failure>,
        report: impl FnOnce(&Failure),
    ) {
        match outcome {
            Ok(()) => {}
            Err(failure) if failure.is_final() || self.total == 1 => self.end(failure),
            Err(failure) => {
                report(&failure);
                match failure.code {
                    SOME_INPUTS => self.failed_in_part += 1,
                    _ => self.failed += 1,
                }
            }
        }
    }

    /// The outcome of the command.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let failed = FailedInputs {
            failed: self.failed,
            in_part: self.failed_in_part,
        };
        self.end.map_or_else(|| failed.outcome_of(self.total), Err)
    }
}

/// How many inputs failed, as a batch, its shards, `merge` and `check` count them: those without any result, and those
/// that have results of some of their animations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct FailedInputs {
    pub(crate) failed: usize,
    pub(crate) in_part: usize,
}

impl FailedInputs {
    /// Counts inputs by the exit code of a command that has only this input.
    pub(crate) fn of_codes(codes: impl Iterator<Item = Option<u8>>) -> Self {
        codes.fold(Self::default(), |mut count, code| {
            match code {
                Some(SOME_INPUTS) => count.in_part += 1,
                _ => count.failed += 1,
            }
            count
        })
    }

    /// `2 inputs failed, 1 input failed in part`; nothing where none failed.
    pub(crate) fn text(self) -> Option<String> {
        let inputs = |count| words::count(count, "input");
        match (self.failed, self.in_part) {
            (0, 0) => None,
            (failed, 0) => Some(format!("{} failed", inputs(failed))),
            (0, in_part) => Some(format!("{} failed in part", inputs(in_part))),
            (failed, in_part) => Some(format!(
                "{} failed, {} failed in part",
                inputs(failed),
                inputs(in_part)
            )),
        }
    }

    /// The outcome of a command with that many inputs.
    pub(crate) fn outcome_of(self, total: usize) -> Result<(), Failure> {
        let failures = match (self.failed, self.in_part) {
            (0, 0) => return Ok(()),
            (failed, _) if failed == total => {
                let message = match total {
                    1 => "the input failed".to_owned(),
                    _ => format!("all {failed} inputs failed"),
                };
                return Err(Failure::new(ALL_INPUTS, message));
            }
            (failed, 0) => format!("{failed} of {total} inputs failed"),
            (0, in_part) => format!("{in_part} of {total} inputs failed in part"),
            (failed, in_part) => {
                format!("{failed} of {total} inputs failed (and {in_part} in part)")
            }
        };
        Err(Failure::new(SOME_INPUTS, failures))
    }
}

/// Runs `work` for every input, and adds up the outcomes as [`Outcomes`] does.
pub(crate) fn for_each<T>(
    inputs: &[T],
    mut work: impl FnMut(&T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut outcomes = Outcomes::of(inputs.len());
    for input in inputs {
        outcomes.add(work(input));
        if outcomes.is_ended() {
            break;
        }
    }
    outcomes.finish()
}
