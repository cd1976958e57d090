//! A file that is written again in the layout in which it was read.

use std::fmt;
use std::io::Write;
use std::path::Path;

use glam::Vec3;
use tumble::{FrameRate, Layout, SampleTimes};

use crate::array::Element;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Document, Format, MotionOptions, WriteError, check_times};
use crate::motion::end_frame::{EndFrame, RateFrames};
use crate::motion::{Motion, SampledClip};
use crate::npz::archive::{Archive, Member};
use crate::npz::array::{Array, AsStored};
use crate::npz::plan::scalars::{self, ScalarArray};
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind};
use crate::npz::write::{ArchiveWriter, check, keys, note_name, notes, rate_of_frames, times};
use crate::npz::{FORMAT, linear, smpl, tumble_layout};
use crate::warnings::Warnings;

/// The archive with all of its members, and their meaning.
pub(super) struct NpzDocument {
    archive: Archive,
    plan: ArchivePlan,
    /// First and last time of the clip in seconds.
    span: Option<(f64, f64)>,
}

impl fmt::Debug for NpzDocument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("NpzDocument")
            .field(&self.archive.file)
            .finish()
    }
}

/// The use of a member in the new file.
enum MemberOutcome<'a> {
    /// New keys are written.
    Keys(&'a KeyArray),
    /// New numbers of scalars are written, from this one of the clip on.
    Scalars(&'a ScalarArray, usize),
    Rate,
    Times,
    /// The same bytes are written.
    Constant,
    /// Numbers for each frame are interpolated linearly.
    Linear(usize),
    /// The member is left out, because its interpolation is unknown.
    LeftOut,
    /// The member is left out, because another array contains its data.
    Replaced,
}

impl NpzDocument {
    pub(super) fn new(archive: Archive, plan: ArchivePlan, clip: &Motion) -> Self {
        let span = clip.set.time_span();
        Self {
            archive,
            plan,
            span,
        }
    }

    fn refuse(&self, code: Code, message: String) -> WriteError {
        Diagnostic::new(&self.archive.file, code, message).into()
    }

    /// The arrays that contain keys: those that were read, and those that repeat parts of them.
    fn parts(&self) -> Result<Vec<KeyArray>, Diagnostic> {
        let mut parts = self.plan.parts.clone();
        let is_whole = |part: &&KeyArray| {
            part.kind == KeyKind::RotationVector && part.tracks.len() == self.plan.tracks
        };
        let Some(whole) = self.plan.parts.iter().find(is_whole) else {
            return Ok(parts);
        };
        let poses = self.archive.array(whole.member)?;
        for (name, first) in smpl::repeated_pieces(self.plan.tracks) {
            let shape = self.archive.shape(name);
            let is_beside = shape.is_some_and(|shape| shape.first() == Some(&self.plan.frames));
            let vectors = KeyKind::RotationVector;
            if !is_beside || self.archive.find(name) == Some(whole.member) {
                continue;
            }
            // An array of another form is not part of the pose; it is treated like any other array.
            let piece = KeyArray::of(&self.archive, name, vectors, first, Layout::FrameMajor);
            let Ok(Some((piece, frames))) = piece else {
                continue;
            };
            if piece.tracks.end > self.plan.tracks || frames != self.plan.frames {
                continue;
            }
            let array = self.archive.array(piece.member)?;
            let stored = |array: &Array<'_>, at, tracks| {
                array.tracks::<AsStored, 3, _>(at, tracks, frames, |list| list)
            };
            let stored_piece = stored(&array, piece.at, 0..piece.tracks.len());
            let same = stored(&poses, whole.at, piece.tracks.clone());
            if stored_piece == same {
                parts.push(piece);
            }
        }
        Ok(parts)
    }

    /// Whether the layout stores the time of each frame.
    fn has_times(&self) -> bool {
        self.plan.times.is_some() || self.plan.is_tumble_layout
    }

    /// The rate that is written beside the keys.
    fn rate(&self, sampled: &SampledClip<'_>) -> Option<FrameRate> {
        match self.plan.times {
            Some(_) => rate_of_frames(sampled),
            None => sampled.rate,
        }
    }

    /// The use of each member.
    fn outcomes<'a>(
        &'a self,
        parts: &'a [KeyArray],
        sampled: &SampledClip<'_>,
        options: &MotionOptions,
    ) -> Result<Vec<MemberOutcome<'a>>, WriteError> {
        let is_same = sampled.times == self.plan.all_times;
        let outcome = |(index, member): (usize, &Member)| {
            if let Some(part) = parts.iter().find(|part| part.member == index) {
                return MemberOutcome::Keys(part);
            }
            let mut first = 0;
            for part in &self.plan.scalars {
                if part.member == index && !options.linear.contains(&member.name) {
                    return MemberOutcome::Scalars(part, first);
                }
                first += part.scalars.len();
            }
            if self.plan.times.is_some_and(|list| list.member == index) {
                return MemberOutcome::Times;
            }
            if self.plan.rate_member == Some(index) {
                return if self.rate(sampled).is_some() {
                    MemberOutcome::Rate
                } else {
                    MemberOutcome::Replaced
                };
            }
            let mut new_notes = sampled.notes.iter().map(|(note, _)| note_name(note));
            if self.plan.is_tumble_layout && new_notes.any(|note| note == member.name) {
                return MemberOutcome::Replaced;
            }
            match self.frame_axis(index) {
                None => MemberOutcome::Constant,
                // If the times of the samples are those of the keys, the array is copied unchanged.
                Some(_) if is_same && !options.linear.contains(&member.name) => {
                    MemberOutcome::Constant
                }
                Some(axis) if options.linear.contains(&member.name) => MemberOutcome::Linear(axis),
                Some(_) => MemberOutcome::LeftOut,
            }
        };
        let members = self.archive.members.iter().enumerate();
        let outcomes: Vec<MemberOutcome<'_>> = members.map(outcome).collect();
        for name in &options.linear {
            let member = self.archive.find(name);
            let is_linear = |&member: &usize| matches!(outcomes[member], MemberOutcome::Linear(_));
            if member.filter(is_linear).is_none() {
                let candidates = self.named(&outcomes, |outcome| {
                    matches!(outcome, MemberOutcome::LeftOut | MemberOutcome::Linear(_))
                });
                let message = format!(
                    "linear names {name}: no array beside the keys has this name and an entry for \
                     each frame; there are {candidates}"
                );
                return Err(self.refuse(Code::NotPerFrame, message));
            }
        }
        Ok(outcomes)
    }

    /// The members for which `is_meant` is true, for messages.
    fn named(
        &self,
        outcomes: &[MemberOutcome<'_>],
        is_meant: impl Fn(&MemberOutcome<'_>) -> bool,
    ) -> String {
        let members = self.archive.members.iter().zip(outcomes);
        let meant = members.filter(|(_, outcome)| is_meant(outcome));
        let names: Vec<String> = meant
            .map(|(member, _)| format!("`{}`", member.name))
            .collect();
        match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        }
    }

    /// The axis of frames of an array, if it has one.
    fn frame_axis(&self, member: usize) -> Option<usize> {
        // With one frame, every list of one entry would look like an array of frames.
        if self.plan.constants.contains(&member) || self.plan.frames < 2 {
            return None;
        }
        let header = self.archive.members[member].header.as_ref().ok()?;
        let axes = if self.plan.is_tumble_layout { 2 } else { 1 };
        let mut first = header.shape.iter().take(axes);
        first.rposition(|&length| length == self.plan.frames)
    }

    /// Writes the members; then the rate or the times, if no member contains when frames are.
    fn write_members(
        &self,
        outcomes: &[MemberOutcome<'_>],
        sampled: &SampledClip<'_>,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let mut members = ArchiveWriter::new();
        let frames = sampled.times.len();
        for (index, outcome) in outcomes.iter().enumerate() {
            let member = &self.archive.members[index];
            let (path, deflated) = (&*member.path, member.is_deflated);
            match *outcome {
                MemberOutcome::Keys(part) => {
                    let array = self.archive.array(index)?;
                    let mut shape = array.header.shape.clone();
                    shape[usize::from(part.layout == Layout::TrackMajor)] = frames;
                    let array = (&array.header.element, &*shape);
                    members.numbers(path, array, deflated, |put| {
                        keys(part.kind, part.tracks.clone(), part.layout, sampled, put)
                    })?;
                }
                MemberOutcome::Scalars(part, first) => {
                    let array = self.archive.array(index)?;
                    let count = part.scalars.len();
                    let shape = match part.layout {
                        Layout::FrameMajor => [frames, count],
                        Layout::TrackMajor => [count, frames],
                    };
                    let array = (&array.header.element, &shape[..]);
                    members.numbers(path, array, deflated, |put| {
                        scalars::put(sampled, (first, count), part.layout, put)
                    })?;
                }
                MemberOutcome::Rate => {
                    let array = self.archive.array(index)?;
                    let shape = &*array.header.shape;
                    let rate = self.rate(sampled);
                    let element = rate_element(&array.header.element, rate);
                    members.numbers(path, (&element, shape), deflated, |put| {
                        rate.into_iter().try_for_each(|rate| put(rate.per_second()))
                    })?;
                }
                MemberOutcome::Times => times(&mut members, sampled)?,
                MemberOutcome::Constant => {
                    members.bytes(path, &self.archive.unpack(index)?, deflated)?;
                }
                MemberOutcome::Linear(axis) => {
                    let array = self.archive.array(index)?;
                    if !array.header.element.is_float() {
                        let message = format!(
                            "linear names {}: the array is of {}; floats are interpolated",
                            member.name, array.header.element
                        );
                        return Err(self.refuse(Code::NotPerFrame, message));
                    }
                    let mut shape = array.header.shape.clone();
                    shape[axis] = frames;
                    let new = (&array.header.element, &*shape);
                    members.numbers(path, new, deflated, |put| {
                        linear::resample(&array, axis, &self.plan.all_times, sampled.times, put)
                    })?;
                }
                MemberOutcome::LeftOut | MemberOutcome::Replaced => {}
            }
        }
        match sampled.rate {
            Some(rate) if self.plan.rate_member.is_none() => {
                let scalar = (&Element::F64, &[][..]);
                members.numbers("fps.npy", scalar, false, |put| put(rate.per_second()))?;
            }
            None if self.plan.times.is_none() => times(&mut members, sampled)?,
            _ => {}
        }
        if self.plan.is_tumble_layout {
            notes(&mut members, sampled)?;
        }
        Ok(members.finish(out)?)
    }
}

impl Document for NpzDocument {
    /// Whole frames of the rate from the first time on.
    fn frames(&self, _clip: usize, rate: FrameRate) -> Result<RateFrames, Diagnostic> {
        let frames = SampleTimes::rate(rate).resolve(self.plan.tracks, self.span);
        let timeline = frames.map_err(|error| {
            Diagnostic::new(&self.archive.file, Code::Layout, error.to_string())
        })?;
        Ok(RateFrames {
            frames: SampleTimes::at(timeline.times(0).collect()),
            rate,
            end: self.span.map_or(0.0, |span| span.1),
        })
    }

    fn end_frame(&self) -> EndFrame {
        EndFrame::where_times_are(self.has_times())
    }

    fn writes(&self, format: &Format) -> bool {
        format.name == FORMAT.name
    }

    /// The arrays that no layout of clips contains.
    fn other_contents(&self) -> Vec<String> {
        let is_key = |member_index: usize| {
            self.plan
                .parts
                .iter()
                .any(|part| part.member == member_index)
                || (self.plan.scalars.iter()).any(|part| part.member == member_index)
        };
        let is_time = |member_index: usize| {
            self.plan
                .times
                .is_some_and(|list| list.member == member_index)
        };
        let members = self.archive.members.iter().enumerate();
        let others = members.filter(|&(index, member)| {
            let is_known = self.plan.constants.contains(&index)
                || self.plan.is_tumble_layout && tumble_layout::CONSTANTS.contains(&&*member.name)
                || self.plan.is_note(member);
            !is_key(index) && !is_time(index) && self.plan.rate_member != Some(index) && !is_known
        });
        others.map(|(_, member)| member.name.clone()).collect()
    }

    fn write(
        &self,
        clips: &[(usize, SampledClip<'_>)],
        options: &MotionOptions,
        _: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        if clips.is_empty() {
            let mut members = ArchiveWriter::new();
            for (index, member) in self.archive.members.iter().enumerate() {
                members.bytes(
                    &member.path,
                    &self.archive.unpack(index)?,
                    member.is_deflated,
                )?;
            }
            members.finish(out)?;
            return Ok(Vec::new());
        }
        let [(0, sampled)] = clips else {
            let message = format!("{} clips; the file has the clip 0 alone", clips.len());
            return Err(self.refuse(Code::OneClip, message));
        };
        check_times(sampled, &options.name)?;
        // `trans` is relative to the pelvis of the body shape.
        let pelvis = sampled
            .clip
            .body
            .as_ref()
            .map_or(Vec3::ZERO, |body| body.pelvis);
        let mut translations = sampled.translations.to_vec();
        let roots = translations.iter_mut();
        for root in roots.step_by(sampled.clip.set.track_count().max(1)) {
            *root = (root.as_dvec3() - pelvis.as_dvec3()).as_vec3();
        }
        let sampled = &SampledClip {
            translations: &translations,
            ..sampled.clone()
        };
        check(sampled, &options.name)?;
        let parts = self.plan.scalars.iter();
        let scalars: usize = parts.map(|part| part.scalars.len()).sum();
        if sampled.clip.set.scalar_count() != scalars {
            let message = format!(
                "{} scalars; the layout that was read is kept, of {scalars} scalars",
                sampled.clip.set.scalar_count()
            );
            return Err(self.refuse(Code::Layout, message));
        }
        let tracks = sampled.clip.set.track_count();
        if tracks != self.plan.tracks {
            let message = format!(
                "{tracks} tracks; the layout that was read is kept, of {} tracks",
                self.plan.tracks
            );
            return Err(self.refuse(Code::Layout, message));
        }
        if sampled.rate.is_none() && !self.has_times() {
            let message = "the layout stores a rate and no times; give --fps instead of times";
            return Err(self.refuse(Code::Layout, message.to_owned()));
        }
        let parts = self.parts()?;
        let outcomes = self.outcomes(&parts, sampled, options)?;
        self.write_members(&outcomes, sampled, out)?;
        let mut warnings = Warnings::new(&self.archive.file);
        let start = sampled.clip.time_offset as f64 + sampled.times[0];
        if start != 0.0 && !self.has_times() {
            warnings.warn(Code::StartMoved, || {
                let message = format!(
                    "the first frame is at {start} s; the layout stores a rate and no times, and begins at 0"
                );
                (None, message)
            });
        }
        if outcomes
            .iter()
            .any(|outcome| matches!(outcome, MemberOutcome::LeftOut))
        {
            let names = self.named(&outcomes, |outcome| {
                matches!(outcome, MemberOutcome::LeftOut)
            });
            warnings.warn(Code::LeftOut, || {
                let message = format!(
                    "left out, because it is not known how to sample them: {names}; numbers are \
                     interpolated where linear names them (--linear NAME, in Python linear=[NAME])"
                );
                (None, message)
            });
        }
        Ok(warnings.into_list())
    }
}

/// The type of a rate: as before, if it can represent the new rate.
fn rate_element(was: &Element, rate: Option<FrameRate>) -> Element {
    let is_whole = rate.is_some_and(|rate| rate.per_second().fract() == 0.0);
    let is_small = rate.is_some_and(|rate| rate.per_second() < 128.0);
    match was {
        Element::F32 => Element::F32,
        Element::Signed(size) | Element::Unsigned(size) if is_whole && (is_small || *size > 2) => {
            was.clone()
        }
        _ => Element::F64,
    }
}
