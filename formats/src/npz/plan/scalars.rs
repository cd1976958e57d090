//! Arrays of scalars: where their numbers are, and how they are read and written.

use std::io;

use tumble::Layout;

use crate::array::shape_text;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::motion::{Motion, SampledClip, Scalar, ScalarKind};
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, read_numbers};
use crate::warnings::Warnings;

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
    pub(crate) scalars: Vec<(String, Scalar)>,
}

impl ArchivePlan {
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
            let message = format!("{} names for {count} scalars", names.len());
            return Err(archive.refuse(member, Code::Shape, message));
        }
        let names = names.unwrap_or_else(|| {
            warnings.warn(Code::UnnamedJoints, || {
                let message = format!(
                    "the file does not name its {count} joints; they are called joint_0, joint_1 …, in the order of the file"
                );
                (None, message)
            });
            (0..count).map(|index| format!("joint_{index}")).collect()
        });
        let scalar = |(index, name)| (name, Scalar::of(kind(index)));
        self.scalars.push(ScalarArray {
            member,
            layout,
            first,
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
        for (index, (name, scalar)) in self.scalars.iter().enumerate() {
            let at = |frame: usize| match self.layout {
                Layout::FrameMajor => frame * shape[1] + self.first + index,
                Layout::TrackMajor => (self.first + index) * shape[1] + frame,
            };
            let keys: Vec<f32> = kept
                .iter()
                .map(|&frame| numbers[at(frame)] as f32)
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
    let all = sampled.clip.set.scalar_count();
    let frames = sampled.times.len();
    let mut number = |frame: usize, index: usize| {
        let scalar = first + index;
        let value = f64::from(sampled.scalars[frame * all + scalar]);
        put(value + sampled.clip.scalar(scalar).origin)
    };
    match layout {
        Layout::FrameMajor => {
            (0..frames).try_for_each(|frame| (0..count).try_for_each(|index| number(frame, index)))
        }
        Layout::TrackMajor => {
            (0..count).try_for_each(|index| (0..frames).try_for_each(|frame| number(frame, index)))
        }
    }
}
