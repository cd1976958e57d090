//! Dialects: layouts of named arrays by which programs for robots store motion, in NPZ files and pickles.
//! [`DIALECTS`] lists them. A file is in a dialect if it has all of its arrays, with their shapes.
//!
//! The root is one track with rotations and translations, and the joints are scalars. Velocities and other bodies, which
//! follow from these, are not read.

mod gmr;
pub(crate) mod gvhmr;
pub mod json;
mod kimodo;
mod mimickit;
mod mjlab;
mod motion_lib;
pub(crate) mod protomotions;
pub(crate) mod text;
mod tram;
mod wham;
pub mod write;

use tumble::Layout;

use crate::array::{ArrayHeader, Element};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::motion::ScalarKind;
use crate::npz::archive::{Archive, Member, ONLY_ARRAY};
use crate::npz::array::Strides;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind, RobotArrays, check_float};
use crate::npz::smpl;
use crate::quaternion::ComponentOrder;
use crate::warnings::Warnings;

/// A layout of named arrays.
pub struct Dialect {
    /// Its name in messages.
    pub name: &'static str,
    /// A short description: its arrays, and programs that write them.
    pub summary: &'static str,
    /// The arrays that a file has.
    arrays: &'static [(&'static str, &'static [Axis])],
    /// Makes the plan of such a file.
    plan: fn(&Archive, &mut Warnings) -> Result<ArchivePlan, Diagnostic>,
}

/// An axis of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axis {
    /// As long as the first axis of the first array.
    Frames,
    /// Of any length.
    Any,
    /// Of this length.
    Is(usize),
    /// Longer than this.
    Over(usize),
}

/// All dialects. To add one, write a module with a `DIALECT`, and add a line here.
pub static DIALECTS: &[&Dialect] = &[
    &gmr::DIALECT,
    &kimodo::DIALECT,
    &mjlab::DIALECT,
    &mimickit::DIALECT,
    &motion_lib::DIALECT,
    &protomotions::DIALECT,
    &tram::DIALECT,
    &wham::DIALECT,
];

/// The plan of a file that is in a dialect; `None` for other files.
///
/// # Errors
/// When the file is in two dialects, or when its arrays are invalid.
pub(crate) fn plan(
    archive: &Archive,
    warnings: &mut Warnings,
) -> Result<Option<ArchivePlan>, Diagnostic> {
    let mut fitting = DIALECTS.iter().filter(|dialect| dialect.fits(archive));
    let Some(first) = fitting.next() else {
        return Ok(None);
    };
    if let Some(second) = fitting.next() {
        let message = format!(
            "the arrays are those of two dialects, {} and {}; say which are meant with --map, or save one of them",
            first.name, second.name
        );
        return Err(Diagnostic::new(&archive.file, Code::TwoDialects, message));
    }
    (first.plan)(archive, warnings).map(Some)
}

/// Why a file that has all arrays of a dialect is not in it: one of them has another shape. `None` for other files.
pub(crate) fn misfit(archive: &Archive) -> Option<String> {
    DIALECTS.iter().find_map(|dialect| {
        let shapes = dialect.arrays.iter();
        let shapes = shapes.map(|(name, axes)| Some((*name, *axes, archive.shape(name)?)));
        let shapes: Vec<_> = shapes.collect::<Option<_>>()?;
        let listed = shapes
            .iter()
            .map(|(name, _, shape)| format!("`{name}` {shape:?}"));
        let listed: Vec<String> = listed.collect();
        let frames = shapes
            .iter()
            .filter(|(_, axes, _)| axes.first() == Some(&Axis::Frames));
        let frames: Vec<usize> = frames
            .filter_map(|(.., shape)| shape.first().copied())
            .collect();
        let why = match frames.iter().any(|count| Some(count) != frames.first()) {
            true => "have different numbers of frames",
            false => "have other shapes than that layout",
        };
        Some(format!(
            "the arrays of {} {why}: {}",
            dialect.name,
            listed.join(", ")
        ))
    })
}

impl Dialect {
    /// Whether a file has all arrays.
    fn fits(&self, archive: &Archive) -> bool {
        let mut frames = None;
        self.arrays.iter().all(|(name, axes)| {
            let Some(shape) = archive.shape(name) else {
                return false;
            };
            let first = shape.first().copied().unwrap_or(0);
            let frames = *frames.get_or_insert(first);
            let is_axis = |(axis, &length): (&Axis, &usize)| match axis {
                Axis::Frames => length == frames && length > 0,
                Axis::Any => length > 0,
                Axis::Is(expected) => length == *expected,
                Axis::Over(least) => length > *least,
            };
            shape.len() == axes.len() && axes.iter().zip(shape).all(is_axis)
        })
    }
}

