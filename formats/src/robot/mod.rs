//! Robots: kinematic trees in MJCF (`MuJoCo`) and URDF (ROS).
//!
//! [`Robot::open`] reads the bodies and joints of a file. Meshes, inertias, sensors and actuators are not read, and no file but those that an MJCF includes is opened. The rules were compared with `MuJoCo` and pinocchio;
//! [docs/robots.md](https://github.com/tumble-rs/tumble/blob/main/docs/robots.md) has them.

mod assign;
mod bodies;
mod library;
mod merge;
mod mjcf;
mod urdf;
mod xml;

use std::path::{Path, PathBuf};

use tumble::names;
use tumble::trees::{Configuration, Tree};

pub(crate) use assign::joints_of;
pub use bodies::{
    Bodies, BodiesError, BodiesRequest, LimitExcess, LimitRule, VelocityPoint, VelocitySource,
    bodies, body_arrays, clamp_scalars, mass_centres, scalar_excesses, unwrap_angles, unwrap_joint,
};
pub use library::{LARGEST_ANGLE, RobotClipError, RobotTracks};
pub use merge::FixedBodies;

use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::robot::xml::Files;

/// A robot as a file describes it.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Its name; empty if the file does not say it.
    pub name: String,
    /// The kind of file.
    pub format: RobotFormat,
    /// Its bodies and joints. The bodies are in the order of `MuJoCo`: depth first, children as in the file.
    pub tree: Tree,
    /// The mass of each body in kilograms; `None` if the file does not state it.
    pub masses: Vec<Option<f64>>,
    /// The bodies of the file that are parts of others ([`Robot::merged`]).
    pub merged: Vec<String>,
    /// The configurations that the file names, such as `home`.
    pub poses: Vec<(String, Configuration)>,
    /// How many relations between joints the file has that are not applied (`equality/joint` of MJCF), as `MuJoCo`'s
    /// kinematics do not apply them.
    pub couplings: usize,
    /// Warnings about the file.
    pub warnings: Vec<Diagnostic>,
}

/// A kind of file with a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RobotFormat {
    /// `MuJoCo`'s XML.
    Mjcf,
    /// The Unified Robot Description Format of ROS.
    Urdf,
}

names! {
    RobotFormat, "kind of robot",
    Mjcf => "mjcf",
    Urdf => "urdf",
}

/// Extensions of files with robots.
pub const EXTENSIONS: [&str; 3] = ["xml", "mjcf", "urdf"];

/// The largest length of a robot's files together in bytes.
const MAX_BYTES: u64 = 4 << 20;

/// The largest number of bodies.
const MAX_BODIES: usize = 65_536;

/// How large the files of a robot may be.
fn limits() -> Limits {
    Limits {
        file: MAX_BYTES,
        ..Limits::default()
    }
}

/// The files that an MJCF includes, relative to its folder; none if it cannot be read.
pub(crate) fn included_files(path: &Path) -> Vec<PathBuf> {
    Files::open(path, limits()).map_or(Vec::new(), Files::into_included)
}

/// How deep bodies and frames may be nested.
const MAX_DEPTH: usize = 512;

impl Robot {
    /// Whether a path has an extension of files with robots.
    #[must_use]
    pub fn has_extension(path: &Path) -> bool {
        let extension = path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| {
            (EXTENSIONS.iter()).any(|known| known.eq_ignore_ascii_case(extension))
        })
    }

    /// Reads a robot; the root element says whether it is MJCF (`mujoco`) or URDF (`robot`).
    ///
    /// # Errors
    /// When the file cannot be opened, is no robot, is larger than 4 MiB, or its bodies are no tree.
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        Self::of(&Files::open(path, limits())?)
    }

    /// As [`Robot::open`], from the bytes of a file that includes no others; `name` is the input's name in messages.
    ///
    /// # Errors
    /// As there, and when it includes a file.
    pub fn read(name: &str, bytes: Vec<u8>) -> Result<Self, Diagnostic> {
        Self::of(&Files::of_bytes(name, bytes, limits())?)
    }

    fn of(files: &Files) -> Result<Self, Diagnostic> {
        let documents = files.parse()?;
        let root = documents.root();
        match documents.tag(root) {
            "mujoco" => mjcf::read(&documents),
            "robot" => urdf::read(&documents),
            other => Err(documents.refuse(
                root,
                Code::OtherFormat,
                format!(
                    "the root element is <{other}>; a robot is <mujoco> (MJCF) or <robot> (URDF)"
                ),
            )),
        }
    }
}
