//! Writes the motion of a robot in the layouts of other programs, which [`WRITTEN`] lists.
//!
//! The joints are interpolated, and the bodies follow from them ([`bodies`](crate::robot::bodies)); a writer puts the
//! numbers into the arrays or columns of its dialect, in its orders, with the types that the programs have.

mod arrays;
mod columns;
mod pickles;
mod tensors;

use std::io::Write;

use glam::DVec3;
use tumble::FrameRate;
use tumble::trees::{BodyOrder, JointKind, Tree, TreeJoint};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Format, WriteError};
use crate::quaternion::ComponentOrder;
use crate::robot::{Bodies, FixedBodies, RobotFormat, VelocityPoint, joints_of};

/// A dialect that is written.
#[derive(Debug)]
pub struct WrittenDialect {
    /// Its name in options.
    pub name: &'static str,
    /// A short description.
    pub summary: &'static str,
    /// The name of the format that holds it: `npz`, `csv`, `pickle` or `torch`.
    pub format: &'static str,
    /// The order of its joints, and of its bodies if it has them.
    pub order: BodyOrder,
    /// Whether it has the poses and velocities of bodies.
    pub has_bodies: bool,
    /// Whether it names joints, so that they may be in any order.
    pub names_joints: bool,
    /// Whether its numbers for joints are degrees. Slides have none.
    pub has_degrees: bool,
    /// Whether its simulator merges fixed links of URDF into the links to which they are fixed. Bodies of MJCF are not
    /// merged.
    pub merges_links: bool,
    /// The point of a body whose velocity it has.
    pub velocity_at: VelocityPoint,
    /// The order of a quaternion's components; `None` if it has none.
    pub quaternions: Option<ComponentOrder>,
    /// The rate that its readers assume, in frames a second, if it has none.
    pub assumed_rate: Option<u64>,
    /// Whether its readers only accept rates of whole frames per second.
    pub has_whole_rate: bool,
    /// The meaning of other endings than [`WrittenDialect::extension`] to its readers, if they decide by it.
    pub other_endings: Option<&'static str>,
    /// Whether it can have further arrays, which its readers ignore.
    pub takes_descriptions: bool,
    write: fn(&RobotMotion<'_>, &mut dyn Write) -> Result<(), WriteError>,
}

/// All dialects that are written. To add one, write its function in a module below, and add its row here.
pub static WRITTEN: &[&WrittenDialect] = &[
    &arrays::MJLAB,
    &arrays::BEYONDMIMIC,
    &arrays::ISAACLAB,
    &columns::UNITREE,
    &columns::KIMODO,
    &columns::BONES_SEED,
    &pickles::GMR,
    &pickles::MOTION_LIB,
    &pickles::MIMICKIT,
    &tensors::PROTOMOTIONS,
];

/// The motion of a robot at samples of one rate.
#[derive(Debug)]
pub struct RobotMotion<'a> {
    /// The robot.
    pub tree: &'a Tree,
    /// The joints and the bodies; linear velocities are those of the dialect's point.
    pub bodies: &'a Bodies,
    /// The joints that are written, by their numbers among [`Tree::scalar_joints`]; see [`written_joints`].
    pub joints: Vec<usize>,
    /// The number to add to each joint's values, in the order of [`Tree::scalar_joints`]: whole turns.
    pub origins: Vec<f64>,
    /// The rate of the samples.
    pub rate: FrameRate,
    /// The name of the clip.
    pub name: &'a str,
    /// How the samples were made; `Some`: written beside the motion, with the names and orders of joints and bodies.
    pub description: Option<Vec<(&'static str, String)>>,
    /// The output's name in messages.
    pub output: &'a str,
}

/// The joints of a robot in the order of their bodies, by their numbers among [`Tree::scalar_joints`].
#[must_use]
pub fn written_joints(tree: &Tree, bodies: &[usize]) -> Vec<usize> {
    joints_of(tree, bodies)
}

/// The remedy in messages about motions that no dialect can hold.
const OTHER_FILES: &str =
    "leave out --dialect (in Python `dialect`) and write NPZ, CSV or Parquet, which can store it";

impl WrittenDialect {
    /// The dialect of this name; case is ignored.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let mut all = WRITTEN.iter().copied();
        all.find(|dialect| dialect.name.eq_ignore_ascii_case(name))
    }

    /// How its simulator has the bodies without joints of a file of this kind.
    #[must_use]
    pub fn fixed_bodies(&self, format: RobotFormat) -> FixedBodies {
        match format {
            RobotFormat::Urdf if self.merges_links => FixedBodies::Merge,
            _ => FixedBodies::Keep,
        }
    }

