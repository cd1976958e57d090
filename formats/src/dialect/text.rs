//! Motion of robots in lines of numbers: Unitree's files without a heading, and BONES-SEED's with one.

use tumble::{FrameRate, Layout};

use super::{archive_of, root};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::format::{Loaded, ReadOptions, TimeUnit};
use crate::motion::ScalarKind;
use crate::npz;
use crate::npz::archive::ONLY_ARRAY;
use crate::npz::plan::{ArchivePlan, KeyKind, RobotArrays};
use crate::quaternion::ComponentOrder;
use crate::rotation_form::RotationForm;
use crate::warnings::Warnings;

/// The first columns of BONES-SEED's files: centimetres, and extrinsic angles about x, y, z in degrees.
pub(super) const BONES_SEED: [&str; 7] = [
    "Frame",
    "root_translateX",
    "root_translateY",
    "root_translateZ",
    "root_rotateX",
    "root_rotateY",
    "root_rotateZ",
];

/// How the columns of joints end in BONES-SEED's files.
pub(super) const JOINT: &str = "_dof";

/// The fewest columns of Unitree's files: position, quaternion, two joints.
const FEWEST: usize = 9;

/// After this many lines of a dialect, a line of another form counts as damaged, not as another dialect.
const CERTAIN: usize = 2;

/// How far from 1 the norm of a quaternion may be.
const NORM: f64 = 1e-3;

/// A dialect of text.
enum TextDialect {
    /// `x y z qx qy qz qw`, then an angle in radians for each joint; 30 frames a second.
    Unitree,
    /// The columns of [`BONES_SEED`], then an angle in degrees for each of these joints; 120 frames a second.
    BonesSeed(Vec<String>),
}

/// Reads a file of text that is in a dialect; `None` for other files.
///
/// # Errors
/// When a number is not finite, or the file takes too much memory.
pub(crate) fn read(
    file: &str,
    bytes: &[u8],
    options: &ReadOptions,
) -> Result<Option<Loaded>, Diagnostic> {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Ok(None);
    };
    let lines = (1u64..).zip(text.lines());
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty()).peekable();
    let Some((_, first)) = lines.peek() else {
        return Ok(None);
    };
    let cells: Vec<&str> = first.split(',').map(str::trim).collect();
    let dialect = match cells.split_at_checked(BONES_SEED.len()) {
        Some((root, joints)) if root == BONES_SEED => {
            let names = joints
                .iter()
                .map(|name| name.strip_suffix(JOINT).map(str::to_owned));
            let Some(names) = names.collect() else {
                return Ok(None);
            };
            lines.next();
            TextDialect::BonesSeed(names)
        }
        _ if cells.len() >= FEWEST => TextDialect::Unitree,
        _ => return Ok(None),
    };
    let width = cells.len();
    let budget = Budget::of(bytes.len(), options.limits);
    let norm = |row: &[f64]| row[3..7].iter().map(|q| q * q).sum::<f64>().sqrt();
    // If the first number is large, it is a time, as in VINS-Mono's files.
    let is_unit =
        |row: &[f64]| (norm(row) - 1.0).abs() < NORM && TimeUnit::of_large(row[0]).is_none();
    let is_unitree = matches!(dialect, TextDialect::Unitree);
    let is_known = |numbers: &[f64]| !is_unitree || numbers.chunks_exact(width).all(is_unit);
    let mut numbers: Vec<f64> = Vec::new();
    for (line, text) in lines {
        let before = numbers.len();
        let cells = text.split(',').map(|cell| cell.trim().parse());
        let row: Option<Vec<f64>> = cells.map(Result::ok).collect();
        let Some(row) = row.filter(|row| row.len() == width) else {
            // A damaged row is reported only if enough rows before it certainly belong to the dialect.
            if before < CERTAIN * width || !is_known(&numbers) {
                return Ok(None);
            }
            let count = text.split(',').count();
            let message = match count == width {
                true => "a cell is not a number; the lines before have only numbers".to_owned(),
                false => format!("{count} numbers, and the lines before have {width}"),
            };
            return Err(Diagnostic {
                location: Some(Location::Text { line, column: 1 }),
                ..Diagnostic::new(file, Code::Columns, message)
            });
        };
        numbers.extend(row);
        let budgeted = budget.take(width, 2 * size_of::<f64>());
        budgeted.map_err(|error| Diagnostic::new(file, Code::Memory, error.to_string()))?;
    }
    if numbers.is_empty() || !is_known(&numbers) {
        return Ok(None);
    }
    dialect
        .loaded(file, numbers, width, budget, options)
        .map(Some)
}

