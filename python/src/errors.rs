//! Errors as Python's exceptions. The classes are defined in `tumble/_errors.py`, because each has two
//! bases.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use pyo3::exceptions::{
    PyException, PyKeyboardInterrupt, PyMemoryError, PyOverflowError, PyRuntimeError, PyTypeError,
    PyValueError,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use tumble::crowd::CrowdError;
use tumble::{Error, InterpolationError, METHODS, SampleTimesError, TrackError};
use tumble_formats::diagnostic::{Code, Diagnostic, Location, Severity};
use tumble_formats::format::WriteError;
use tumble_formats::output::OutputError;

/// A class of `tumble._errors`.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Class {
    Input,
    Device,
    Output,
    Warning,
    Missing,
}

impl Class {
    fn of(self, py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
        static CLASSES: [PyOnceLock<Py<PyType>>; 5] = [const { PyOnceLock::new() }; 5];
        let name = match self {
            Self::Input => "InputError",
            Self::Device => "DeviceError",
            Self::Output => "OutputError",
            Self::Warning => "InputWarning",
            Self::Missing => "MissingFileError",
        };
        CLASSES[self as usize].import(py, "tumble._errors", name)
    }

    /// An object of this class with this message; `found` are the details of a diagnostic. The class is Python
    /// code, which Ctrl-C interrupts: then the error is that interrupt.
    fn object<'py>(
        self,
        py: Python<'py>,
        message: &str,
        found: &FaultDetails,
    ) -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(py);
        fields.set_item("code", found.code)?;
        fields.set_item("file", &found.file)?;
        fields.set_item("line", found.line)?;
        fields.set_item("column", found.column)?;
        fields.set_item("pointer", &found.pointer)?;
        self.of(py)?.call((message,), Some(&fields))
    }

    /// An exception with this message, or the interrupt that came while it was made.
    pub(crate) fn error(self, message: &str, found: &FaultDetails) -> PyErr {
        let made = Python::try_attach(|py| {
            let object = self.object(py, message, found);
            object.map_or_else(|error| error, PyErr::from_value)
        });
        // At the interpreter's shutdown no exception object can be created. The error is dropped: no Python code runs
        // any more that could catch it.
        made.unwrap_or_else(|| PyRuntimeError::new_err(message.to_owned()))
    }
}

/// The code and the location of a fault, which exceptions carry in addition to their message.
#[derive(Debug, Default)]
pub(crate) struct FaultDetails {
    code: Option<&'static str>,
    file: Option<String>,
    line: Option<u64>,
    column: Option<u64>,
    pointer: Option<String>,
}

impl From<&Diagnostic> for FaultDetails {
    fn from(diagnostic: &Diagnostic) -> Self {
        let mut found = Self {
            code: Some(diagnostic.code.name()),
            file: Some(diagnostic.file.clone()),
            ..Self::default()
        };
        match &diagnostic.location {
            Some(Location::Text { line, column }) => {
                (found.line, found.column) = (Some(*line), Some(*column));
            }
            Some(Location::Inside(pointer)) => found.pointer = Some(pointer.clone()),
            None => {}
        }
        found
    }
}

/// The exception for an invalid argument.
pub(crate) fn input(message: impl AsRef<str>) -> PyErr {
    Class::Input.error(message.as_ref(), &FaultDetails::default())
}

/// The exception for an invalid argument, with the code that the program uses for the same error in a file, and the
/// position in the arrays.
pub(crate) fn input_at(message: &str, code: Code, pointer: String) -> PyErr {
    let found = FaultDetails {
        code: Some(code.name()),
        pointer: Some(pointer),
        ..FaultDetails::default()
    };
    Class::Input.error(message, &found)
}

