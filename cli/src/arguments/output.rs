//! `--output` and its options: what is written for each rotation.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::Vec3;
use tumble::{Axes, Encoding, EncodingOptions, EulerSequence, MatrixOrder, Quantity, Skeleton};
use tumble_formats::quaternion::ComponentOrder;

use crate::arguments::command_line::CommandLine;

#[derive(Debug, Clone, Args)]
pub(crate) struct OutputArguments {
    /// What to write of each rotation
    #[arg(
        long = "output",
        value_name = "WHAT",
        default_value = "quaternion",
        value_parser = one_of(outputs())
    )]
    output: OutputKind,
    /// euler, BVH: the sequence of axes, intrinsic (XYZ, ZXZ …) or extrinsic (xyz, zxz …)
    /// [default: XYZ; BVH: ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// matrix: the order of its elements in memory
    #[arg(long, value_enum, default_value = "row")]
    major: Major,
    /// world, transform: each track's parent, counted from 0, -1 for none [default: a chain, -1,0,1 …]
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    parents: Option<Vec<i64>>,
    /// velocity, acceleration: the axes that they are measured in
    #[arg(long, value_enum, default_value = "body")]
    axes: AxesArgument,
}

#[derive(Debug, Clone, Copy)]
enum OutputKind {
    Quaternion,
    Encoded(Encoding),
    Velocity,
    Acceleration,
    Transform,
    World,
}

const QUATERNION: &str = "quaternion";

/// A value of an argument, with its name and its help.
type NamedValue<T> = (&'static str, &'static str, T);

/// The values of `--output`: quaternions, the other representations of rotations, rates, and poses.
fn outputs() -> Vec<NamedValue<OutputKind>> {
    let others = encodings(|encoding| !encoding.is_quaternion() && encoding != Encoding::Vector);
    let others = others.map(|(name, help, encoding)| (name, help, OutputKind::Encoded(encoding)));
    let poses = "(frames, tracks, 10): translation x y z, rotation x y z w, scale x y z";
    let world = "(frames, tracks, 7): position x y z and rotation x y z w in the world";
    let order = "x y z w (--order); CSV: w x y z";
    let mut outputs = vec![(QUATERNION, order, OutputKind::Quaternion)];
    outputs.extend(others);
    outputs.extend([
        ("velocity", "angular velocity, rad/s", OutputKind::Velocity),
        (
            "acceleration",
            "angular acceleration, rad/s²",
            OutputKind::Acceleration,
        ),
        ("transform", poses, OutputKind::Transform),
        ("world", world, OutputKind::World),
    ]);
    outputs.dedup_by_key(|(name, ..)| *name); // those that differ by their options
    outputs
}

fn encodings(filter: impl Fn(Encoding) -> bool) -> impl Iterator<Item = NamedValue<Encoding>> {
    let all = Encoding::KINDS
        .into_iter()
        .filter(move |encoding| filter(*encoding));
    all.map(|encoding| (encoding.name(), encoding.summary(), encoding))
}

/// Parses the name of a representation of quaternions.
pub(crate) fn quaternions() -> impl TypedValueParser<Value = Encoding> {
    one_of(encodings(Encoding::is_quaternion).collect())
}

/// Parses one of these names.
fn one_of<T: Clone + Send + Sync + 'static>(
    all: Vec<NamedValue<T>>,
) -> impl TypedValueParser<Value = T> {
    let value = |&(name, help, _): &NamedValue<T>| PossibleValue::new(name).help(help);
    let values: Vec<PossibleValue> = all.iter().map(value).collect();
    PossibleValuesParser::new(values).map(move |text| {
        let found = all.iter().find(|(name, ..)| *name == text);
        found.expect("clap takes these names alone").2.clone()
    })
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Major {
    /// row by row
    Row,
    /// column by column
    Column,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AxesArgument {
    /// the body's own axes
    Body,
    /// the axes of the parent, or of the world for a track without one
    #[value(alias = "world")]
    Parent,
}

/// The order of a quaternion's components.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum OrderArgument {
    /// as in memory, glTF and SciPy
    Xyzw,
    /// as in .dat files
    Wxyz,
}

impl OrderArgument {
    pub(crate) fn order(self) -> ComponentOrder {
        match self {
            Self::Xyzw => ComponentOrder::Xyzw,
            Self::Wxyz => ComponentOrder::Wxyz,
        }
    }
}

/// The kinds of whole poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseKind {
    Transform,
    World,
}

/// Reads a sequence of axes, for clap.
pub(crate) fn sequence(name: &str) -> Result<EulerSequence, String> {
    name.parse().map_err(|_| {
        "give three axes, no two neighbours the same: XYZ, ZXZ … for intrinsic axes, xyz, zxz … for extrinsic ones"
            .to_owned()
    })
}