    /// How files in it end.
    #[must_use]
    pub fn extension(&self) -> &'static str {
        Format::named(self.format).map_or(self.format, Format::ending)
    }

    /// Writes a motion; returns warnings about data that is not stored.
    ///
    /// # Errors
    /// When writing fails, or the dialect cannot hold the motion.
    pub fn write(
        &self,
        motion: &RobotMotion<'_>,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let refuse = |message: String| Diagnostic::new(motion.output, Code::Dialect, message);
        let rate = motion.rate;
        if self.has_whole_rate && rate.per_second().fract() != 0.0 {
            let message = format!(
                "{} stores a whole number of frames a second, and the rate is {rate}; give --fps {} (with `tumble \
                 eval`)",
                self.name,
                rate.per_second().round().max(1.0)
            );
            return Err(refuse(message).into());
        }
        let counts = motion.tree.counts();
        if counts.balls > 0 {
            let message = format!(
                "the robot has {} balls, and {} has one number for each joint; {OTHER_FILES}",
                counts.balls, self.name
            );
            return Err(refuse(message).into());
        }
        let mut joints = motion.tree_joints().into_iter();
        let slide = joints.find(|joint| joint.kind == JointKind::Slide);
        if let Some(slide) = slide.filter(|_| self.has_degrees) {
            let message = format!(
                "`{}` slides, and {} has an angle in degrees for each joint; {OTHER_FILES}",
                slide.name, self.name
            );
            return Err(refuse(message).into());
        }
        if counts.free > 1 {
            let message = format!(
                "the robot has {} free joints, and {} has one root; {OTHER_FILES}",
                counts.free, self.name
            );
            return Err(refuse(message).into());
        }
        (self.write)(motion, out)?;
        let assumed = self
            .assumed_rate
            .filter(|&assumed| rate.per_second() != assumed as f64);
        let warning = assumed.map(|assumed| {
            let message = format!(
                "{} stores no rate, and programs that read it assume {assumed} frames a second; this motion has {rate}: \
                 set the rate in that program, or use `tumble eval --fps {assumed}`",
                self.name
            );
            Diagnostic::new(motion.output, Code::AssumedRate, message)
        });
        Ok(warning.into_iter().collect())
    }
}

impl RobotMotion<'_> {
    fn samples(&self) -> usize {
        self.bodies.times.len()
    }

    /// The written joints.
    fn tree_joints(&self) -> Vec<&TreeJoint> {
        let all: Vec<&TreeJoint> = self.tree.scalar_joints().collect();
        self.joints.iter().map(|&joint| all[joint]).collect()
    }

    fn joint_names(&self) -> Vec<&str> {
        self.tree_joints()
            .into_iter()
            .map(|joint| &*joint.name)
            .collect()
    }

    fn body_names(&self) -> Vec<&str> {
        let bodies = self.tree.bodies();
        self.bodies
            .order
            .iter()
            .map(|&body| &*bodies[body].name)
            .collect()
    }

    /// The values of the written joints at a sample.
    fn values(&self, sample: usize) -> impl Iterator<Item = f32> {
        let all = self.row(&self.bodies.joint_values, sample);
        self.joints.iter().map(move |&joint| {
            let origin = self.origins.get(joint).copied().unwrap_or(0.0);
            (f64::from(all[joint]) + origin) as f32
        })
    }

    /// The velocities of the written joints at a sample.
    fn rates(&self, sample: usize) -> impl Iterator<Item = f32> {
        let all = self.row(&self.bodies.joint_rates, sample);
        self.joints.iter().map(|&joint| all[joint])
    }

    fn row<'a>(&self, all: &'a [f32], sample: usize) -> &'a [f32] {
        let width = self.tree.counts().scalars;
        &all[sample * width..][..width]
    }

    /// The position of the root at a sample.
    fn root_position(&self, sample: usize) -> DVec3 {
        self.bodies
            .roots
            .get(sample)
            .map_or(DVec3::ZERO, |pose| pose.position)
    }

    /// The rotation of the root at a sample, x y z w.
    fn root_rotation(&self, sample: usize) -> [f64; 4] {
        let rotation = self
            .bodies
            .roots
            .get(sample)
            .map(|pose| pose.rotation.to_array());
        rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])
    }

    /// The axis of each written joint in its body; slides have none.
    fn axes(&self) -> Vec<DVec3> {
        let axis = |joint: &TreeJoint| match joint.kind {
            JointKind::Hinge => joint.axis,
            _ => DVec3::ZERO,
        };
        self.tree_joints().into_iter().map(axis).collect()
    }
}

/// The components of a quaternion x y z w in an order.
fn ordered([x, y, z, w]: [f64; 4], order: ComponentOrder) -> [f64; 4] {
    match order {
        ComponentOrder::Xyzw => [x, y, z, w],
        ComponentOrder::Wxyz => [w, x, y, z],
    }
}
