//! Arrays whose meaning a user specifies: `rotations=keys:wxyz,time=t`.
//!
//! `rotations`, `translations`, `scales`, `time`, `names`, `parents` and `fps` are the arrays of these data. Any
//! other name is that of a track with the quaternions in the array.

use tumble::Layout;

use crate::array::shape_text;
use crate::diagnostic::{Code, Diagnostic};
use crate::map::{Entry, Map};
use crate::npz::archive::Archive;
use crate::npz::array::Strides;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind, TimeList, check_float};
use crate::rotation_form::RotationForm;

/// Names in a map that are not tracks.
const ROLES: [&str; 7] = [
    "rotations",
    "translations",
    "scales",
    "time",
    "names",
    "parents",
    "fps",
];

/// Makes the plan of a map.
pub(crate) fn plan(archive: &Archive, map: &Map) -> Result<ArchivePlan, Diagnostic> {
    let mut plan = ArchivePlan::default();
    if let Some(time) = map.get("time") {
        let member = source(archive, time)?;
        let columns = time.columns.clone().unwrap_or(0..1);
        plan.times = Some(TimeList {
            member,
            column: columns.start,
        });
        let shape = shape_of(archive, member)?;
        let is_list = match *shape {
            [_] => time.columns.is_none(),
            [_, width] => columns.len() == 1 && columns.start < width && time.columns.is_some(),
            _ => false,
        };
        if !is_list {
            let message = format!(
                "the array has shape {}; times are a list, or a column such as [0] of one",
                shape_text(shape)
            );
            return Err(archive.refuse(member, Code::Shape, message));
        }
    }
    let lengths = Lengths {
        frames: match plan.times {
            Some(list) => shape_of(archive, list.member)?.first().copied(),
            None => None,
        },
        tracks: match map.get("names").or(map.get("parents")) {
            Some(entry) => shape_of(archive, source(archive, entry)?)?.first().copied(),
            None => None,
        },
    };
    if let Some(entry) = map.get("rotations") {
        let part = part(archive, entry, rotations(entry), 0, lengths)?;
        plan.add(archive, part)?;
    }
    let mut names = vec![String::new(); plan.tracks];
    for entry in &map.entries {
        if ROLES.contains(&&*entry.name) || entry.scalar.is_some() {
            continue;
        }
        let part = part(archive, entry, rotations(entry), plan.tracks, lengths)?;
        plan.add(archive, part)?;
        names.resize(plan.tracks, entry.name.clone());
    }
    for entry in &map.entries {
        if let Some(kind) = entry.scalar {
            let scalars = (kind, entry.is_scalar_in_degrees);
            plan.add_scalar_columns(archive, source(archive, entry)?, entry, scalars)?;
        }
    }
    if plan.tracks == 0 && plan.scalars.is_empty() {
        let message = "the map names no rotations; give `rotations=ARRAY`, `TRACK=ARRAY` or `NAME=ARRAY:scalar`";
        return Err(Diagnostic::new(&archive.file, Code::Map, message));
    }
    plan.names = names;
    for (name, values) in [
        ("translations", KeyKind::Translation),
        ("scales", KeyKind::Scale),
    ] {
        if let Some(entry) = map.get(name) {
            let part = part(archive, entry, values, 0, lengths)?;
            plan.add(archive, part)?;
        }
    }
    for (name, read) in [
        (
            "names",
            ArchivePlan::read_names as fn(&mut _, &_, &str) -> _,
        ),
        ("parents", ArchivePlan::read_parents),
        (
            "fps",
            |plan: &mut ArchivePlan, archive: &Archive, name: &str| {
                plan.read_rate(archive, &[name])
            },
        ),
    ] {
        if let Some(entry) = map.get(name) {
            source(archive, entry)?;
            read(&mut plan, archive, &entry.source)?;
        }
    }
    Ok(plan)
}

/// The form of the rotations in an array.
fn rotations(entry: &Entry) -> KeyKind {
    match entry.form() {
        RotationForm::Quaternion(order) => KeyKind::Quaternion(order),
        form => KeyKind::Form(form),
    }
}

/// The known lengths of axes, before arrays are read.
#[derive(Clone, Copy)]
struct Lengths {
    frames: Option<usize>,
    tracks: Option<usize>,
}

/// The member that an entry names.
fn source(archive: &Archive, entry: &Entry) -> Result<usize, Diagnostic> {
    archive.find(&entry.source).ok_or_else(|| {
        let message = format!(
            "the map's array `{}` is not in the file; there are {}",
            entry.source,
            archive.listing()
        );
        Diagnostic::new(&archive.file, Code::Map, message)
    })
}

