//! Arrays of scalars: where their numbers are, and how they are read and written.

use std::collections::HashSet;
use std::io;

use tumble::Layout;
use tumble::names::counted;

use crate::array::shape_text;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::map::Entry;
use crate::motion::{Motion, SampledClip, Scalar, ScalarKind};
use crate::names::unique_name;
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, read_numbers};
use crate::warnings::Warnings;

/// A degree in radians.
pub(crate) const RADIANS: f64 = std::f64::consts::PI / 180.0;

/// Bytes of memory of a number while it is read and as a key.
const NUMBER: usize = 24;

/// An array with a number of each scalar for each frame.
#[derive(Debug, Clone)]
pub(crate) struct ScalarArray {
    pub(crate) member: usize,
    /// Frames or scalars first.
    pub(crate) layout: Layout,
    /// The first of its columns (of rows, scalars first) that is a scalar.
    first: usize,
    /// The factor for its numbers.
    factor: f64,
    pub(crate) scalars: Vec<(String, Scalar)>,
}

impl ArchivePlan {
    /// Adds the scalars that an entry of a map names: of an array (frames), or columns of one (frames, numbers).
    ///
    /// # Errors
    /// When the shape is another.
    pub(in crate::npz) fn add_scalar_columns(
        &mut self,
        archive: &Archive,
        member: usize,
        entry: &Entry,
        (kind, is_degrees): (ScalarKind, bool),
    ) -> Result<(), Diagnostic> {
        let shape = &*archive.header(member)?.shape;
        let (frames, width) = match *shape {
            [frames] => (frames, 1),
            [frames, width] => (frames, width),
            _ => (0, 0),
        };
        let columns = entry.columns.clone().unwrap_or(0..width);
        let is_first = self.parts.is_empty() && self.scalars.is_empty();
        if columns.end > width || columns.is_empty() || !is_first && frames != self.frames {
            let shape = shape_text(shape);
            let message = format!(
                "the array has shape {shape}; scalars are (frames) or (frames, numbers), of as many frames as the \
                 others, `[3]` chooses a column"
            );
            return Err(archive.refuse(member, Code::Shape, message));
        }
        self.frames = frames;
        self.scalars.push(ScalarArray {
            member,
            layout: Layout::FrameMajor,
            first: columns.start,
            factor: if is_degrees { RADIANS } else { 1.0 },
            scalars: entry
                .scalar_names(columns.len())
                .map(|name| (name, Scalar::of(kind)))
                .collect(),
        });
        Ok(())
    }

    /// Adds the scalars of an array from its column `first` on. `names` has the name of each; without, they are named
    /// `joint_0`, `joint_1` …, with a warning.
    ///
    /// # Errors
    /// When the shape is another, or the names are not as many.
    pub(crate) fn add_scalars(
        &mut self,
        archive: &Archive,
        (member, layout, first): (usize, Layout, usize),
        names: Option<Vec<String>>,
        kind: impl Fn(usize) -> ScalarKind,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        let shape = &*archive.header(member)?.shape;
        let counts = match (shape, layout) {
            (&[frames, columns], Layout::FrameMajor) => Some((frames, columns)),
            (&[rows, frames], Layout::TrackMajor) => Some((frames, rows)),
            _ => None,
        };
        let count = counts.filter(|&(frames, columns)| frames == self.frames && columns >= first);
        let Some((_, columns)) = count else {
            let expected = match layout {
                Layout::FrameMajor => format!("({}, scalars)", self.frames),
                Layout::TrackMajor => format!("(scalars, {})", self.frames),
            };
            let message = format!(
                "the array has shape {}; {expected} is expected",
                shape_text(shape)
            );
            return Err(archive.refuse(member, Code::Shape, message));
        };
        let count = columns - first;
        if let Some(names) = names.as_ref().filter(|names| names.len() != count) {
            let [names, scalars] = [(names.len(), "name"), (count, "scalar")]
                .map(|(count, noun)| counted(count, noun));
            let message = format!("{names} for {scalars}");
            return Err(archive.refuse(member, Code::Shape, message));
        }
        let names = names.unwrap_or_else(|| {
            warnings.warn(Code::UnnamedJoints, || {
                let message = format!(
                    "the file does not name its joints ({count}); they are called joint_0, joint_1 …, in the order of the file; --robot FILE gives them \
                     the names of the robot's joints"
                );
                (None, message)
            });
            (0..count).map(|index| format!("joint_{index}")).collect()
        });
        let mut used = HashSet::new();
        let scalar = |(index, name): (usize, String)| {
            let unique = unique_name(name.clone(), index, &mut used);
            if unique != name {
                warnings.warn(Code::SameName, || {
                    let message =
                        format!("two joints are called `{name}`; the second becomes `{unique}`");
                    (None, message)
                });
            }
            (unique, Scalar::of(kind(index)))
        };
        self.scalars.push(ScalarArray {
            member,
            layout,
            first,
            factor: 1.0,
            scalars: names.into_iter().enumerate().map(scalar).collect(),
        });
        Ok(())
    }
}

