//! Pickles of Python, files of joblib and of `torch.save`, as data. No code of a file is run: a machine of this crate
//! rebuilds numbers, texts, lists, dicts and arrays; of an object of another class it keeps only the name of the class.
//!
//! `machine` carries out the opcodes, and its children `arrays`, `joblib` and `torch` make arrays; `globals` has the
//! names of the classes and functions that are known. `values` lists the values as named arrays, like those of an NPZ
//! file, so that both use the same code for the names of arrays. `format` makes clips of them.

pub mod format;
mod globals;
mod machine;
mod values;

use std::ops::Range;
use std::path::Path;

use crate::array::{Element, NumberArray};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Format, ReadOptions};
use crate::limits::Limits;
use crate::npz::archive::{Archive, Member};
use crate::pickle::globals::shown;
use crate::pickle::machine::torch::Storages;
use crate::pickle::machine::{Machine, joblib, torch};
use crate::pickle::values::{NamedValues, Values};
use crate::source::Source;
use crate::warnings::Warnings;

/// The names of the formats.
const NAMES: [&str; 2] = ["pickle", "torch"];

/// Whether files of a format are pickles.
#[must_use]
pub fn is_pickle(format: &Format) -> bool {
    NAMES.contains(&format.name)
}

/// The values of a pickle.
pub struct Contents {
    archive: Archive,
    /// The dicts of a dict that holds nothing else, by their keys, and the number of values before each.
    dicts: Vec<(String, usize)>,
    /// Warnings about the file.
    pub warnings: Vec<Diagnostic>,
}

/// A value of a pickle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its name: of the entry `b` of a dict that is the entry `a`, `a.b`.
    pub name: String,
    /// Its shape and its type as in `NumPy`: `(31, 13) f8`; of an object that is not read, its class.
    pub kind: String,
    /// A single number or text, of which 60 characters are kept.
    pub value: Option<String>,
}

impl Contents {
    /// Reads the values of a file.
    ///
    /// # Errors
    /// When the file cannot be opened, is damaged, names a function, or exceeds the limits.
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Self, Diagnostic> {
        let source = Source::open(path, options.pipes)?;
        let file = source.name.clone();
        Self::read(
            &file,
            source.into_bytes(options.limits.file)?,
            options.limits,
        )
    }

    /// Reads the values in the bytes of a file; `file` is its name in messages.
    ///
    /// # Errors
    /// As [`Contents::open`].
    pub fn read(file: &str, bytes: Vec<u8>, limits: Limits) -> Result<Self, Diagnostic> {
        if bytes.starts_with(b"PK\x03\x04") {
            let archive = Archive::open(file, bytes, limits)?;
            let (pickle, storages) = Storages::of(&archive)?;
            let (bytes, budget) = archive.into_parts();
            return Self::of(file, "", bytes, pickle, budget, Some(&storages));
        }
        torch::refuse_other_files(file, &bytes)?;
        let budget = Budget::of(bytes.len(), limits);
        let bytes = joblib::unpacked(file, bytes, limits, &budget)?;
        let all = 0..bytes.len();
        Self::of(file, "", bytes, all, budget, None)
    }

    /// Reads the values of a pickle in a file. `name` is the name of the whole value, or empty.
    fn of(
        file: &str,
        name: &str,
        mut bytes: Vec<u8>,
        pickle: Range<usize>,
        budget: Budget,
        storages: Option<&Storages>,
    ) -> Result<Self, Diagnostic> {
        let mut warnings = Warnings::new(file);
        let machine = Machine::new(file, &bytes, pickle.clone(), &budget, storages);
        let tree = machine.run()?;
        let after = pickle.end - tree.end;
        if after > 0 {
            let message = format!("{after} bytes after the end of the pickle are not read");
            warnings.warn(Code::TrailingBytes, || (None, message));
        }
        let NamedValues {
            members,
            dicts,
            added,
        } = Values::of(file, &bytes, &tree, name, &budget, &mut warnings)?;
        bytes.extend(added);
        Ok(Self {
            archive: Archive::of_values(file, bytes, budget, members),
            dicts,
            warnings: warnings.into_list(),
        })
    }

    /// All values, in the order of the file.
    #[must_use]
    pub fn entries(&self) -> Vec<Entry> {
        let members = self.archive.members.iter().enumerate();
        let entry = |(index, member): (usize, &Member)| {
            let header = member.header.as_ref().ok()?;
            let kind = match &header.element {
                Element::Class(class) => format!("object of {class}"),
                _ => header.to_string(),
            };
            let value = || {
                let array = self.archive.array(index).ok()?;
                let number = array.numbers().and_then(|numbers| numbers.first().copied());
                let text = || array.texts().ok()?.into_iter().next();
                let value = number.map(|number| number.to_string()).or_else(text)?;
                Some(shown(&value))
            };
            Some(Entry {
                name: member.name.clone(),
                kind,
                value: value().filter(|_| header.shape.is_empty()),
            })
        };
        members.filter_map(entry).collect()
    }

    /// The numbers of a value; `None` if there is none of this name, or if it has no numbers.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<NumberArray> {
        let array = self.archive.array_named(name).ok()??;
        Some(NumberArray {
            values: array.numbers()?,
            shape: array.header.shape.clone(),
        })
    }

    /// The texts of a value; `None` if there is none of this name, or if it has no texts.
    #[must_use]
    pub fn texts(&self, name: &str) -> Option<Vec<String>> {
        self.archive.array_named(name).ok()??.texts().ok()
    }

    /// All values as an archive of arrays, and the warnings.
    pub(crate) fn into_parts(self) -> (Archive, Vec<Diagnostic>) {
        (self.archive, self.warnings)
    }
}

/// The values of an array of objects in a file, whose pickle is some of its bytes.
///
/// # Errors
/// As [`Contents::open`].
pub(crate) fn of_objects(
    file: &str,
    name: &str,
    bytes: Vec<u8>,
    pickle: Range<usize>,
    limits: Limits,
) -> Result<Contents, Diagnostic> {
    let budget = Budget::of(bytes.len(), limits);
    Contents::of(file, name, bytes, pickle, budget, None)
}
