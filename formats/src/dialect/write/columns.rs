//! CSV of Unitree, Kimodo and BONES-SEED: the root and an angle for each joint, in every digit.

use std::io::{self, Write};

use tumble::trees::BodyOrder;

use super::{RobotMotion, WrittenDialect, ordered};
use crate::dialect::text::{BONES_SEED as HEADINGS, JOINT};
use crate::format::WriteError;
use crate::quaternion::ComponentOrder;
use crate::robot::VelocityPoint;

pub(super) static UNITREE: WrittenDialect = WrittenDialect {
    name: "unitree-csv",
    summary: "CSV of Unitree's LAFAN1: x y z, x y z w, an angle for each joint; no rate",
    format: "csv",
    order: BodyOrder::DepthFirst,
    has_bodies: false,
    names_joints: false,
    has_degrees: false,
    merges_links: false,
    velocity_at: VelocityPoint::Origin,
    quaternions: Some(ComponentOrder::Xyzw),
    assumed_rate: Some(30),
    has_whole_rate: false,
    other_endings: None,
    takes_descriptions: false,
    write: |motion, out| write(motion, ComponentOrder::Xyzw, out),
};

pub(super) static KIMODO: WrittenDialect = WrittenDialect {
    name: "kimodo-csv",
    summary: "CSV of Kimodo: as Unitree's, w first",
    quaternions: Some(ComponentOrder::Wxyz),
    write: |motion, out| write(motion, ComponentOrder::Wxyz, out),
    ..UNITREE
};

pub(super) static BONES_SEED: WrittenDialect = WrittenDialect {
    name: "bones-seed",
    summary: "CSV of BONES-SEED with a heading: centimetres and degrees; no rate",
    names_joints: true,
    has_degrees: true,
    quaternions: None,
    assumed_rate: Some(120),
    write: write_bones_seed,
    ..UNITREE
};

fn write(
    motion: &RobotMotion<'_>,
    order: ComponentOrder,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    for sample in 0..motion.samples() {
        let root = motion.root_position(sample).to_array().into_iter();
        let root = root.chain(ordered(motion.root_rotation(sample), order));
        line(
            root.map(|number| number as f32)
                .chain(motion.values(sample)),
            out,
        )?;
    }
    Ok(())
}

/// The angles are extrinsic, about the fixed axes x, y, z.
fn write_bones_seed(motion: &RobotMotion<'_>, out: &mut dyn Write) -> Result<(), WriteError> {
    let joints = motion
        .joint_names()
        .into_iter()
        .map(|name| format!("{name}{JOINT}"));
    let headings: Vec<String> = HEADINGS
        .iter()
        .map(|name| (*name).to_owned())
        .chain(joints)
        .collect();
    let mut table = csv::Writer::from_writer(&mut *out);
    table
        .write_record(&headings)
        .map_err(crate::csv::io_error)?;
    table.flush()?;
    drop(table);
    for sample in 0..motion.samples() {
        let position = motion.root_position(sample) * 100.0;
        let degrees = fixed_angles(motion.root_rotation(sample)).map(f64::to_degrees);
        let root = [sample as f64]
            .into_iter()
            .chain(position.to_array())
            .chain(degrees);
        line(
            root.chain(
                motion
                    .values(sample)
                    .map(|value| f64::from(value).to_degrees()),
            ),
            out,
        )?;
    }
    Ok(())
}

/// The angles about the fixed axes x, y, z, in this order.
fn fixed_angles([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let sine = 2.0 * (w * y - x * z);
    [
        libm::atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        libm::asin(sine.clamp(-1.0, 1.0)),
        libm::atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)),
    ]
}

fn line(numbers: impl Iterator<Item = impl ToString>, out: &mut dyn Write) -> io::Result<()> {
    let cells: Vec<String> = numbers.map(|number| number.to_string()).collect();
    writeln!(out, "{}", cells.join(","))
}