impl ScalarArray {
    /// Adds the scalars to a clip, with the frames that `kept` chooses.
    pub(crate) fn read(
        &self,
        archive: &Archive,
        (times, kept): (&[f64], &[usize]),
        clip: &mut Motion,
    ) -> Result<(), Diagnostic> {
        let shape = archive.header(self.member)?.shape.clone();
        let all = shape.iter().product::<usize>();
        archive.take(all, NUMBER)?;
        let numbers = read_numbers(archive, self.member)?;
        let width = shape.get(1).copied().unwrap_or(1);
        for (index, (name, scalar)) in self.scalars.iter().enumerate() {
            let at = |frame: usize| match self.layout {
                Layout::FrameMajor => frame * width + self.first + index,
                Layout::TrackMajor => (self.first + index) * width + frame,
            };
            let keys: Vec<f32> = kept
                .iter()
                .map(|&frame| (numbers[at(frame)] * self.factor) as f32)
                .collect();
            if let Some(bad) = keys.iter().position(|key| !key.is_finite()) {
                let number = numbers[at(kept[bad])];
                let location = match self.layout {
                    Layout::FrameMajor => format!("{}, {}", kept[bad], self.first + index),
                    Layout::TrackMajor => format!("{}, {}", self.first + index, kept[bad]),
                };
                let message = format!("{number} is not a finite number of f32");
                let mut refusal = archive.refuse(self.member, Code::NotFinite, message);
                let member = &archive.members[self.member];
                let name = match member.path.ends_with(".npy") {
                    true => &member.name,
                    false => &member.path,
                };
                refusal.location = Some(Location::Inside(format!("{name}[{location}]")));
                return Err(refusal);
            }
            let added = clip.add_scalar(*scalar, name, times, &keys, &[]);
            added.map_err(|error| {
                let message = format!("the scalar `{name}` cannot be kept: {error}");
                archive.refuse(self.member, Code::TooLarge, message)
            })?;
        }
        Ok(())
    }
}

/// Passes some of the scalars of samples, from `first` on, to `put`.
pub(in crate::npz) fn put(
    sampled: &SampledClip<'_>,
    (first, count): (usize, usize),
    layout: Layout,
    put: &mut dyn FnMut(f64) -> io::Result<()>,
) -> io::Result<()> {
    let frames = sampled.times.len();
    let mut number = |frame: usize, index: usize| put(sampled.scalar_value(frame, first + index));
    match layout {
        Layout::FrameMajor => {
            (0..frames).try_for_each(|frame| (0..count).try_for_each(|index| number(frame, index)))
        }
        Layout::TrackMajor => {
            (0..count).try_for_each(|index| (0..frames).try_for_each(|frame| number(frame, index)))
        }
    }
}
