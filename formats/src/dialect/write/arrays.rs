//! NPZ of mjlab, `BeyondMimic` and `IsaacLab`: joints and bodies with their velocities.

use std::io::{self, Write};

use tumble::trees::{BodyMotion, BodyOrder};

use super::{RobotMotion, WrittenDialect, ordered};
use crate::array::Element;
use crate::dialect::{BODY_NAMES, JOINT_NAMES};
use crate::format::WriteError;
use crate::npz::write::ArchiveWriter;
use crate::quaternion::ComponentOrder;
use crate::robot::VelocityPoint;

pub(super) static MJLAB: WrittenDialect = WrittenDialect {
    name: "mjlab",
    summary: "NPZ of mjlab: joints and bodies depth first, w x y z, velocities of origins",
    format: "npz",
    order: BodyOrder::DepthFirst,
    has_bodies: true,
    names_joints: false,
    has_degrees: false,
    merges_links: false,
    velocity_at: VelocityPoint::Origin,
    quaternions: Some(ComponentOrder::Wxyz),
    assumed_rate: None,
    has_whole_rate: true,
    other_endings: None,
    takes_descriptions: true,
    write: |motion, out| write(motion, &TRACKER, out),
};

pub(super) static BEYONDMIMIC: WrittenDialect = WrittenDialect {
    name: "beyondmimic",
    summary: "NPZ of BeyondMimic: as mjlab, breadth first, velocities of centres of mass",
    order: BodyOrder::BreadthFirst,
    merges_links: true,
    velocity_at: VelocityPoint::Mass,
    ..MJLAB
};

pub(super) static ISAACLAB: WrittenDialect = WrittenDialect {
    name: "isaaclab",
    summary: "NPZ of IsaacLab's AMP: joints and bodies with their names, w x y z, velocities of origins",
    order: BodyOrder::BreadthFirst,
    merges_links: true,
    names_joints: true,
    has_whole_rate: false,
    takes_descriptions: false,
    write: |motion, out| write(motion, &AMP, out),
    ..MJLAB
};

/// The names of arrays.
struct Names {
    joints: [&'static str; 2],
    /// Positions, rotations, linear and angular velocities.
    bodies: [&'static str; 4],
    /// The names of joints and bodies, where files always have them.
    names: Option<[&'static str; 2]>,
    /// The rate: (1,) or a number.
    rate_shape: &'static [usize],
}

const TRACKER: Names = Names {
    joints: ["joint_pos", "joint_vel"],
    bodies: [
        "body_pos_w",
        "body_quat_w",
        "body_lin_vel_w",
        "body_ang_vel_w",
    ],
    names: None,
    rate_shape: &[1],
};

const AMP: Names = Names {
    joints: ["dof_positions", "dof_velocities"],
    bodies: [
        "body_positions",
        "body_rotations",
        "body_linear_velocities",
        "body_angular_velocities",
    ],
    names: Some(["dof_names", "body_names"]),
    rate_shape: &[],
};

fn write(motion: &RobotMotion<'_>, names: &Names, out: &mut dyn Write) -> Result<(), WriteError> {
    let mut members = ArchiveWriter::new();
    let rate = motion.rate.per_second();
    let element = if rate.fract() == 0.0 {
        Element::Signed(8)
    } else {
        Element::F64
    };
    members.numbers("fps.npy", (&element, names.rate_shape), false, |put| {
        put(rate)
    })?;
    let named = names.names.or(motion
        .description
        .as_ref()
        .map(|_| [JOINT_NAMES, BODY_NAMES]));
    if let Some([joints, bodies]) = named {
        for (name, texts) in [
            (joints, motion.joint_names()),
            (bodies, motion.body_names()),
        ] {
            members.texts(&format!("{name}.npy"), &texts, &[texts.len()])?;
        }
    }
    let (samples, bodies) = (motion.samples(), motion.bodies.order.len());
    let shape = [samples, motion.joints.len()];
    members.numbers(
        &path(names.joints[0]),
        (&Element::F32, &shape),
        false,
        |put| {
            let mut all = (0..samples).flat_map(|sample| motion.values(sample));
            all.try_for_each(|value| put(value.into()))
        },
    )?;
    members.numbers(
        &path(names.joints[1]),
        (&Element::F32, &shape),
        false,
        |put| {
            let mut all = (0..samples).flat_map(|sample| motion.rates(sample));
            all.try_for_each(|rate| put(rate.into()))
        },
    )?;
    type Numbers = fn(&BodyMotion) -> Vec<f64>;
    let of_bodies: [(usize, Numbers); 4] = [
        (3, |body| body.pose.position.to_array().to_vec()),
        (4, |body| {
            ordered(body.pose.rotation.to_array(), ComponentOrder::Wxyz).to_vec()
        }),
        (3, |body| body.velocity.linear.to_array().to_vec()),
        (3, |body| body.velocity.angular.to_array().to_vec()),
    ];
    for (name, (width, numbers)) in names.bodies.into_iter().zip(of_bodies) {
        let shape = [samples, bodies, width];
        members.numbers(&path(name), (&Element::F32, &shape), false, |put| {
            (motion.bodies.motions.iter())
                .try_for_each(|body| numbers(body).into_iter().try_for_each(&mut *put))
        })?;
    }
    for (name, text) in motion.description.iter().flatten() {
        members.texts(&path(name), &[text], &[])?;
    }
    members.finish(out).map_err(io::Error::into)
}

fn path(name: &str) -> String {
    format!("{name}.npy")
}
