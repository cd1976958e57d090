//! NPZ, archives of `NumPy` arrays, and single arrays (NPY): motion of SMPL bodies, motion of bodies in the world,
//! Tumble's layout, and arrays whose meaning the option `--map` specifies.
//!
//! `archive` lists the arrays without unpacking them. `tumble_layout`, `smpl`, `world_bodies` or `mapped` recognises
//! their meaning and makes a `plan`; `clip` reads the arrays of a plan as a clip. `document` keeps the archive and
//! the plan, so that the file can be written again in its layout; `write` writes clips of other formats.

pub(crate) mod archive;
pub(crate) mod array;
mod body_model;
mod clip;
mod document;
mod linear;
mod mapped;
pub(crate) mod plan;
pub(crate) mod rotation_vector;
pub(crate) mod smpl;
mod tumble_layout;
mod world_bodies;
pub mod write;

use std::path::Path;
use std::sync::Arc;

pub use crate::array::NumberArray;
use crate::diagnostic::{Code, Diagnostic};
use crate::dialect;
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::map::Map;
use crate::npz::archive::{Archive, ONLY_ARRAY};
pub use crate::npz::body_model::body_offsets;
use crate::npz::document::NpzDocument;
use crate::npz::plan::ArchivePlan;
use crate::pickle;
use crate::source::Source;
use crate::warnings::Warnings;

/// The NPZ format: archives of `NumPy` arrays.
pub static FORMAT: Format = Format {
    name: "npz",
    summary: "a NumPy archive: motion of AMASS and SMPL, or arrays of Tumble",
    extensions: &[],
    // A local file header, or the end of an archive without files.
    probe: |start| start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06"),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_npz,
    read_bytes: read_npz,
    write: None,
    write_motion: Some(write::write_npz),
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::ClipName,
        Feature::Skeleton,
        Feature::RestRotations,
        Feature::Translations,
        Feature::Scales,
        Feature::Scalars,
        Feature::Limits,
        Feature::Steps,
        Feature::Lines,
        Feature::Curves,
        Feature::Bvh,
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
        FormatOption::Linear,
    ],
};