/// The number of the member with a name that was recognised.
fn member(archive: &Archive, name: &str) -> Result<usize, Diagnostic> {
    archive.find(name).ok_or_else(|| missing(archive, name))
}

fn missing(archive: &Archive, name: &str) -> Diagnostic {
    let message = format!("there is no array `{name}`");
    Diagnostic::new(&archive.file, Code::UnknownArrays, message)
}

/// The plan of an SMPL body without its arrays.
fn smpl_body(joints: usize) -> ArchivePlan {
    let (names, parents) = smpl::joints_of_body(joints).unwrap_or_default();
    ArchivePlan {
        is_body: true,
        is_part: true,
        no_world: Some(smpl::NO_OFFSETS.to_owned()),
        names,
        parents,
        ..ArchivePlan::default()
    }
}

/// Numbers as the arrays of a file: the name, the shape and the numbers of each.
fn archive_of(
    file: &str,
    budget: Budget,
    arrays: impl IntoIterator<Item = (String, Vec<usize>, Vec<f64>)>,
) -> Archive {
    let (mut bytes, mut members) = (Vec::new(), Vec::new());
    for (name, shape, numbers) in arrays {
        let start = bytes.len();
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        let header = ArrayHeader {
            element: Element::F64,
            is_big_endian: false,
            is_fortran: false,
            shape,
            start: 0,
        };
        let location = match &*name {
            ONLY_ARRAY => String::new(),
            name => format!("['{name}']"),
        };
        members.push(Member::of_value(name, location, header, start..bytes.len()));
    }
    Archive::of_values(file, bytes, budget, members)
}

/// The keys of the root: of an array (frames, numbers) from a column on, or of the first body of one (frames, bodies,
/// numbers).
fn root(
    archive: &Archive,
    name: &str,
    kind: KeyKind,
    column: usize,
) -> Result<(KeyArray, usize), Diagnostic> {
    let member = member(archive, name)?;
    check_float(archive, member)?;
    let header = archive.header(member)?;
    let (strides, frames) = (header.strides(), header.shape[0]);
    let component = strides[strides.len() - 1];
    let part = KeyArray {
        member,
        kind,
        tracks: 0..1,
        layout: Layout::FrameMajor,
        at: Strides {
            first: column * component,
            track: 0,
            frame: strides[0],
            component,
        },
    };
    Ok((part, frames))
}

/// The arrays with the names of joints and bodies. `tumble eval --describe` adds them with these names, which other
/// programs use, too.
const JOINT_NAMES: &str = "joint_names";
const DOF_NAMES: &str = "dof_names";
const BODY_NAMES: &str = "body_names";

/// The plan of a root and of joints, all of them hinges or slides, which the file does not tell apart.
fn root_and_joints(
    archive: &Archive,
    dialect: &'static str,
    rotation: (&str, ComponentOrder),
    position: &str,
    joints: &str,
    companions: &'static [&'static str],
    warnings: &mut Warnings,
) -> Result<ArchivePlan, Diagnostic> {
    let mut plan = ArchivePlan {
        is_world: true,
        is_part: true,
        names: vec!["root".to_owned()],
        companions,
        ..ArchivePlan::default()
    };
    let quaternions = KeyKind::Quaternion(rotation.1);
    plan.add(archive, root(archive, rotation.0, quaternions, 0)?)?;
    plan.add(archive, root(archive, position, KeyKind::Translation, 0)?)?;
    let columns = (member(archive, joints)?, Layout::FrameMajor, 0);
    let names = match archive.texts(JOINT_NAMES)? {
        None => archive.texts(DOF_NAMES)?,
        found => found,
    };
    let mut robot = RobotArrays::of(dialect, names.is_some());
    plan.add_scalars(archive, columns, names, |_| ScalarKind::Angle, warnings)?;
    let members = [member(archive, position)?, member(archive, rotation.0)?];
    let [positions, rotations] =
        members.map(|member| archive.header(member).map(|header| &header.shape));
    if let (&[frames, bodies, _], &[of_frames, of_bodies, _]) = (&positions?[..], &rotations?[..])
        && (frames, bodies) == (of_frames, of_bodies)
    {
        robot.body_names = (archive.texts(BODY_NAMES)?)
            .filter(|names| names.len() == bodies)
            .unwrap_or_default();
        (robot.bodies, robot.order) = (Some(members), rotation.1);
    }
    plan.robot = Some(robot);
    plan.read_rate(archive, &["fps"])?;
    Ok(plan)
}