impl OutputArguments {
    /// The encoding of the output; quaternions are stored as `components`.
    pub(crate) fn encoding(&self, components: Encoding) -> Encoding {
        let order = match self.major {
            Major::Row => MatrixOrder::RowMajor,
            Major::Column => MatrixOrder::ColumnMajor,
        };
        let sequence = self.sequence.unwrap_or(EulerSequence::XYZ);
        match self.output {
            OutputKind::Quaternion | OutputKind::Transform | OutputKind::World => components,
            OutputKind::Encoded(encoding) => encoding.with(EncodingOptions { order, sequence }),
            OutputKind::Velocity | OutputKind::Acceleration => Encoding::Vector,
        }
    }

    /// The skeleton of a chain of boxes of that length, or of `--parents`, and the offset of each track
    /// from its parent.
    pub(crate) fn skeleton(
        &self,
        tracks: usize,
        length: f64,
    ) -> Result<(Skeleton, Vec<Vec3>), String> {
        let hung = |parent: &Option<usize>| match parent {
            None => Vec3::ZERO,
            Some(_) => Vec3::new(0.0, -length as f32, 0.0),
        };
        let Some(parents) = &self.parents else {
            let offsets = (0..tracks).map(|track| hung(&track.checked_sub(1)));
            let chain = Skeleton::chain(tracks, length).map_err(|error| error.to_string())?;
            return Ok((chain, offsets.collect()));
        };
        if parents.len() != tracks {
            let count = parents.len();
            return Err(format!("--parents has {count} entries for {tracks} tracks"));
        }
        let parents: Vec<Option<usize>> = parents
            .iter()
            .map(|&parent| match parent {
                -1 => Ok(None),
                _ => usize::try_from(parent).map(Some).map_err(|_| {
                    format!("--parents: {parent} is not the index of a track; use -1 for no parent")
                }),
            })
            .collect::<Result<_, _>>()?;
        let offsets: Vec<Vec3> = parents.iter().map(hung).collect();
        let skeleton = Skeleton::new(parents, offsets.clone());
        let skeleton = skeleton.map_err(|error| format!("--parents: {error}"))?;
        Ok((skeleton, offsets))
    }

    /// Whether plain rotations are written.
    pub(crate) fn is_rotations(&self) -> bool {
        matches!(self.output, OutputKind::Quaternion)
    }

    /// The axes of Euler angles.
    pub(crate) fn sequence(&self) -> Option<EulerSequence> {
        self.sequence
    }

    /// The name of the output.
    pub(crate) fn name(&self) -> &'static str {
        match self.output {
            OutputKind::Quaternion => QUATERNION,
            OutputKind::Encoded(encoding) => encoding.name(),
            OutputKind::Velocity => "velocity",
            OutputKind::Acceleration => "acceleration",
            OutputKind::Transform => "transform",
            OutputKind::World => "world",
        }
    }

    /// Whether `--parents` is set.
    pub(crate) fn has_parents(&self) -> bool {
        self.parents.is_some()
    }

    /// Refuses options that have no effect on the output. `is_angles`: Euler angles are written whatever
    /// `--output` is (BVH).
    pub(crate) fn check(&self, command_line: &CommandLine, is_angles: bool) -> Result<(), String> {
        let name = self.name();
        let default = EncodingOptions {
            order: MatrixOrder::RowMajor,
            sequence: EulerSequence::XYZ,
        };
        let asks = |other: EncodingOptions| matches!(self.output, OutputKind::Encoded(encoding) if encoding.with(default) != encoding.with(other));
        let is_matrix = asks(EncodingOptions {
            order: MatrixOrder::ColumnMajor,
            ..default
        });
        let is_euler = asks(EncodingOptions {
            sequence: "ZXY".parse().unwrap_or(EulerSequence::XYZ),
            ..default
        });
        let is_rate = matches!(self.output, OutputKind::Velocity | OutputKind::Acceleration);
        for (option, applies, wants) in [
            ("sequence", is_euler || is_angles, "--output euler, or BVH"),
            ("major", is_matrix, "--output matrix or matrix-3x4"),
            ("axes", is_rate, "--output velocity or acceleration"),
            (
                "parents",
                self.poses().is_some(),
                "--output world or transform",
            ),
        ] {
            if command_line.has(option) && !applies {
                return Err(format!(
                    "--{option} has no effect on --output {name}; leave it out, or use {wants}"
                ));
            }
        }
        Ok(())
    }

    /// The kind of poses, if whole poses are written.
    pub(crate) fn poses(&self) -> Option<PoseKind> {
        match self.output {
            OutputKind::Transform => Some(PoseKind::Transform),
            OutputKind::World => Some(PoseKind::World),
            _ => None,
        }
    }

    pub(crate) fn quantity(&self) -> Quantity {
        let axes = match self.axes {
            AxesArgument::Body => Axes::Body,
            AxesArgument::Parent => Axes::Parent,
        };
        match self.output {
            OutputKind::Velocity => Quantity::Velocity(axes),
            OutputKind::Acceleration => Quantity::Acceleration(axes),
            _ => Quantity::Rotation,
        }
    }
}