/// Reads an NPZ file.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
fn open_npz(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let file = source.name.clone();
    read_npz(&file, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of an NPZ file; `file` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_npz(file: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let archive = Archive::open(file, bytes, options.limits)?;
    let read = match map(file, options)? {
        Some(_) => of_values(&archive, options).map(|loaded| (None, loaded)),
        None => read_known(&archive, options).map(|(plan, loaded)| (Some(plan), loaded)),
    };
    match read {
        Ok((Some(plan), loaded)) if !plan.is_part => {
            let document = NpzDocument::new(archive, plan, &loaded.clips[0]);
            Ok(Loaded {
                document: Some(Arc::new(document)),
                ..loaded
            })
        }
        Ok((_, loaded)) => Ok(loaded),
        Err(error) => match error.code {
            // If an archive has arrays of objects, they may contain the keys.
            Code::Pickled | Code::UnknownArrays | Code::Map if archive.has_objects() => {
                read_with_objects(archive, options)
            }
            _ => Err(error),
        },
    }
}

/// Reads an archive in which arrays of objects are replaced with the objects' values.
fn read_with_objects(mut archive: Archive, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let mut warnings = Vec::new();
    for index in (0..archive.members.len()).rev() {
        if let Some(start) = archive.members[index].objects() {
            // The file is a single array.
            let name = match archive.members[index].path.is_empty() {
                true => String::new(),
                false => archive.members[index].name.clone(),
            };
            let bytes = archive.unpack(index)?.into_owned();
            let pickle = start..bytes.len();
            let file = archive.file.clone();
            let read = pickle::of_objects(&file, &name, bytes, pickle, options.limits);
            let path = &archive.members[index].path;
            let at_member = |error: Diagnostic| match &error.location {
                Some(location) => error.clone().inside(format!("{path}:{location}")),
                None => error.inside(path),
            };
            let (values, mut found) = read.map_err(at_member)?.into_parts();
            archive.replace(index, values)?;
            warnings.append(&mut found);
        }
    }
    let mut loaded = of_values(&archive, options)?;
    loaded.warnings.splice(0..0, warnings);
    Ok(loaded)
}

/// Reads arrays whose names are known.
fn read_known(
    archive: &Archive,
    options: &ReadOptions,
) -> Result<(ArchivePlan, Loaded), Diagnostic> {
    let mut warnings = Warnings::new(&archive.file);
    let plan = match tumble_layout::plan(archive, &mut warnings)? {
        Some(plan) => Some(plan),
        None => match smpl::plan(archive, &mut warnings)? {
            Some(plan) => Some(plan),
            None => match world_bodies::plan(archive, &mut warnings)? {
                Some(plan) => Some(plan),
                None => dialect::plan(archive, &mut warnings)?,
            },
        },
    };
    let mut plan = plan.ok_or_else(|| {
        if let Some(message) = dialect::misfit(archive) {
            return Diagnostic::new(&archive.file, Code::Shape, message);
        }
        if smpl::is_body_alone(archive) {
            let message = format!(
                "has the shape of a body and no motion, so it is no clip; there are {}",
                archive.listing()
            );
            return Diagnostic::new(&archive.file, Code::BodyAlone, message);
        }
        let unreadable = archive.unreadable().map_or(String::new(), |arrays| {
            format!("; the headers of these cannot be read: {arrays}")
        });
        let message = format!(
            "no array has a known name (poses, rotations, body_rotations); say what they \
             are with --map rotations=ARRAY:wxyz,time=ARRAY; there are {}{unreadable}",
            archive.listing()
        );
        Diagnostic::new(&archive.file, Code::UnknownArrays, message)
    })?;
    if let Some(order) = options.source_order {
        plan.set_order(archive, order)?;
    }
    let loaded = read_plan(archive, &mut plan, options, warnings)?;
    Ok((plan, loaded))
}

/// Reads the arrays of a plan.
pub(crate) fn read_plan(
    archive: &Archive,
    plan: &mut ArchivePlan,
    options: &ReadOptions,
    mut warnings: Warnings,
) -> Result<Loaded, Diagnostic> {
    let clip = clip::read(archive, plan, options, &mut warnings)?;
    plan.warn_of_others(archive, options, &mut warnings);
    Ok(Loaded::of(clip, warnings.into_list()))
}

/// Reads arrays as those of an NPZ file that is not written again.
///
/// # Errors
/// When their meaning is not known, or they are no motion.
pub(crate) fn of_values(archive: &Archive, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    match map(&archive.file, options)? {
        Some(map) => read_mapped(archive, &map, options),
        None => Ok(read_known(archive, options)?.1),
    }
}

/// Reads arrays whose meaning a map specifies.
fn read_mapped(archive: &Archive, map: &Map, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let mut plan = mapped::plan(archive, map)?;
    read_plan(archive, &mut plan, options, Warnings::new(&archive.file))
}

/// Reads the numbers of an NPY file.
///
/// # Errors
/// When the file cannot be opened, is invalid, or contains anything but numbers; the first error is returned.
pub fn open_numbers(path: &Path, options: &ReadOptions) -> Result<NumberArray, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let file = source.name.clone();
    let archive = Archive::single(
        &file,
        source.into_bytes(options.limits.file)?,
        options.limits,
    );
    let array = archive.array(0)?;
    let values = array.numbers().ok_or_else(|| {
        let message = format!("holds {}, no numbers", array.header.element);
        archive.refuse(0, Code::UnknownArrays, message)
    })?;
    Ok(NumberArray {
        shape: array.header.shape.clone(),
        values,
    })
}

/// Reads an NPY file.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub(crate) fn open_npy(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let file = source.name.clone();
    read_npy(&file, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of an NPY file; `file` is the input's name in messages. The array is called `arr_0`. It contains
/// quaternions x y z w unless the options' `map` specifies otherwise.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_npy(file: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let archive = Archive::single(file, bytes, options.limits);
    if archive.has_objects() {
        return read_with_objects(archive, options);
    }
    let mut warnings = Warnings::new(file);
    let map = match map(file, options)? {
        Some(map) => map,
        None => Map::of_rotations(ONLY_ARRAY),
    };
    let mut plan = mapped::plan(&archive, &map)?;
    let clip = clip::read(&archive, &mut plan, options, &mut warnings)?;
    Ok(Loaded::of(clip, warnings.into_list()))
}

fn map(file: &str, options: &ReadOptions) -> Result<Option<Map>, Diagnostic> {
    let parsed = options.map.as_deref().map(str::parse::<Map>).transpose();
    parsed.map_err(|error| Diagnostic::new(file, Code::Map, format!("--map: {error}")))
}
