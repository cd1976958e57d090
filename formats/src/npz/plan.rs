//! The meaning of the arrays of a file: which of them contain the rotations of which tracks, and in what form. Every
//! layout becomes a plan, by which clips are read and files are written again.

mod rate;
pub(crate) mod scalars;
mod unread;

use std::ops::Range;

use glam::DVec3;
use tumble::names::counted;
use tumble::{FrameRate, Layout};

use crate::array::shape_text;
use crate::diagnostic::{Code, Diagnostic};
use crate::motion::WrittenJoint;
use crate::motion::{Channels, Transform, circle};
use crate::npz::archive::Archive;
use crate::npz::array::Strides;
use crate::npz::plan::scalars::ScalarArray;
use crate::quaternion::ComponentOrder;
use crate::rotation_form::RotationForm;

/// One clip as arrays.
#[derive(Debug, Clone, Default)]
pub(crate) struct ArchivePlan {
    /// The clip's name.
    pub(crate) name: Option<String>,
    pub(crate) tracks: usize,
    pub(crate) frames: usize,
    /// The arrays that contain keys. Those of rotations are first, in the order of their tracks.
    pub(crate) parts: Vec<KeyArray>,
    /// The arrays that contain scalars.
    pub(crate) scalars: Vec<ScalarArray>,
    /// The name of each track, or empty.
    pub(crate) names: Vec<String>,
    /// The parent of each track, or empty.
    pub(crate) parents: Vec<Option<usize>>,
    /// The rest transform of each track, with its translation in f64, or empty.
    pub(crate) rest: Vec<(Transform, DVec3)>,
    /// The member with the times in seconds.
    pub(crate) times: Option<TimeList>,
    /// The member with the number of each frame, where frames may be missing.
    pub(crate) frame_numbers: Option<usize>,
    /// The member with the rate.
    pub(crate) rate_member: Option<usize>,
    pub(crate) rate: Option<FrameRate>,
    /// The error if the rate in the file is not a valid rate. It is reported unless another rate replaces this one.
    pub(crate) bad_rate: Option<Diagnostic>,
    /// The message if the file contains two different rates.
    pub(crate) two_rates: Option<String>,
    /// The times of all frames, including those that are left out of the clip.
    pub(crate) all_times: Vec<f64>,
    /// Members that repeat the data of others, or with which the rate is compared.
    pub(crate) compared: Vec<usize>,
    /// Members that do not depend on frames, even if their shape looks like it.
    pub(crate) constants: Vec<usize>,
    pub(crate) is_world: bool,
    /// Why poses in the world cannot be computed.
    pub(crate) no_world: Option<String>,
    /// The robot that moves, if the file is in a dialect.
    pub(crate) robot: Option<RobotArrays>,
    /// Whether the clip is the motion of an SMPL body.
    pub(crate) is_body: bool,
    /// Names of members that files of this layout usually have besides the motion. No warning names them.
    pub(crate) companions: &'static [&'static str],
    /// How the channels of each track are interpolated, or empty.
    pub(crate) channels: Vec<Channels>,
    /// How a file of BVH wrote each track, or empty.
    pub(crate) written_joints: Vec<WrittenJoint>,
    /// Whether keys are parts of arrays whose other parts are not read, so that the arrays cannot be written again.
    pub(crate) is_part: bool,
    /// Whether the layout is Tumble's, with the notes on how the samples were made.
    pub(crate) is_tumble_layout: bool,
}

/// The arrays about a robot, besides the keys of its root and its joints.
#[derive(Debug, Clone)]
pub(crate) struct RobotArrays {
    pub(crate) dialect: &'static str,
    pub(crate) names_joints: bool,
    /// The positions and the rotations of all bodies, (frames, bodies, numbers).
    pub(crate) bodies: Option<[usize; 2]>,
    /// The order of the rotations' components.
    pub(crate) order: ComponentOrder,
    /// The names of the bodies, or empty.
    pub(crate) body_names: Vec<String>,
}

impl RobotArrays {
    /// The arrays of a dialect without bodies.
    pub(crate) fn of(dialect: &'static str, names_joints: bool) -> Self {
        Self {
            dialect,
            names_joints,
            bodies: None,
            order: ComponentOrder::Xyzw,
            body_names: Vec::new(),
        }
    }
}

/// The location of the times of all frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimeList {
    pub(crate) member: usize,
    /// The column of the array, if it has several.
    pub(crate) column: usize,
}

/// An array of keys.
#[derive(Debug, Clone)]
pub(crate) struct KeyArray {
    pub(crate) member: usize,
    pub(crate) kind: KeyKind,
    pub(crate) tracks: Range<usize>,
    pub(crate) layout: Layout,
    pub(crate) at: Strides,
}