impl TextDialect {
    fn loaded(
        self,
        file: &str,
        mut numbers: Vec<f64>,
        width: usize,
        budget: Budget,
        options: &ReadOptions,
    ) -> Result<Loaded, Diagnostic> {
        let mut warnings = Warnings::new(file);
        if let Self::BonesSeed(_) = self {
            for row in numbers.chunks_exact_mut(width) {
                row[1..4].iter_mut().for_each(|length| *length /= 100.0);
                row[7..]
                    .iter_mut()
                    .for_each(|angle| *angle = angle.to_radians());
            }
        }
        let order = options.source_order.unwrap_or(ComponentOrder::Xyzw);
        if let (Self::Unitree, None) = (&self, options.source_order)
            && numbers[3].abs() > 0.9
            && numbers[6].abs() < 0.9
        {
            warnings.warn(Code::QuaternionOrder, || {
                let message = format!(
                    "the quaternion of the first line is {} {} {} {}, read as x y z w: the robot would be upside down; \
                     if w is first, as in Kimodo's files, give --source-order wxyz",
                    numbers[3], numbers[4], numbers[5], numbers[6]
                );
                (None, message)
            });
        }
        let (frames, per_second) = match self {
            Self::Unitree => (numbers.len() / width, 30),
            Self::BonesSeed(_) => (numbers.len() / width, 120),
        };
        let mut options = options.clone();
        if options.source_rate.is_none() && options.override_rate.is_none() {
            options.source_rate = FrameRate::new(per_second, 1).ok();
            warnings.warn(Code::AssumedRate, || {
                let message = format!(
                    "the file has no rate; {per_second} frames a second are assumed, as usual for such files; \
                     --source-fps gives \
                     another"
                );
                (None, message)
            });
        }
        let shape = vec![frames, width];
        let archive = archive_of(file, budget, [(ONLY_ARRAY.to_owned(), shape, numbers)]);
        let mut plan = ArchivePlan {
            is_world: true,
            is_part: true,
            names: vec!["root".to_owned()],
            robot: Some(match self {
                Self::Unitree => RobotArrays::of("unitree-csv", false),
                Self::BonesSeed(_) => RobotArrays::of("bones-seed", true),
            }),
            ..ArchivePlan::default()
        };
        let (position, rotation, names) = match self {
            Self::Unitree => (0, KeyKind::Quaternion(order), None),
            Self::BonesSeed(names) => {
                let sequence = "xyz".parse().map_err(|error: tumble::EulerSequenceError| {
                    Diagnostic::new(file, Code::Map, error.to_string())
                })?;
                let angles = RotationForm::Euler {
                    sequence,
                    degrees: true,
                };
                (1, KeyKind::Form(angles), Some(names))
            }
        };
        plan.add(
            &archive,
            root(&archive, ONLY_ARRAY, rotation, position + 3)?,
        )?;
        plan.add(
            &archive,
            root(&archive, ONLY_ARRAY, KeyKind::Translation, position)?,
        )?;
        let columns = (0, Layout::FrameMajor, 7);
        plan.add_scalars(
            &archive,
            columns,
            names,
            |_| ScalarKind::Angle,
            &mut warnings,
        )?;
        npz::read_plan(&archive, &mut plan, &options, warnings)
    }
}
