//! Messages of a batch about its inputs: the lines of results and failures, as long as they are few, and a line for
//! each code of a warning at the end. Everything that is not printed is in the manifest.

use std::collections::BTreeMap;

use tumble_formats::{Code, Diagnostic};

use crate::messages::exit::Failure;
use crate::messages::words;

/// The most inputs of a batch that prints a line for each result.
const MAX_INPUTS: usize = 20;

/// The most lines about results.
const MAX_RESULTS: usize = 20;

/// The most failures that are printed as they come.
const MAX_FAILURES: usize = 10;

/// The messages about a batch.
pub(crate) struct BatchSummary {
    /// Whether every line is printed.
    verbose: bool,
    /// The lines about results that may yet be printed.
    results_left: usize,
    failures_left: usize,
    warnings: BTreeMap<Code, WarnedInputs>,
    /// The failures that were not printed, by the code of the input's error.
    failures: BTreeMap<Option<Code>, FailedInputs>,
    /// How many lines were left out.
    left_out: usize,
}

/// The inputs with a warning of one code.
struct WarnedInputs {
    count: usize,
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
            verbose,
            results_left: all(if inputs > MAX_INPUTS { 0 } else { MAX_RESULTS }),
            failures_left: all(MAX_FAILURES),
            warnings: BTreeMap::new(),
            failures: BTreeMap::new(),
            left_out: 0,
        }
    }

    /// The line about a result, if it is to be printed.
    pub(crate) fn result<'a>(&mut self, line: &'a str) -> Option<&'a str> {
        match self.results_left.checked_sub(1) {
            Some(left) => {
                self.results_left = left;
                Some(line)
            }
            None => {
                self.left_out += 1;
                None
            }
        }
    }

    /// The warnings of one input: each is printed, or counted for the end.
    pub(crate) fn warn(&mut self, warnings: &[Diagnostic]) {
        if self.verbose {
            words::warnings(warnings);
            return;
        }
        let mut codes = BTreeMap::new();
        for warning in warnings {
            codes.entry(warning.code).or_insert(warning);
        }
        for (code, first) in codes {
            let of_code = self.warnings.entry(code).or_insert_with(|| WarnedInputs {
                count: 0,
                first: first.clone(),
            });
            of_code.count += 1;
        }
    }

    /// A failure: it is printed, or counted for the end.
    pub(crate) fn fail(&mut self, failure: &Failure) {
        if let Some(left) = self.failures_left.checked_sub(1) {
            self.failures_left = left;
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

    /// The lines at the end of the batch.
    pub(crate) fn lines(&self) -> Vec<String> {
        const MORE: &str = "(--verbose lists them)";
        let warned = self.warnings.iter().map(|(code, of_code)| {
            let WarnedInputs { count, first } = of_code;
            match count {
                1 => first.to_string(),
                _ => format!("{code} {count} files: {} {MORE}", code.title()),
            }
        });
        let failed = self.failures.iter().map(|(code, of_code)| {
            let FailedInputs { count, first } = of_code;
            let files = words::count(*count, "more file");
            match code {
                Some(code) => format!("{code} {files}: {} {MORE}", code.title()),
                None => format!("{files} failed, the first: {} {MORE}", first.message()),
            }
        });
        warned.chain(failed).collect()
    }

    /// Whether lines about results were left out.
    pub(crate) fn is_shortened(&self) -> bool {
        self.left_out > 0
    }
}
