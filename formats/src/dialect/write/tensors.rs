//! Files of `torch.save`, as `ProtoMotions` has them: an archive with a pickle in protocol 2, and a member with the
//! bytes of each tensor.
//!
//! The pickle names nothing but tensors, so that `torch.load(…, weights_only=True)` reads it. `ProtoMotions` sets its
//! enum `state_conversion` itself when it loads a file.

use std::io::{self, Write};

use tumble::trees::BodyMotion;

use super::pickles::{GMR, Pickle};
use super::{RobotMotion, WrittenDialect};
use crate::format::WriteError;
use crate::npz::write::ArchiveWriter;

pub(super) static PROTOMOTIONS: WrittenDialect = WrittenDialect {
    name: "protomotions",
    summary: "`.motion` of ProtoMotions: joints and bodies, x y z w, velocities of origins; no contacts",
    format: "torch",
    has_bodies: true,
    other_endings: Some("ProtoMotions reads .pt as a library of clips, and a clip as .motion"),
    write,
    ..GMR
};

/// The folder in the archive.
const ROOT: &str = "archive";

/// `torch.save` begins the bytes of tensors at multiples of this.
const ALIGNMENT: u16 = 64;

fn write(motion: &RobotMotion<'_>, out: &mut dyn Write) -> Result<(), WriteError> {
    let (samples, joints) = (motion.samples(), motion.joints.len());
    let bodies = motion.bodies.order.len();
    let of_bodies = |numbers: fn(&BodyMotion) -> Vec<f64>| -> Vec<f32> {
        let all = motion.bodies.motions.iter().flat_map(numbers);
        all.map(|number| number as f32).collect()
    };
    let values = (0..samples).flat_map(|sample| motion.values(sample));
    let rates = (0..samples).flat_map(|sample| motion.rates(sample));
    let arrays: [(&str, &[usize], Vec<f32>); 6] = [
        ("dof_pos", &[samples, joints], values.collect()),
        ("dof_vel", &[samples, joints], rates.collect()),
        (
            "rigid_body_pos",
            &[samples, bodies, 3],
            of_bodies(|body| body.pose.position.to_array().to_vec()),
        ),
        (
            "rigid_body_rot",
            &[samples, bodies, 4],
            of_bodies(|body| body.pose.rotation.to_array().to_vec()),
        ),
        (
            "rigid_body_vel",
            &[samples, bodies, 3],
            of_bodies(|body| body.velocity.linear.to_array().to_vec()),
        ),
        (
            "rigid_body_ang_vel",
            &[samples, bodies, 3],
            of_bodies(|body| body.velocity.angular.to_array().to_vec()),
        ),
    ];
    let mut pickle = Pickle::new();
    pickle.dict(|pickle| {
        pickle.key("fps").number(motion.rate.per_second());
        for (key, (name, shape, _)) in arrays.iter().enumerate() {
            pickle.key(name).tensor(&key.to_string(), shape);
        }
    });
    let mut members = ArchiveWriter::new();
    let mut add = |name: &str, bytes: &[u8]| -> io::Result<()> {
        members.aligned(&format!("{ROOT}/{name}"), bytes, ALIGNMENT)
    };
    add("data.pkl", &pickle.into_bytes())?;
    add("byteorder", b"little")?;
    for (key, (.., numbers)) in arrays.iter().enumerate() {
        let bytes: Vec<u8> = numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        add(&format!("data/{key}"), &bytes)?;
    }
    add("version", b"3\n")?;
    Ok(members.finish(out)?)
}
