//! The options of `tumble eval`.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::Path;
use std::str::FromStr;

use clap::Args;
use clap::builder::TypedValueParser;
use tumble::{Encoding, Layout};
use tumble_formats::dialect::write::WrittenDialect;
use tumble_formats::format::Format;
use tumble_formats::quaternion::ComponentOrder;

use crate::arguments::device::DeviceArguments;
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{InterpolationArguments, method_argument};
use crate::arguments::options::{
    AppliesTo, CommandLine, OPTIONS, ResultDescription, ResultKind, ResultOptions,
};
use crate::arguments::output::{
    OutputArguments, component_order, is_quantity, one_of, quaternions,
};
use crate::arguments::results::ResultArguments;
use crate::arguments::robot::DialectArguments;
use crate::arguments::root_motion::RootMotionArguments;
use crate::arguments::time::{
    AtKeysArguments, EndFrameArguments, GapArguments, SampleChoice, SamplingArguments,
};
use crate::messages::exit::Failure;
use crate::messages::words;
use tumble_formats::root_motion::RootMotionRule;
use tumble_formats::sample::MethodChoice;

/// Evaluate keyframe tracks at every frame
#[derive(Debug, Args)]
#[command(after_help = "\
In NPY the result is float32 of shape (tracks, frames, 4), with components x y z w. --quantity, --layout \
and --order change this. In CSV it has a row for each frame and a header that names the columns; the \
default order is w x y z. An option that has no effect on a result is refused. CPU and Vulkan give the \
same bits.

Examples:
  tumble eval data/pendulum.dat -o out.npy
  tumble eval data/pendulum.dat -m slerp --fps 30000/1001 -o out.csv
  tumble eval data/pendulum.dat --start 2 --end 4.5 --layout frame --order wxyz -o out.npy
  tumble eval data/pendulum.dat --quantity euler --sequence ZXY -o angles.csv
  tumble eval lafan1/walk.csv --fps 50 --quantity scalar-velocities -o joints.csv
  tumble eval *.dat -o results                 a file for each input, results/NAME.npy
  tumble eval walks -o results --resume        a directory tree; skips results that are done
  find . -name '*.dat' | tumble eval --files-from - -o results
  tumble eval walk.glb --fps 60 -o walk60.glb  meshes and all else are kept
  tumble eval walk.bvh --root-motion in-place -o in_place.npz
  tumble eval clips -o out --to bvh --resume   formats may be mixed
  tumble eval lafan1 -o out --fps 50 --robot g1.xml --dialect mjlab --resume
  seq 64 | xargs -P8 -I{} tumble eval clips -o out --resume --shard {}/64; tumble merge out
  tumble eval - -o - < data/pendulum.dat | python3 -c \\
    'import io, sys, numpy; print(numpy.load(io.BytesIO(sys.stdin.buffer.read())).shape)'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(super) command_line: CommandLine,
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) results: ResultArguments,
    /// How to interpolate: `authored`, or a method (`tumble methods`); stepped channels, which keep each
    /// key until the next one, stay stepped
    #[arg(
        short,
        long,
        value_name = "METHOD",
        default_value = "authored",
        value_parser = method_argument()
    )]
    pub(super) method: MethodChoice,
    #[command(flatten)]
    pub(super) sampling: SamplingArguments,
    #[command(flatten)]
    pub(super) at_keys: AtKeysArguments,
    #[command(flatten)]
    pub(super) end_frame: EndFrameArguments,
    #[command(flatten)]
    pub(super) gaps: GapArguments,
    #[command(flatten)]
    pub(super) interpolation: InterpolationArguments,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// The order of results: (tracks, frames, 4) or (frames, tracks, 4); poses and CSV come frame by
    /// frame
    #[arg(long, default_value_t, value_parser = layout())]
    pub(super) layout: Layout,
    /// The order of a quaternion's components [default: xyzw; CSV of rotations: wxyz]
    #[arg(long, value_parser = component_order())]
    pub(super) order: Option<ComponentOrder>,
    /// How components are stored in NPY results
    #[arg(long, value_name = "ENCODING", default_value = "f32", value_parser = quaternions())]
    pub(super) encoding: Encoding,
    #[command(flatten)]
    pub(super) output: OutputArguments,
    #[command(flatten)]
    pub(super) dialect: DialectArguments,
    #[command(flatten)]
    pub(super) root: RootMotionArguments,
    /// NPZ to NPZ: interpolate these arrays, which have a number for each frame, linearly instead of
    /// leaving them out
    #[arg(long, value_name = "ARRAYS", value_delimiter = ',')]
    pub(super) linear: Vec<String>,
    /// Also print how each input is evaluated (its route); all routes give the same bits
    #[arg(long)]
    pub(super) explain_route: bool,
    /// Evaluate only the I-th of N parts of the inputs, such as 3/64, or one shard by its number; other
    /// processes evaluate the other parts into the same directory, and `tumble merge` combines them
    #[arg(long, value_name = "I/N")]
    pub(super) shard: Option<ShardSelection>,
    /// The largest total size of the inputs in a shard; a shard has at most 256 inputs
    #[arg(
        long,
        value_name = "SIZE",
        default_value = "32MiB",
        requires = "shard",
        value_parser = words::parse_bytes
    )]
    pub(super) shard_bytes: u64,
}