/// Replaces the program's options in a message by Python's keywords: `--map time=NAME` becomes
/// `map="time=NAME"`.
pub(crate) fn in_python(message: &str) -> String {
    const WORDS: [(&str, &str); 13] = [
        (
            "--time-unit s, ms, us or ns",
            r#"time_unit="s", "ms", "us" or "ns""#,
        ),
        (
            "--time-unit ms, us or ns",
            r#"time_unit="ms", "us" or "ns""#,
        ),
        (
            "--duplicates first or --duplicates last keeps one of them, --duplicates both makes a jump",
            r#"duplicates="first" or "last" keeps one of them, "both" makes a jump"#,
        ),
        (
            "--duplicates first or last",
            r#"duplicates="first" or "last""#,
        ),
        ("--linear NAME, in Python linear=[NAME]", "linear=[NAME]"),
        ("`tumble eval --fps`", "`fps`"),
        ("--animation", "its name or index"),
        ("; --tracks chooses some", ""),
        ("`--by exact`", r#"`by="exact"`"#),
        ("`--by edges`", r#"`by="edges"`"#),
        ("--weld DISTANCE", "weld=DISTANCE"),
        ("--source-fps FPS", "source_fps=FPS"),
        (" (with `tumble eval`)", ""),
    ];
    const FLAGS: [&str; 5] = [
        "bridge_gaps",
        "keyframes",
        "overwrite",
        "raw_times",
        "world",
    ];
    let message = WORDS
        .iter()
        .fold(message.to_owned(), |message, (program, python)| {
            message.replace(program, python)
        });
    let message = METHODS.iter().fold(message, |message, method| {
        let name = method.name;
        message.replace(&format!("`-m {name}`"), &format!("method=\"{name}\""))
    });
    let mut parts = message.split("--");
    let mut spoken = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let is_name = |c: char| c.is_ascii_lowercase() || c == '-';
        let end = part.find(|c| !is_name(c)).unwrap_or(part.len());
        let (name, rest) = part.split_at(end);
        if name.is_empty() || spoken.ends_with(|c: char| c.is_alphanumeric() || c == '-') {
            spoken.push_str("--");
            spoken.push_str(part);
            continue;
        }
        let name = name.replace('-', "_");
        let value = rest.strip_prefix(' ').unwrap_or_default();
        let value = value.split(' ').next().unwrap_or_default();
        let value = value.trim_end_matches([';', ',', '`']);
        spoken.push_str(&name);
        match value.contains('=') {
            true => {
                spoken.push_str(&format!("=\"{value}\""));
                spoken.push_str(&rest[1 + value.len()..]);
            }
            false => {
                spoken.push_str(if FLAGS.contains(&&*name) { "=True" } else { "" });
                spoken.push_str(rest);
            }
        }
    }
    spoken
}

/// The exception or warning of a diagnostic about a file.
pub(crate) fn of_diagnostic(diagnostic: &Diagnostic) -> PyErr {
    let is_missing = || !Path::new(&diagnostic.file).exists();
    let class = match diagnostic.code.severity() {
        Severity::Error if diagnostic.code == Code::Open && is_missing() => Class::Missing,
        Severity::Error => Class::Input,
        Severity::Warning => Class::Warning,
    };
    class.error(&in_python(&diagnostic.to_string()), &diagnostic.into())
}

/// Issues warnings about files: one for each code, at the line that called the package.
pub(crate) fn warn<'a>(
    py: Python<'_>,
    diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
) -> PyResult<()> {
    let mut kinds: Vec<Vec<&Diagnostic>> = Vec::new();
    for diagnostic in diagnostics {
        let known = kinds
            .iter_mut()
            .find(|kind| kind[0].code == diagnostic.code);
        match known {
            Some(kind) => kind.push(diagnostic),
            None => kinds.push(vec![diagnostic]),
        }
    }
    for kind in kinds {
        let messages: Vec<String> = kind.iter().map(ToString::to_string).collect();
        warn_once(py, &messages, &kind[0].into())?;
    }
    Ok(())
}

/// Issues one warning about arguments with all `messages`, which are of one kind.
pub(crate) fn warn_of(py: Python<'_>, messages: &[String]) -> PyResult<()> {
    match messages.is_empty() {
        true => Ok(()),
        false => warn_once(py, messages, &FaultDetails::default()),
    }
}

/// The largest number of messages in a warning.
const MAX_MESSAGES: usize = 8;

fn warn_once(py: Python<'_>, messages: &[String], details: &FaultDetails) -> PyResult<()> {
    let shown = &messages[..messages.len().min(MAX_MESSAGES)];
    let mut message = shown.join("\n");
    match messages.len() - shown.len() {
        0 => {}
        more => message.push_str(&format!("\nand {more} more of this kind")),
    }
    let warning = Class::Warning.object(py, &in_python(&message), details)?;
    py.import("tumble._errors")?
        .call_method1("warn", (warning,))?;
    Ok(())
}

/// Replaces the error of a conversion by one that names the expected type. Other errors stay as they are: Ctrl-C, for
/// example, interrupts conversions that run Python code.
pub(crate) fn expected(py: Python<'_>, error: PyErr, message: impl FnOnce() -> String) -> PyErr {
    let is_conversion = error.is_instance_of::<PyTypeError>(py)
        || error.is_instance_of::<PyValueError>(py)
        || error.is_instance_of::<PyOverflowError>(py);
    match is_conversion {
        true => PyTypeError::new_err(message()),
        false => error,
    }
}

