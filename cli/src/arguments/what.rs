//! Arguments that say what of each rotation is written.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::Vec3;
use tumble::{Axes, Encoding, EncodingOptions, EulerSequence, MatrixOrder, Quantity, Skeleton};
use tumble_formats::npy::ComponentOrder;

use crate::arguments::given::Given;

#[derive(Debug, Clone, Args)]
pub(crate) struct What {
    /// What to write of each rotation
    #[arg(
        long = "output",
        value_name = "WHAT",
        default_value = "quaternion",
        value_parser = one_of(outputs())
    )]
    output: Output,
    /// euler, BVH: the axes, about turned ones (XYZ, ZXZ …) or about fixed ones (xyz, zxz …)
    /// [default: XYZ; BVH: ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// matrix: how it lies in memory
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
    /// velocity, acceleration: whose axes
    #[arg(long, value_enum, default_value = "body")]
    axes: AxesArgument,
}

#[derive(Debug, Clone, Copy)]
enum Output {
    Quaternion,
    Encoded(Encoding),
    Velocity,
    Acceleration,
    Transform,
    World,
}

const QUATERNION: &str = "quaternion";

/// A value of an argument, with its name and its help.
type Named<T> = (&'static str, &'static str, T);

/// What `--output` knows: every representation that is no quaternion, and what is no rotation.
fn outputs() -> Vec<Named<Output>> {
    let others = encodings(|own| !own.is_quaternion() && own != Encoding::Vector);
    let others = others.map(|(name, help, own)| (name, help, Output::Encoded(own)));
    let poses = "(frames, tracks, 10): translation x y z, rotation x y z w, scale x y z";
    let world = "(frames, tracks, 7): where each box hangs, and how it is turned in the world";
    let order = "x y z w (--order); CSV: w x y z";
    let mut outputs = vec![(QUATERNION, order, Output::Quaternion)];
    outputs.extend(others);
    outputs.extend([
        ("velocity", "angular velocity, rad/s", Output::Velocity),
        (
            "acceleration",
            "angular acceleration, rad/s²",
            Output::Acceleration,
        ),
        ("transform", poses, Output::Transform),
        ("world", world, Output::World),
    ]);
    outputs.dedup_by_key(|(name, ..)| *name); // those that differ by their options
    outputs
}

fn encodings(filter: impl Fn(Encoding) -> bool) -> impl Iterator<Item = Named<Encoding>> {
    let all = Encoding::KINDS.into_iter().filter(move |own| filter(*own));
    all.map(|own| (own.name(), own.summary(), own))
}

/// Parses the name of a representation of quaternions.
pub(crate) fn quaternions() -> impl TypedValueParser<Value = Encoding> {
    one_of(encodings(Encoding::is_quaternion).collect())
}

/// Parses one of these names.
fn one_of<T: Clone + Send + Sync + 'static>(
    all: Vec<Named<T>>,
) -> impl TypedValueParser<Value = T> {
    let value = |&(name, help, _): &Named<T>| PossibleValue::new(name).help(help);
    let values: Vec<PossibleValue> = all.iter().map(value).collect();
    PossibleValuesParser::new(values).map(move |given| {
        let own = all.iter().find(|(name, ..)| *name == given);
        own.expect("clap takes these names alone").2.clone()
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
    /// of what turns
    Body,
    /// of what it turns in: its parent, or the world for a track without one
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

/// What whole poses hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseKind {
    Transform,
    World,
}

/// Reads a sequence of axes, for clap.
pub(crate) fn sequence(name: &str) -> Result<EulerSequence, String> {
    name.parse().map_err(|_| {
        "give three axes, no two neighbours the same: XYZ, ZXZ … about turned axes, xyz, zxz … about fixed ones"
            .to_owned()
    })
}

impl What {
    /// How it is stored; quaternions as `components` says.
    pub(crate) fn encoding(&self, components: Encoding) -> Encoding {
        let order = match self.major {
            Major::Row => MatrixOrder::RowMajor,
            Major::Column => MatrixOrder::ColumnMajor,
        };
        let sequence = self.sequence.unwrap_or(EulerSequence::XYZ);
        match self.output {
            Output::Quaternion | Output::Transform | Output::World => components,
            Output::Encoded(own) => own.with(EncodingOptions { order, sequence }),
            Output::Velocity | Output::Acceleration => Encoding::Vector,
        }
    }

    /// Which track hangs from which, at the ends of boxes of that length, and where each hangs.
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
            let given = parents.len();
            return Err(format!("--parents has {given} entries for {tracks} tracks"));
        }
        let parents: Vec<Option<usize>> = parents
            .iter()
            .map(|&parent| match parent {
                -1 => Ok(None),
                _ => usize::try_from(parent)
                    .map(Some)
                    .map_err(|_| format!("--parents: {parent} is no track; -1 is none")),
            })
            .collect::<Result<_, _>>()?;
        let offsets: Vec<Vec3> = parents.iter().map(hung).collect();
        let skeleton = Skeleton::new(parents, offsets.clone());
        let skeleton = skeleton.map_err(|error| format!("--parents: {error}"))?;
        Ok((skeleton, offsets))
    }

    /// Whether nothing else was asked for than the rotations themselves.
    pub(crate) fn is_rotations(&self) -> bool {
        matches!(self.output, Output::Quaternion)
    }

    /// The axes of Euler angles.
    pub(crate) fn sequence(&self) -> Option<EulerSequence> {
        self.sequence
    }

    /// The name of what is written.
    pub(crate) fn name(&self) -> &'static str {
        match self.output {
            Output::Quaternion => QUATERNION,
            Output::Encoded(own) => own.name(),
            Output::Velocity => "velocity",
            Output::Acceleration => "acceleration",
            Output::Transform => "transform",
            Output::World => "world",
        }
    }

    /// The parents that were given.
    pub(crate) fn has_parents(&self) -> bool {
        self.parents.is_some()
    }

    /// Refuses what says nothing to the numbers that are written. `is_angles`: angles are written
    /// whatever `--output` says (BVH).
    pub(crate) fn check(&self, given: &Given, is_angles: bool) -> Result<(), String> {
        let name = self.name();
        let usual = EncodingOptions {
            order: MatrixOrder::RowMajor,
            sequence: EulerSequence::XYZ,
        };
        let asks = |other: EncodingOptions| matches!(self.output, Output::Encoded(own) if own.with(usual) != own.with(other));
        let is_matrix = asks(EncodingOptions {
            order: MatrixOrder::ColumnMajor,
            ..usual
        });
        let is_euler = asks(EncodingOptions {
            sequence: "ZXY".parse().unwrap_or(EulerSequence::XYZ),
            ..usual
        });
        let is_rate = matches!(self.output, Output::Velocity | Output::Acceleration);
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
            if given.has(option) && !applies {
                return Err(format!(
                    "--{option} says nothing to --output {name}; leave it out, or write {wants}"
                ));
            }
        }
        Ok(())
    }

    /// Whether whole poses are written, and which.
    pub(crate) fn poses(&self) -> Option<PoseKind> {
        match self.output {
            Output::Transform => Some(PoseKind::Transform),
            Output::World => Some(PoseKind::World),
            _ => None,
        }
    }

    pub(crate) fn quantity(&self) -> Quantity {
        let axes = match self.axes {
            AxesArgument::Body => Axes::Body,
            AxesArgument::Parent => Axes::Parent,
        };
        match self.output {
            Output::Velocity => Quantity::Velocity(axes),
            Output::Acceleration => Quantity::Acceleration(axes),
            _ => Quantity::Rotation,
        }
    }
}