fn layout() -> impl TypedValueParser<Value = Layout> {
    let help = |layout| match layout {
        Layout::TrackMajor => "(tracks, frames, 4)",
        Layout::FrameMajor => "(frames, tracks, 4)",
    };
    one_of(Layout::ALL.map(|layout| (layout.name(), help(layout), layout)))
}

impl Arguments {
    /// The samples, after a check that the options apply to the method.
    pub(super) fn checked_samples(&self) -> Result<SampleChoice, Failure> {
        if let Some(method) = self.method.0 {
            let checked = self.interpolation.check(&[method]);
            checked.map_err(Failure::usage)?;
        }
        match self.at_keys.samples()? {
            Some(samples) => Ok(samples),
            None => self.sampling.samples(),
        }
    }

    /// Reads only the file's keys where a method is named.
    pub(super) fn choose_keys(&self) {
        if self.method.0.is_some() {
            self.inputs.reading.set_method_named();
        }
    }

    /// Everything that determines the bytes of a result besides its input.
    pub(super) fn options(&self, samples: &SampleChoice) -> ResultOptions {
        let mut options = self.command_line.options();
        if let SampleChoice::Times(_) | SampleChoice::Keys(_) = samples {
            options.text += &format!(" times={}", samples.digest());
        }
        options
    }

    pub(super) fn order(&self) -> Option<ComponentOrder> {
        self.order
    }

    /// Refuses, before any work, options that have no effect on any kind that the results may have.
    pub(super) fn check_before(&self, format: &'static Format) -> Result<(), Failure> {
        self.root.check(&self.command_line)?;
        let mut kinds = Vec::new();
        if let Some(dialect) = self.dialect.chosen() {
            self.check_dialect(dialect)?;
            kinds.push(ResultKind::Robot);
        } else if self.output.is_rotations() {
            if format.write.is_some() {
                kinds.push(ResultKind::Rotations);
            }
            if format.writes_clips() {
                kinds.extend([ResultKind::Motion, ResultKind::Baked]);
            }
        } else {
            kinds.push(match self.output.poses() {
                _ if self.output.scalars().is_some() => ResultKind::Poses,
                Some(_) => ResultKind::Poses,
                None => ResultKind::Rotations,
            });
        }
        let mut refusals = kinds.into_iter().map(|kind| self.refusal(kind, format));
        let first = refusals.next().flatten();
        match first {
            Some(first) if refusals.all(|other| other.is_some()) => Err(Failure::usage(first)),
            _ => Ok(()),
        }
    }

    /// Refuses a result that is called like a quantity: `--output` once named the quantity.
    pub(super) fn refuse_quantity_as_output(&self) -> Result<(), Failure> {
        let named = self.results.out().and_then(|out| out.to_str());
        let quantity = named.filter(|name| is_quantity(name) && !Path::new(name).exists());
        quantity.map_or(Ok(()), |name| {
            Err(Failure::usage(format!(
                "`{name}` is a quantity: `--quantity {name} -o FILE` writes it; for a directory of this name give \
                 -o ./{name}"
            )))
        })
    }

