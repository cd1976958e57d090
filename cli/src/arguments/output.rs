//! `--quantity` and its options: the numbers that are written for each rotation.

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::Vec3;
use tumble::trees::BodyOrder;
use tumble::{
    Axes, Encoding, EncodingOptions, EulerSequence, MatrixOrder, Quantity, ScalarQuantity, Skeleton,
};
use tumble_formats::quaternion::ComponentOrder;

#[derive(Debug, Clone, Args)]
pub(crate) struct OutputArguments {
    /// What to write of each rotation
    #[arg(
        id = "quantity",
        long = "quantity",
        value_name = "WHAT",
        default_value = "quaternion",
        value_parser = one_of(outputs())
    )]
    output: OutputKind,
    /// The sequence of axes: of euler and BVH, intrinsic (XYZ, ZXZ …) or extrinsic (xyz, zxz …)
    /// [default: XYZ; BVH: ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// matrix: the order of its elements in memory
    #[arg(long, default_value_t = MatrixOrder::RowMajor, value_parser = matrix_order())]
    major: MatrixOrder,
    /// world, transform: each track's parent, counted from 0, -1 for none [default: a chain, -1,0,1 …]
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    parents: Option<Vec<i64>>,
    /// velocity, acceleration: the axes that they are measured in
    #[arg(long, default_value_t = Axes::Body, value_parser = axes())]
    axes: Axes,
}

#[derive(Debug, Clone, Copy)]
enum OutputKind {
    Quaternion,
    Encoded(Encoding),
    Velocity,
    Acceleration,
    Transform,
    World,
    Scalars(ScalarQuantity),
}

const QUATERNION: &str = "quaternion";

/// A value of an argument, with its name and its help.
type NamedValue<T> = (&'static str, &'static str, T);

/// The values of `--quantity`: quaternions, the other representations of rotations, rates, and poses.
fn outputs() -> Vec<NamedValue<OutputKind>> {
    let others = encodings(|encoding| encoding.stores_rotations() && !encoding.is_quaternion());
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
    outputs.extend(ScalarQuantity::ALL.map(|quantity| {
        let help = match quantity {
            ScalarQuantity::Value => {
                "(frames, scalars): angles of joints and other numbers of the clip"
            }
            ScalarQuantity::Velocity => "their velocities, per second: derivatives of the curves",
            ScalarQuantity::Acceleration => "their accelerations, per second squared",
            other => other.name(),
        };
        (scalar_output(quantity), help, OutputKind::Scalars(quantity))
    }));
    outputs
}

/// Whether a value of `--quantity` has this name.
pub(crate) fn is_quantity(name: &str) -> bool {
    outputs().iter().any(|(quantity, ..)| *quantity == name)
}

fn scalar_output(quantity: ScalarQuantity) -> &'static str {
    match quantity {
        ScalarQuantity::Value => "scalars",
        ScalarQuantity::Velocity => "scalar-velocities",
        ScalarQuantity::Acceleration => "scalar-accelerations",
        other => other.name(),
    }
}

fn encodings(filter: impl Fn(Encoding) -> bool) -> impl Iterator<Item = NamedValue<Encoding>> {
    let all = Encoding::kinds().filter(move |encoding| filter(*encoding));
    all.map(|encoding| (encoding.name(), encoding.summary(), encoding))
}

/// Parses the name of a representation of quaternions.
pub(crate) fn quaternions() -> impl TypedValueParser<Value = Encoding> {
    one_of(encodings(Encoding::is_quaternion).collect::<Vec<_>>())
}

/// Parses one of these names; help lists them.
pub(crate) fn one_of<T: Clone + Send + Sync + 'static>(
    all: impl Into<Vec<NamedValue<T>>>,
) -> impl TypedValueParser<Value = T> {
    let all = all.into();
    let value = |&(name, help, _): &NamedValue<T>| PossibleValue::new(name).help(help);
    let values: Vec<PossibleValue> = all.iter().map(value).collect();
    PossibleValuesParser::new(values).map(move |text| {
        let found = all.iter().find(|(name, ..)| *name == text);
        found.expect("clap takes these names alone").2.clone()
    })
}

fn matrix_order() -> impl TypedValueParser<Value = MatrixOrder> {
    let help = |order| match order {
        MatrixOrder::RowMajor => "row by row",
        MatrixOrder::ColumnMajor => "column by column",
    };
    one_of(MatrixOrder::ALL.map(|order| (order.name(), help(order), order)))
}

/// `world` is a name of the parent's axes too: those of a track without one are the world's.
fn axes() -> impl TypedValueParser<Value = Axes> {
    let value = |axes: Axes| match (axes, PossibleValue::new(axes.name())) {
        (Axes::Body, value) => value.help("the body's own axes"),
        (Axes::Parent, value) => {
            let help = "the axes of the parent, or of the world for a track without one";
            value.help(help).alias("world")
        }
    };
    PossibleValuesParser::new(Axes::ALL.map(value)).map(|name| name.parse().unwrap_or(Axes::Parent))
}

