//! The formats of pickles: clips of the values that they hold.

use std::path::Path;

use crate::diagnostic::{Code, Diagnostic};
use crate::dialect;
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::npz;
use crate::npz::archive::Archive;
use crate::pickle::machine::torch;
use crate::pickle::{Contents, NAMES};

/// The format of pickles of Python and joblib.
pub static FORMAT: Format = Format {
    name: NAMES[0],
    summary: "a pickle of Python or joblib, read as data: nothing in it is run",
    extensions: &["pkl", "p", "joblib"],
    // Protocols 0 and 1, and compressed files, are known by their extension alone.
    probe: |start| matches!(start, [0x80, 2..=5, ..]),
    ..PICKLES
};

/// The format of files of `torch.save`.
pub static TORCH: Format = Format {
    name: NAMES[1],
    summary: "an archive of `torch.save`, read as data: nothing in it is run",
    extensions: &["pt", "pth", "motion", "ckpt"],
    probe: torch::is_archive,
    ..PICKLES
};

/// The parts that both formats have.
const PICKLES: Format = Format {
    name: "",
    summary: "",
    extensions: &[],
    probe: |_| false,
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
        FormatOption::SourceOrder,
    ],
};

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
    if options.map.is_none()
        && let Some(library) = dialect::protomotions::library(&archive, options)
    {
        let mut loaded = library?;
        loaded.warnings.splice(0..0, warnings);
        return Ok(loaded);
    }
    let mut loaded = match npz::of_values(&archive, options) {
        // The arrays are not known, but each entry of the dict may be a clip.
        Err(error) if error.code == Code::UnknownArrays && !dicts.is_empty() => {
            clips_of_dicts(archive, &dicts, options).ok_or(error)?
        }
        read => read?,
    };
    loaded.warnings.splice(0..0, warnings);
    Ok(loaded)
}

/// The clips of a dict whose values are dicts with one clip each; `None` if none of these dicts is a clip.
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
