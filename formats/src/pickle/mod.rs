//! Pickles of Python, files of joblib and of `torch.save`, as data. No code of a file is run: a machine of this crate
//! rebuilds numbers, texts, lists, dicts and arrays, and keeps objects of other classes by their names alone.
//!
//! `machine` carries out the opcodes, and its children `arrays`, `joblib` and `torch` make arrays; `globals` has the names that
//! mean something. `values` lists the values as named arrays, as those of an NPZ file, so that whatever is known of arrays'
//! names there is known here.

mod globals;
mod machine;
mod values;

use std::ops::Range;
use std::path::Path;

use crate::array::{Element, NumberArray};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::dialect;
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::limits::Limits;
use crate::npz;
use crate::npz::archive::Archive;
use crate::pickle::machine::torch::Storages;
use crate::pickle::machine::{Machine, joblib, torch};
use crate::pickle::values::{NamedValues, Values};
use crate::source::Source;
use crate::warnings::Warnings;

/// The format of pickles.
pub static FORMAT: Format = Format {
    name: "pickle",
    summary: "a pickle of Python, joblib or PyTorch, read as data: nothing in it is run",
    extensions: &["pkl", "p", "joblib", "pt", "pth", "motion", "ckpt"],
    // Protocols 0 and 1, and compressed files, are known by their extension alone.
    probe: |start| matches!(start, [0x80, 2..=5, ..]) || torch::is_archive(start),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_pickle,
    read_bytes: read_pickle,
    write: None,
    write_motion: None,
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::Skeleton,
        Feature::ClipName,
        Feature::SeveralClips,
        Feature::Translations,
        Feature::Scales,
        Feature::Scalars,
        Feature::Curves,
        Feature::World,
        Feature::UnevenTimes,
        Feature::Start,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::SourceRate,
        FormatOption::OverrideRate,
        FormatOption::Map,
        FormatOption::TimeUnit,
    ],
};

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
        torch::refuse_before_archives(file, &bytes)?;
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
        let entry = |(index, member): (usize, &npz::archive::Member)| {
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
                Some(machine::shown(&value))
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

/// Reads a pickle.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
fn open_pickle(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    loaded(Contents::open(path, options)?, options)
}

/// Reads the bytes of a pickle; `file` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_pickle(
    file: &str,
    bytes: Vec<u8>,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    loaded(Contents::read(file, bytes, options.limits)?, options)
}

fn loaded(contents: Contents, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let dicts = contents.dicts.clone();
    let (mut archive, mut warnings) = contents.into_parts();
    if options.map.is_none()
        && let Some((options, assumed)) = dialect::gvhmr::narrowed(&mut archive, options)
    {
        warnings.extend(assumed);
        let mut loaded = npz::of_values(&archive, &options)?;
        loaded.warnings.splice(0..0, warnings);
        return Ok(loaded);
    }
    let mut loaded = match npz::of_values(&archive, options) {
        // Each entry may be a clip.
        Err(error) if error.code == Code::UnknownArrays && !dicts.is_empty() => {
            clips_of_dicts(archive, &dicts, options).ok_or(error)?
        }
        read => read?,
    };
    loaded.warnings.splice(0..0, warnings);
    Ok(loaded)
}

/// The clips that are the dicts of a dict; `None` if none of them is one.
fn clips_of_dicts(
    mut archive: Archive,
    dicts: &[(String, usize)],
    options: &ReadOptions,
) -> Option<Loaded> {
    let mut all = Loaded::default();
    let mut members = std::mem::take(&mut archive.members);
    let mut is_any = false;
    for (index, (key, start)) in dicts.iter().enumerate().rev() {
        archive.members = members.split_off(*start);
        for member in &mut archive.members {
            let name = member.name.strip_prefix(&**key);
            let name = name.and_then(|name| name.strip_prefix('.'));
            member.name = name.unwrap_or_default().to_owned();
        }
        match npz::of_values(&archive, options) {
            Ok(mut loaded) => {
                is_any = true;
                for clip in &mut loaded.clips {
                    clip.name = Some(key.clone());
                    clip.index = index;
                }
                all.clips.append(&mut loaded.clips);
                for warning in loaded.warnings {
                    let known = all.warnings.iter_mut().find(|it| it.code == warning.code);
                    match known {
                        Some(known) => {
                            let count = known.count + warning.count;
                            *known = Diagnostic { count, ..warning };
                        }
                        None => all.warnings.push(warning),
                    }
                }
            }
            Err(mut error) => {
                let location = error.location.map(|location| location.to_string());
                let location = location.filter(|location| location.starts_with("['"));
                error.location = None;
                let location = location.unwrap_or_else(|| format!("['{key}']"));
                let error = error.inside(location);
                is_any |= error.code != Code::UnknownArrays;
                all.refused.push(error);
            }
        }
    }
    all.clips.reverse();
    all.refused.reverse();
    is_any.then_some(all)
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
