//! Messages of a batch about its inputs: lines for results and failures, if there are only a few, and at the end a line
//! for each code of a warning. For a single input, every warning is printed. Everything that is not printed is in the
//! manifest.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use tumble_formats::printable::printable_path;
use tumble_formats::{Code, Diagnostic};

use crate::messages::exit::Failure;
use crate::messages::warnings::Warning;
use crate::messages::words;

/// The most inputs of a batch that prints a line for each result.
const MAX_INPUTS: usize = 20;

/// The most lines about results.
const MAX_RESULTS: usize = 20;

/// The most failures that are printed as they come.
const MAX_FAILURES: usize = 10;

/// The messages about a batch.
pub(crate) struct BatchSummary {
    /// Whether every warning is printed.
    prints_warnings: bool,
    /// The number of further lines about results that may be printed.
    results_left: usize,
    failures_left: usize,
    warnings: BTreeMap<Code, WarnedInputs>,
    /// The failures that were not printed, by the code of the input's error.
    failures: BTreeMap<Option<Code>, FailedInputs>,
    /// The codes of the failures that were printed.
    printed: BTreeSet<Option<Code>>,
    /// How many lines were left out.
    left_out: usize,
    /// Results with an assumed rate whose lines were not printed: their number, and the first rate.
    assumed: Option<(usize, String)>,
    /// The number of failed inputs that have results of an earlier run, and the first of these results.
    stale: Option<(usize, String)>,
}

/// The inputs with warnings of one code.
struct WarnedInputs {
    inputs: usize,
    /// The number of their warnings.
    warnings: usize,
    first: Diagnostic,
}

/// The inputs that failed for one reason.
struct FailedInputs {
    count: usize,
    first: Failure,
}

impl BatchSummary {
    pub(crate) fn new(inputs: usize, verbose: bool) -> Self {
        let all = |limit: usize| if verbose { usize::MAX } else { limit };
        Self {
            prints_warnings: verbose || inputs == 1,
            results_left: all(if inputs > MAX_INPUTS { 0 } else { MAX_RESULTS }),
            failures_left: all(MAX_FAILURES),
            warnings: BTreeMap::new(),
            failures: BTreeMap::new(),
            printed: BTreeSet::new(),
            left_out: 0,
            assumed: None,
            stale: None,
        }
    }

    /// The line about a result, if it must be printed. `assumed_fps` is the rate that was assumed for an input without
    /// a rate.
    pub(crate) fn result<'a>(
        &mut self,
        line: &'a str,
        assumed_fps: Option<&str>,
    ) -> Option<&'a str> {
        match self.results_left.checked_sub(1) {
            Some(left) => {
                self.results_left = left;
                Some(line)
            }
            None => {
                self.left_out += 1;
                if let Some(rate) = assumed_fps {
                    let assumed = self.assumed.get_or_insert_with(|| (0, rate.to_owned()));
                    assumed.0 += 1;
                }
                None
            }
        }
    }

    /// The warnings of one input: each is printed, or counted for the end. Those that are not about the input have been
    /// printed.
    pub(crate) fn warn(&mut self, warnings: &[Warning]) {
        let warnings = warnings.iter().filter_map(|warning| match warning {
            Warning::OfInput(diagnostic) => Some(diagnostic),
            Warning::Other(_) => None,
        });
        if self.prints_warnings {
            words::print_kept(warnings);
            return;
        }
        let mut codes = BTreeSet::new();
        for warning in warnings {
            let of_code = self.warnings.entry(warning.code);
            let of_code = of_code.or_insert_with(|| WarnedInputs {
                inputs: 0,
                warnings: 0,
                first: warning.clone(),
            });
            of_code.warnings += 1;
            of_code.inputs += usize::from(codes.insert(warning.code));
        }
    }

    /// A failure: it is printed, or counted for the end.
    pub(crate) fn fail(&mut self, failure: &Failure) {
        if let Some(left) = self.failures_left.checked_sub(1) {
            self.failures_left = left;
            self.printed.insert(failure.input_code());
            failure.report();
            return;
        }
        let failed = self.failures.entry(failure.input_code());
        failed
            .and_modify(|of_code| of_code.count += 1)
            .or_insert_with(|| FailedInputs {
                count: 1,
                first: failure.clone(),
            });
    }

    /// Records that a failed input has a result of an earlier run, which is not removed.
    pub(crate) fn stay(&mut self, result: &Path) {
        let first = || (0, printable_path(result));
        self.stale.get_or_insert_with(first).0 += 1;
    }

    /// The lines at the end of the batch.
    pub(crate) fn lines(&self) -> Vec<String> {
        const MORE: &str = "(--verbose lists them)";
        let warned = self.warnings.iter().map(|(code, of_code)| match of_code {
            WarnedInputs {
                inputs: 1,
                warnings: 1,
                first,
            } => first.to_string(),
            WarnedInputs {
                inputs: 1,
                warnings,
                first,
            } => format!("{first} (and {} more: --verbose lists them)", warnings - 1),
            WarnedInputs { inputs, first, .. } => format!(
                "{code} {inputs} files: {}; the first: {first} {MORE}",
                code.title()
            ),
        });
        let failed = self.failures.iter().map(|(code, of_code)| {
            let FailedInputs { count, first } = of_code;
            if *count == 1 {
                return first.message().to_owned();
            }
            let files = match self.printed.contains(code) {
                true => words::count(*count, "more file"),
                false => words::count(*count, "file"),
            };
            let first = first.message();
            match code {
                Some(code) => format!(
                    "{code} {files}: {}; the first: {first} {MORE}",
                    code.title()
                ),
                None => format!("{files} failed, the first: {first} {MORE}"),
            }
        });
        let assumed = self.assumed.iter().map(|(count, rate)| {
            let results = words::count(*count, "result");
            let have = if *count == 1 { "has" } else { "have" };
            format!(
                "{results} {have} {rate} fps, because the keys have no rate (--fps chooses one)"
            )
        });
        let stale = self.stale.iter().map(|(count, first)| {
            let inputs = words::count(*count, "failed input");
            let have = if *count == 1 { "has a result" } else { "have results" };
            format!("{inputs} {have} of an earlier run, made from other bytes, which stay: {first} is the first")
        });
        assumed.chain(warned).chain(failed).chain(stale).collect()
    }

    /// Whether lines about results were left out.
    pub(crate) fn is_shortened(&self) -> bool {
        self.left_out > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warnings(file: &str, count: usize) -> Vec<Warning> {
        let one = |index: usize| Diagnostic::new(file, Code::NoRoom, format!("fault {index}"));
        (1..=count).map(one).map(Warning::OfInput).collect()
    }

    /// The first of several warnings of one input says how many there are more.
    #[test]
    fn no_warning_hides_another() {
        let mut summary = BatchSummary::new(2, false);
        summary.warn(&warnings("a.glb", 3));
        let [line] = &summary.lines()[..] else {
            panic!("one line");
        };
        assert!(
            line.ends_with("fault 1 (and 2 more: --verbose lists them)"),
            "{line}"
        );
        summary.warn(&warnings("b.glb", 1));
        let [line] = &summary.lines()[..] else {
            panic!("one line");
        };
        assert!(line.contains(" 2 files: "), "{line}");
    }

    /// The warnings of the only input are printed as they come, and none is left for the end.
    #[test]
    fn a_single_input_has_no_summary() {
        let mut summary = BatchSummary::new(1, false);
        summary.warn(&warnings("a.glb", 3));
        assert_eq!(summary.lines(), [""; 0]);
    }
}