    /// Refuses options that have no effect on the layout of another program.
    fn check_dialect(&self, dialect: &WrittenDialect) -> Result<(), Failure> {
        let options = [
            ("quantity", "--quantity"),
            ("tracks", "--tracks"),
            ("max_gap", "--max-gap"),
            ("times", "--times"),
            ("at", "--at"),
            ("explain_route", "--explain-route"),
            ("times_out", "--times-out"),
        ];
        let on = format!("--dialect {}", dialect.name);
        let remedy = "it has all joints of the robot at frames of one rate; leave it out";
        if self.root.rule() == RootMotionRule::Extract {
            return Err(Failure::usage(format!(
                "--root-motion extract has no effect on {on}, which has no joint for it; leave it out"
            )));
        }
        self.command_line.refuse(&options, &on, remedy)
    }

    /// Refuses options that have no effect on a result of this kind.
    pub(super) fn check(&self, kind: ResultKind, format: &'static Format) -> Result<(), Failure> {
        self.refusal(kind, format)
            .map_or(Ok(()), |message| Err(Failure::usage(message)))
    }

    /// The result of a kind in a format.
    pub(super) fn result(
        &self,
        kind: ResultKind,
        format: &'static Format,
    ) -> ResultDescription<'_> {
        ResultDescription {
            kind,
            format,
            output: &self.output,
            layout: self.layout,
            encoding: self.encoding,
            end_frame: &self.end_frame,
            times_apart: self.results.has_times_apart(),
        }
    }

    fn refusal(&self, kind: ResultKind, format: &'static Format) -> Option<String> {
        if !kind.is_clip() && kind != ResultKind::Robot && format.write.is_none() {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            return Some(format!(
                "{} stores whole clips; for --quantity {} write {}",
                format.name,
                self.output.name(),
                names.join(" or ")
            ));
        }
        let result = self.result(kind, format);
        let mut set = OPTIONS
            .iter()
            .filter(|rule| self.command_line.has(rule.name));
        set.find_map(|rule| match rule.applies_to {
            AppliesTo::Results(refusal) => refusal(&result),
            AppliesTo::All | AppliesTo::Inputs(_) => None,
        })
    }
}

/// Which shards of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ShardSelection {
    /// That one.
    One(usize),
    /// The shards of one process of several, both from 1.
    Of(usize, usize),
}

impl FromStr for ShardSelection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let number = |text: &str| text.parse().ok().filter(|&number: &usize| number > 0);
        let part = match text.split_once('/') {
            None => number(text).map(Self::One),
            Some((index, all)) => (number(index).zip(number(all)))
                .filter(|(index, all)| index <= all)
                .map(|(index, all)| Self::Of(index, all)),
        };
        part.ok_or_else(|| {
            "give I/N with I from 1 to N, or the number of a shard, from 1".to_owned()
        })
    }
}

impl fmt::Display for ShardSelection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(one) => write!(f, "{one}"),
            Self::Of(index, of) => write!(f, "{index}/{of}"),
        }
    }
}

impl ShardSelection {
    /// The numbers of its shards, from 1. Parts differ by one shard at most.
    pub(super) fn shards(self, all: usize) -> Result<RangeInclusive<usize>, Failure> {
        let share = |part: usize, of: usize| (all as u128 * part as u128 / of as u128) as usize;
        match self {
            Self::One(one) if one > all => {
                let are = if all == 1 { "is" } else { "are" };
                let all = words::count(all, "shard");
                let message = format!("--shard {one}: there {are} {all}");
                Err(Failure::usage(message))
            }
            Self::One(one) => Ok(one..=one),
            Self::Of(index, of) => Ok(share(index - 1, of) + 1..=share(index, of)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_every_shard_once() {
        for (all, of) in [(0, 3), (1, 64), (79, 64), (79, 2), (3, 3)] {
            let parts =
                (1..=of).flat_map(|index| ShardSelection::Of(index, of).shards(all).unwrap());
            assert!(parts.eq(1..=all), "{all} in {of}");
        }
        assert!(ShardSelection::One(4).shards(3).is_err());
    }

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!("3/64".parse(), Ok(ShardSelection::Of(3, 64)));
        assert_eq!("17".parse(), Ok(ShardSelection::One(17)));
        for text in ["0", "0/4", "5/4", "1/0", "-1/4", "1/", "/", "", "1.5"] {
            assert!(text.parse::<ShardSelection>().is_err(), "{text}");
        }
    }
}
