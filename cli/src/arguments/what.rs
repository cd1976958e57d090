//! Arguments that say what of each rotation is written.

use clap::{Args, ValueEnum};
use glam::Vec3;
use tumble::{Axes, Encoding, EulerSequence, MatrixOrder, Quantity, Skeleton};

#[derive(Debug, Clone, Args)]
pub(crate) struct What {
    /// What to write of each rotation
    #[arg(
        long = "output",
        value_enum,
        value_name = "WHAT",
        default_value = "quaternion"
    )]
    output: Output,
    /// euler, BVH: the axes, about turned ones (XYZ, ZXZ …) or about fixed ones (xyz, zxz …)
    /// [default: XYZ; BVH: ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// matrix: how it lies in memory
    #[arg(long, value_enum, default_value = "row")]
    major: Major,
    /// world: each track's parent, counted from 0, -1 for none [default: a chain, -1,0,1 …]
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

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Output {
    /// x y z w
    Quaternion,
    /// x y z of the axis, and degrees, 0 to 360
    AxisAngle,
    /// 3 × 3, for column vectors
    Matrix,
    /// 3 × 4, its translation 0
    #[value(name = "matrix-3x4")]
    Matrix3x4,
    /// three angles, degrees
    Euler,
    /// angular velocity, rad/s
    Velocity,
    /// angular acceleration, rad/s²
    Acceleration,
    /// (frames, tracks, 10): translation x y z, rotation x y z w, scale x y z
    Transform,
    /// (frames, tracks, 7): where each box hangs, and how it is turned in the world
    World,
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
    /// of what it turns in (the parent)
    World,
}

/// What whole poses hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseKind {
    Transform,
    World,
}

fn sequence(name: &str) -> Result<EulerSequence, String> {
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
        match self.output {
            Output::Quaternion | Output::Transform | Output::World => components,
            Output::AxisAngle => Encoding::AxisAngle,
            Output::Matrix => Encoding::Matrix3x3(order),
            Output::Matrix3x4 => Encoding::Matrix3x4(order),
            Output::Euler => Encoding::Euler(self.sequence.unwrap_or(EulerSequence::XYZ)),
            Output::Velocity | Output::Acceleration => Encoding::Vector,
        }
    }

    /// Which track hangs from which, at the ends of boxes of that length.
    pub(crate) fn skeleton(&self, tracks: usize, length: f64) -> Result<Skeleton, String> {
        let Some(parents) = &self.parents else {
            return Ok(Skeleton::chain(tracks, length));
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
        let hung = |parent: &Option<usize>| match parent {
            None => Vec3::ZERO,
            Some(_) => Vec3::new(0.0, -length as f32, 0.0),
        };
        let offsets = parents.iter().map(hung).collect();
        Skeleton::new(parents, offsets).map_err(|error| format!("--parents: {error}"))
    }

    /// Whether nothing else was asked for than the rotations themselves.
    pub(crate) fn is_rotations(&self) -> bool {
        matches!(self.output, Output::Quaternion)
    }

    /// The axes of Euler angles.
    pub(crate) fn sequence(&self) -> Option<EulerSequence> {
        self.sequence
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
            AxesArgument::World => Axes::World,
        };
        match self.output {
            Output::Velocity => Quantity::Velocity(axes),
            Output::Acceleration => Quantity::Acceleration(axes),
            _ => Quantity::Rotation,
        }
    }
}