/// Whether an object has an attribute. An exception of the object counts as no; Ctrl-C is passed on.
pub(crate) fn has_attribute(of: &Bound<'_, PyAny>, name: &str) -> PyResult<bool> {
    match of.hasattr(name) {
        Err(error) if error.is_instance_of::<PyException>(of.py()) => Ok(false),
        found => found,
    }
}

/// The exception for invalid keys.
pub(crate) fn of_track(error: &TrackError) -> PyErr {
    of_track_since(0, error)
}

/// Like [`of_track`], for times that are stored relative to a whole second (`time_offset`).
pub(crate) fn of_track_since(second: i64, error: &TrackError) -> PyErr {
    let mut message = error.to_string();
    if second != 0 && matches!(error, TrackError::TimeNotIncreasing { .. }) {
        message.push_str(&format!(" (times are counted from second {second})"));
    }
    let at = |name: &str, track: usize, key: usize| format!("{name}[{track}][{key}]");
    match *error {
        TrackError::TimeNotFinite { track, key, .. } => {
            input_at(&message, Code::NotFinite, at("times", track, key))
        }
        TrackError::TimeOutOfRange { track, key, .. } => {
            input_at(&message, Code::TooLarge, at("times", track, key))
        }
        TrackError::TimeNotIncreasing { track, key, .. } => {
            input_at(&message, Code::TimeNotIncreasing, at("times", track, key))
        }
        TrackError::NotUnit { track, key, norm } if norm.is_finite() => {
            input_at(&message, Code::Norm, at("keys", track, key))
        }
        TrackError::NotUnit { track, key, .. } => {
            input_at(&message, Code::NotFinite, at("keys", track, key))
        }
        TrackError::DataTooLarge {
            track,
            key,
            quantity,
            ..
        } => input_at(&message, Code::TooLarge, at(quantity, track, key)),
        TrackError::DataNotFinite {
            track,
            key,
            quantity,
        } => input_at(&message, Code::NotFinite, at(quantity, track, key)),
        _ => input(message),
    }
}

/// The exception for a failed evaluation.
pub(crate) fn of_engine(error: &Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Vulkan(_)
        | Error::Threads(_)
        | Error::ExportOnCpu
        | Error::Crowd(CrowdError::Vulkan(_) | CrowdError::Threads(_)) => device(&message),
        Error::Stopped(_) | Error::Crowd(CrowdError::Stopped(_)) => {
            PyKeyboardInterrupt::new_err(message)
        }
        Error::OutOfMemory(_) | Error::Crowd(CrowdError::OutOfMemory(_)) => {
            PyMemoryError::new_err(message)
        }
        Error::SampleTimes(SampleTimesError::TimeNotFinite { index, .. }) => {
            input_at(&message, Code::NotFinite, format!("at[{index}]"))
        }
        Error::Interpolation(
            InterpolationError::Antipodal { track, .. }
            | InterpolationError::OpenLoop { track, .. },
        ) => Class::Input.error(
            &message,
            &FaultDetails {
                pointer: Some(format!("keys[{track}]")),
                ..FaultDetails::default()
            },
        ),
        _ => input(message),
    }
}

/// The exception for a device that cannot be used.
pub(crate) fn device(message: &str) -> PyErr {
    Class::Device.error(message, &FaultDetails::default())
}

/// The exception for an output that cannot be written.
pub(crate) fn output(message: &str) -> PyErr {
    Class::Output.error(message, &FaultDetails::default())
}

pub(crate) fn of_output(error: &OutputError) -> PyErr {
    output(&in_python(&error.to_string()))
}

pub(crate) fn of_write(error: &WriteError) -> PyErr {
    match error {
        WriteError::Io(error) => output(&error.to_string()),
        WriteError::Refused(diagnostic) => of_diagnostic(diagnostic),
    }
}

/// Runs `work`; a panic, which is a bug of ours, becomes an exception that asks for a report.
pub(crate) fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(of_panic(&*panic)))
}

fn of_panic(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let message = text.or_else(|| panic.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!(
        "internal error: {}; this is a bug in tumble {}: please report it with the call and, if \
         they can be shared, its arguments",
        message.unwrap_or("no reason given"),
        env!("CARGO_PKG_VERSION"),
    ))
}