fn shape_of(archive: &Archive, member: usize) -> Result<&[usize], Diagnostic> {
    Ok(&archive.header(member)?.shape)
}

/// An array of one track (frames, numbers), or of several, whose axes are recognised by their lengths.
fn part(
    archive: &Archive,
    entry: &Entry,
    values: KeyKind,
    first_track: usize,
    lengths: Lengths,
) -> Result<(KeyArray, usize), Diagnostic> {
    let member = source(archive, entry)?;
    check_float(archive, member)?;
    let header = archive.header(member)?;
    let (mut shape, mut strides) = (header.shape.clone(), header.strides());
    // A matrix may be stored in two axes, if its rows follow each other in memory.
    if values == KeyKind::Form(RotationForm::Matrix)
        && let [.., 3, 3] = shape[..]
        && let [.., rows, columns] = strides[..]
        && rows == 3 * columns
    {
        shape.truncate(shape.len() - 2);
        shape.push(9);
        strides.remove(strides.len() - 2);
    }
    let shape = &*shape;
    if values == KeyKind::Form(RotationForm::Matrix)
        && let [.., 3, 3] = *shape
        && shape.len() > 2
    {
        let message = format!(
            "the array has shape {} in Fortran's order; matrices are read in C's: save it with \
             numpy.ascontiguousarray",
            shape_text(shape)
        );
        return Err(archive.refuse(member, Code::Shape, message));
    }
    let refuse = |code, message: String| archive.refuse(member, code, message);
    if shape.contains(&0) {
        let message = format!("the array has shape {}: no keys", shape_text(shape));
        return Err(refuse(Code::Shape, message));
    }
    let axes = shape.len();
    let width = values.width();
    let last = shape.last().copied().unwrap_or(0);
    let columns = entry.columns.clone().unwrap_or(0..last);
    if !(axes == 2 || axes == 3) || columns.end > last || columns.len() != width {
        let message = format!(
            "the array has shape {}; a key needs {width} numbers: (frames, {width}), or with an axis of tracks; \
             `[3:7]` selects a part of a longer axis",
            shape_text(shape)
        );
        return Err(refuse(Code::Shape, message));
    }
    let layout = match (axes, entry.layout) {
        (2, _) => Layout::FrameMajor,
        (_, Some(layout)) => layout,
        _ => layout_by_lengths(shape, lengths).map_err(|(code, why)| refuse(code, why))?,
    };
    let (track, frame) = match (axes, layout) {
        (2, _) => ((0, 1), (strides[0], shape[0])),
        (_, Layout::TrackMajor) => ((strides[0], shape[0]), (strides[1], shape[1])),
        (_, Layout::FrameMajor) => ((strides[1], shape[1]), (strides[0], shape[0])),
    };
    let part = KeyArray {
        member,
        kind: values,
        tracks: first_track..first_track + track.1,
        layout,
        at: Strides {
            first: columns.start * strides[axes - 1],
            track: track.0,
            frame: frame.0,
            component: strides[axes - 1],
        },
    };
    Ok((part, frame.1))
}

/// The layout of an array: the axis of frames is as long as the times, or the other axis is as long as the names.
fn layout_by_lengths(shape: &[usize], lengths: Lengths) -> Result<Layout, (Code, String)> {
    let fits = |tracks: usize, frames: usize| {
        lengths.frames.is_none_or(|known| known == frames)
            && lengths.tracks.is_none_or(|known| known == tracks)
    };
    let text = shape_text(shape);
    match (fits(shape[0], shape[1]), fits(shape[1], shape[0])) {
        (true, false) => Ok(Layout::TrackMajor),
        (false, true) => Ok(Layout::FrameMajor),
        (true, true) => {
            let message = format!(
                "shape {text} may be (tracks, frames, …) or (frames, tracks, …); say which axis \
                 comes first: `--map rotations=ARRAY:track` or `…:frame`"
            );
            Err((Code::Ambiguous, message))
        }
        (false, false) => {
            let describe = |axis, known: Option<usize>| known.map(|n| format!("{n} {axis}"));
            let known = [
                describe("times", lengths.frames),
                describe("names", lengths.tracks),
            ];
            let known: Vec<String> = known.into_iter().flatten().collect();
            let message = format!("shape {text} does not go with {}", known.join(" and "));
            Err((Code::Shape, message))
        }
    }
}