/// The form of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KeyKind {
    /// A quaternion.
    Quaternion(ComponentOrder),
    /// A rotation vector in radians.
    RotationVector,
    /// A rotation in another form, which a map specifies.
    Form(RotationForm),
    Translation,
    Scale,
}

impl KeyKind {
    pub(crate) fn is_rotation(self) -> bool {
        matches!(
            self,
            Self::Quaternion(_) | Self::RotationVector | Self::Form(_)
        )
    }

    /// How many numbers a key has.
    pub(crate) fn width(self) -> usize {
        match self {
            Self::Quaternion(_) => 4,
            Self::Form(form) => form.width(),
            _ => 3,
        }
    }
}

impl KeyArray {
    /// All of an array: of shape (frames, numbers of all tracks), (frames, tracks, numbers), or, track by track,
    /// (tracks, frames, numbers). `first` is the first of its tracks. Returns the number of frames too. `None` if
    /// there is no such array.
    ///
    /// # Errors
    /// When the shape is none of these, or when the elements are not floats.
    pub(crate) fn of(
        archive: &Archive,
        name: &str,
        values: KeyKind,
        first: usize,
        layout: Layout,
    ) -> Result<Option<(Self, usize)>, Diagnostic> {
        let Some(member) = archive.find(name) else {
            return Ok(None);
        };
        check_float(archive, member)?;
        let width = values.width();
        let header = archive.header(member)?;
        let shape = &*header.shape;
        let strides = header.strides();
        let found = match (shape, layout) {
            _ if shape.contains(&0) => None,
            (&[frames, numbers], Layout::FrameMajor) if numbers % width == 0 => {
                let at = Strides {
                    first: 0,
                    track: width * strides[1],
                    frame: strides[0],
                    component: strides[1],
                };
                Some((at, numbers / width, frames))
            }
            (&[outer, inner, numbers], _) if numbers == width => {
                let axes = [(strides[0], outer), (strides[1], inner)];
                let [track, frame] = match layout {
                    Layout::TrackMajor => axes,
                    Layout::FrameMajor => [axes[1], axes[0]],
                };
                let at = Strides {
                    first: 0,
                    track: track.0,
                    frame: frame.0,
                    component: strides[2],
                };
                Some((at, track.1, frame.1))
            }
            _ => None,
        };
        let Some((at, tracks, frames)) = found else {
            let shape = shape_text(shape);
            let expected = match layout {
                Layout::TrackMajor => format!("(tracks, frames, {width})"),
                Layout::FrameMajor => {
                    format!("(frames, {width} numbers a track) or (frames, tracks, {width})")
                }
            };
            let message = format!(
                "the array has shape {shape}; {expected} is expected; for other arrays use --map"
            );
            return Err(archive.refuse(member, Code::Shape, message));
        };
        let part = Self {
            member,
            kind: values,
            tracks: first..first + tracks,
            layout,
            at,
        };
        Ok(Some((part, frames)))
    }

    /// The rotations of an array of matrices, (frames, tracks, 3, 3), and the number of frames.
    ///
    /// # Errors
    /// When there is no such array, or its rows are not one after another in memory.
    pub(crate) fn of_matrices(archive: &Archive, name: &str) -> Result<(Self, usize), Diagnostic> {
        let Some(member) = archive.find(name) else {
            let message = format!("there is no array `{name}`");
            return Err(Diagnostic::new(&archive.file, Code::UnknownArrays, message));
        };
        check_float(archive, member)?;
        let header = archive.header(member)?;
        let (&[frames, tracks, 3, 3], &[frame, track, rows, component]) =
            (&header.shape[..], &header.strides()[..])
        else {
            let shape = shape_text(&header.shape);
            let message =
                format!("the array has shape {shape}; (frames, joints, 3, 3) is expected");
            return Err(archive.refuse(member, Code::Shape, message));
        };
        if rows != 3 * component {
            let message =
                "the matrices are in Fortran's order; save them with numpy.ascontiguousarray";
            return Err(archive.refuse(member, Code::Shape, message.to_owned()));
        }
        let part = Self {
            member,
            kind: KeyKind::Form(RotationForm::Matrix),
            tracks: 0..tracks,
            layout: Layout::FrameMajor,
            at: Strides {
                first: 0,
                track,
                frame,
                component,
            },
        };
        Ok((part, frames))
    }

    /// The index of the key of a track, as in `NumPy`.
    pub(crate) fn index_text(&self, archive: &Archive, track: usize, frame: usize) -> String {
        let member = &archive.members[self.member];
        let part_track = track - self.tracks.start;
        let axes = member
            .header
            .as_ref()
            .map_or(0, |header| header.shape.len());
        let width = self.kind.width();
        let index = match (axes, self.layout) {
            (3, Layout::TrackMajor) => format!("{part_track}, {frame}"),
            (3, Layout::FrameMajor) => format!("{frame}, {part_track}"),
            _ => {
                let first = self.at.first / self.at.component.max(1) + part_track * width;
                format!("{frame}, {first}:{}", first + width)
            }
        };
        format!("{}[{index}]", member.name)
    }
}