/// Parses the name of an order of a quaternion's components.
pub(crate) fn component_order() -> impl TypedValueParser<Value = ComponentOrder> {
    let help = |order| match order {
        ComponentOrder::Xyzw => "as in glTF, SciPy and ROS",
        ComponentOrder::Wxyz => "as in .dat files and MuJoCo",
    };
    one_of(ComponentOrder::ALL.map(|order| (order.name(), help(order), order)))
}

/// Parses the name of an order of bodies.
pub(crate) fn body_order() -> impl TypedValueParser<Value = BodyOrder> {
    let help = |order| match order {
        BodyOrder::DepthFirst => "a body, then the whole branch of its first child: MuJoCo, mjlab",
        BodyOrder::BreadthFirst => "level by level: PhysX, IsaacLab, BeyondMimic",
    };
    one_of(BodyOrder::ALL.map(|order| (order.name(), help(order), order)))
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
        let order = self.major;
        let sequence = self.sequence.unwrap_or(EulerSequence::XYZ);
        match self.output {
            OutputKind::Quaternion
            | OutputKind::Transform
            | OutputKind::World
            | OutputKind::Scalars(_) => components,
            OutputKind::Encoded(encoding) => encoding.with(
                EncodingOptions::default()
                    .with_order(order)
                    .with_sequence(sequence),
            ),
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
        let Some(parents) = self.parents(tracks)? else {
            let offsets = (0..tracks).map(|track| hung(&track.checked_sub(1)));
            let chain = Skeleton::chain(tracks, length).map_err(|error| error.to_string())?;
            return Ok((chain, offsets.collect()));
        };
        let offsets: Vec<Vec3> = parents.iter().map(hung).collect();
        let skeleton = Skeleton::new(parents, offsets.clone());
        let skeleton = skeleton.map_err(|error| format!("--parents: {error}"))?;
        Ok((skeleton, offsets))
    }

    /// The parent of each track by `--parents`; `None` if the command line does not have it.
    pub(crate) fn parents(&self, tracks: usize) -> Result<Option<Vec<Option<usize>>>, String> {
        let Some(parents) = &self.parents else {
            return Ok(None);
        };
        if parents.len() != tracks {
            let count = parents.len();
            return Err(format!(
                "--parents has {count} where {tracks} are expected, one for each track"
            ));
        }
        let indices = parents.iter().map(|&parent| match parent {
            -1 => Ok(None),
            _ => usize::try_from(parent).map(Some).map_err(|_| {
                format!("--parents: {parent} is not the index of a track; use -1 for no parent")
            }),
        });
        indices.collect::<Result<_, _>>().map(Some)
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
            OutputKind::Scalars(quantity) => scalar_output(quantity),
        }
    }

    /// Whether the axes of angles change the result.
    pub(crate) fn is_euler(&self) -> bool {
        let sequence = "ZXY".parse().unwrap_or(EulerSequence::XYZ);
        self.depends_on(
            EncodingOptions::default()
                .with_order(MatrixOrder::RowMajor)
                .with_sequence(sequence),
        )
    }

    /// Whether the order of a matrix's elements changes the result.
    pub(crate) fn is_matrix(&self) -> bool {
        self.depends_on(
            EncodingOptions::default()
                .with_order(MatrixOrder::ColumnMajor)
                .with_sequence(EulerSequence::XYZ),
        )
    }

    /// Whether these options change the encoding.
    fn depends_on(&self, options: EncodingOptions) -> bool {
        let default = EncodingOptions::default()
            .with_order(MatrixOrder::RowMajor)
            .with_sequence(EulerSequence::XYZ);
        match self.output {
            OutputKind::Encoded(encoding) => encoding.with(default) != encoding.with(options),
            _ => false,
        }
    }

    /// Whether velocities or accelerations are written.
    pub(crate) fn is_rate(&self) -> bool {
        matches!(self.output, OutputKind::Velocity | OutputKind::Acceleration)
    }

    /// The kind of poses, if whole poses are written.
    pub(crate) fn poses(&self) -> Option<PoseKind> {
        match self.output {
            OutputKind::Transform => Some(PoseKind::Transform),
            OutputKind::World => Some(PoseKind::World),
            _ => None,
        }
    }

    /// The quantity that is written of scalars; `None` if the output is another.
    pub(crate) fn scalars(&self) -> Option<ScalarQuantity> {
        match self.output {
            OutputKind::Scalars(quantity) => Some(quantity),
            _ => None,
        }
    }

    pub(crate) fn quantity(&self) -> Quantity {
        let axes = self.axes;
        match self.output {
            OutputKind::Velocity => Quantity::Velocity(axes),
            OutputKind::Acceleration => Quantity::Acceleration(axes),
            _ => Quantity::Rotation,
        }
    }
}