/// Refuses an array of keys that are not floats.
pub(crate) fn check_float(archive: &Archive, member: usize) -> Result<(), Diagnostic> {
    let element = &archive.header(member)?.element;
    if element.is_float() {
        return Ok(());
    }
    let message =
        format!("the array is of {element}; keys are of f2, f4 or f8: convert it with astype");
    Err(archive.refuse(member, Code::ElementType, message))
}

impl ArchivePlan {
    /// Adds the keys of an array, which must have the same number of tracks and frames as the others.
    pub(crate) fn add(
        &mut self,
        archive: &Archive,
        (part, frames): (KeyArray, usize),
    ) -> Result<(), Diagnostic> {
        if self.parts.is_empty() {
            self.frames = frames;
        }
        let end = part.tracks.end;
        let is_rotation = part.kind.is_rotation();
        if frames != self.frames || !is_rotation && end > self.tracks {
            let name = &archive.members[self.parts[0].member].name;
            let message = format!(
                "the array has {} of {}; `{name}` has {} of {}",
                counted(frames, "frame"),
                counted(end, "track"),
                self.frames,
                self.tracks
            );
            return Err(archive.refuse(part.member, Code::Shape, message));
        }
        if is_rotation {
            self.tracks = end;
        }
        self.parts.push(part);
        Ok(())
    }

    /// Changes the order in which the components of a robot's quaternions are read.
    ///
    /// # Errors
    /// When the file is in no dialect, or has no quaternions.
    pub(crate) fn set_order(
        &mut self,
        archive: &Archive,
        order: ComponentOrder,
    ) -> Result<(), Diagnostic> {
        let mut is_any = false;
        for part in &mut self.parts {
            if let (KeyKind::Quaternion(known), Some(robot)) = (&mut part.kind, &mut self.robot) {
                (*known, robot.order, is_any) = (order, order, true);
            }
        }
        match is_any {
            true => Ok(()),
            false => {
                let message = "--source-order is for TUM, EuRoC and files of robots' motion; leave it out, or \
                               state the order with --map";
                Err(Diagnostic::new(&archive.file, Code::Map, message))
            }
        }
    }

    /// Reads the names of all tracks from an array of texts.
    pub(crate) fn read_names(&mut self, archive: &Archive, name: &str) -> Result<(), Diagnostic> {
        let Some(member) = archive.find(name) else {
            return Ok(());
        };
        let names = archive.texts(name)?.unwrap_or_default();
        self.check_count(archive, member, names.len())?;
        self.constants.push(member);
        self.names = names;
        Ok(())
    }

    /// Reads the parents of all tracks from an array of integers, which are negative for roots.
    pub(crate) fn read_parents(&mut self, archive: &Archive, name: &str) -> Result<(), Diagnostic> {
        let Some(member) = archive.find(name) else {
            return Ok(());
        };
        let numbers = read_numbers(archive, member)?;
        self.check_count(archive, member, numbers.len())?;
        self.constants.push(member);
        let refuse = |message: String| archive.refuse(member, Code::Parents, message);
        for (track, &parent) in numbers.iter().enumerate() {
            let is_track = parent >= 0.0 && parent < self.tracks as f64 && parent.fract() == 0.0;
            if !is_track && parent >= 0.0 || parent.is_nan() {
                let message = format!(
                    "track {track} has the parent {parent}, but there are {} tracks; the parent of a root is -1",
                    self.tracks
                );
                return Err(refuse(message));
            }
            self.parents.push(is_track.then_some(parent as usize));
        }
        match circle(&self.parents) {
            Some(track) => Err(refuse(format!(
                "track {track} is its own ancestor; the parent of a root is -1"
            ))),
            None => Ok(()),
        }
    }

    fn check_count(
        &self,
        archive: &Archive,
        member: usize,
        count: usize,
    ) -> Result<(), Diagnostic> {
        if count == self.tracks {
            return Ok(());
        }
        let entries = counted(count, "entry");
        let tracks = counted(self.tracks, "track");
        let message = format!("the array has {entries} for {tracks}");
        Err(archive.refuse(member, Code::Shape, message))
    }
}

/// The numbers of a member, in C order.
pub(crate) fn read_numbers(archive: &Archive, member: usize) -> Result<Vec<f64>, Diagnostic> {
    let array = archive.array(member)?;
    array.numbers().ok_or_else(|| {
        let message = format!(
            "the array is of {}; numbers are needed",
            array.header.element
        );
        archive.refuse(member, Code::ElementType, message)
    })
}
