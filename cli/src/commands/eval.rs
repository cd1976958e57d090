//! `tumble eval`: keyframe files in, rotations at every frame out.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use tumble::{Encoding, Error, Frames, Interpolation, Layout, Method};
use tumble_formats::Loaded;
use tumble_formats::format::{Format, ResultShape};
use tumble_formats::npy::ComponentOrder;
use tumble_formats::poses::{Poses, TRANSFORM, WORLD};

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::input;
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{Manner, method};
use crate::arguments::time::{Samples, Sampling};
use crate::arguments::what::{PoseKind, What, quaternions};
use crate::batch::output::{Plan, Target, Wish};
use crate::batch::place::Written;
use crate::batch::run::{Batch, Evaluated};
use crate::batch::{digest, output, room};
use crate::messages::exit::{Failure, for_each};
use crate::messages::words;

/// Evaluate keyframe tracks at every frame
#[derive(Debug, Args)]
#[command(after_help = "\
The result is float32 of shape (tracks, frames, 4) in NPY (or as --output says), or CSV
with a row for each frame. CPU and Vulkan give the same bits.

Examples:
  tumble eval data/pendulum.dat -o out.npy
  tumble eval data/pendulum.dat -m slerp --fps 30000/1001 -o out.csv
  tumble eval data/pendulum.dat --start 2 --end 4.5 --layout frame --order wxyz -o out.npy
  tumble eval data/pendulum.dat --output euler --sequence ZXY -o angles.csv
  tumble eval *.dat -o results                 a file for each input, results/NAME.npy
  tumble eval walks -o results --resume        a directory's tree; skips what is done
  find . -name '*.dat' | tumble eval --files-from - -o results
  tumble eval - -o - < data/pendulum.dat | python3 -c \\
    'import io, sys, numpy; print(numpy.load(io.BytesIO(sys.stdin.buffer.read())).shape)'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    #[arg(short, long = "out", value_name = "OUT", help = output::out_help())]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// In a directory of results: skip those that are there, whole, and made from the same input
    /// in the same way
    #[arg(long)]
    resume: bool,
    /// How to interpolate (`tumble methods`)
    #[arg(
        short,
        long,
        value_name = "METHOD",
        default_value = "bessel-overhauser",
        value_parser = method()
    )]
    method: Method,
    #[command(flatten)]
    sampling: Sampling,
    #[command(flatten)]
    manner: Manner,
    #[command(flatten)]
    device: DeviceArguments,
    /// The order of NPY results in memory: (tracks, frames, 4) or (frames, tracks, 4)
    #[arg(long, value_enum, default_value = "track")]
    layout: LayoutArgument,
    /// The order of a quaternion's components in NPY results
    #[arg(long, value_enum, default_value = "xyzw")]
    order: OrderArgument,
    /// What a component of NPY results is stored as
    #[arg(long, value_name = "ENCODING", default_value = "f32", value_parser = quaternions())]
    encoding: Encoding,
    #[command(flatten)]
    what: What,
    /// Also say which way each input takes to its rotations; all ways give the same bits
    #[arg(long)]
    explain_route: bool,
    /// The format of the result [default: by the name of the output, else npy]
    #[arg(long, value_parser = output::format())]
    format: Option<&'static Format>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum LayoutArgument {
    /// (tracks, frames, 4)
    Track,
    /// (frames, tracks, 4)
    Frame,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OrderArgument {
    Xyzw,
    Wxyz,
}

impl From<OrderArgument> for ComponentOrder {
    fn from(order: OrderArgument) -> Self {
        match order {
            OrderArgument::Xyzw => Self::Xyzw,
            OrderArgument::Wxyz => Self::Wxyz,
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    // Everything that can be refused is refused before any work.
    let inputs = arguments
        .inputs
        .gather(arguments.sampling.reads_standard_input())?;
    let samples = arguments.sampling.samples()?;
    let wish = Wish {
        out: arguments.out.as_deref(),
        format: arguments.format,
        overwrite: arguments.overwrite,
        resume: arguments.resume,
    };
    let Plan { targets, manifest } = output::plan(&inputs, wish)?;
    let is_text = |target: &Target| target.results().is_text;
    let short = arguments.encoding != Encoding::F32;
    if short && targets.iter().any(is_text) {
        return Err(Failure::usage(
            "--encoding is for binary results (NPY); text holds every digit",
        ));
    }
    let encoding = arguments.what.encoding(arguments.encoding);
    if short && encoding != arguments.encoding {
        return Err(Failure::usage("--encoding is for quaternions"));
    }
    let mut device = arguments.device.open()?;
    let jobs: Vec<(PathBuf, Target)> = inputs.paths().into_iter().zip(targets).collect();
    let mut evaluate = |path: &Path, loaded: &_, target: &_| {
        arguments.evaluate(&mut device, &samples, path, loaded, target)
    };
    if let Some(manifest) = manifest {
        let batch = Batch {
            inputs: &arguments.inputs,
            options: arguments.options(&samples),
            resume: arguments.resume,
        };
        return batch.run(&jobs, manifest, evaluate);
    }
    for_each(&jobs, |(path, target)| {
        let loaded = arguments.inputs.load(path)?;
        let evaluated = evaluate(path, &loaded, target)?;
        evaluated.written.commit()?;
        words::note(&evaluated.told);
        Ok(())
    })
}

impl Arguments {
    /// All that decides over the bytes of a result besides its input.
    fn options(&self, samples: &Samples) -> String {
        let times = match samples {
            Samples::Times(times) => {
                let bytes: Vec<u8> = times.iter().flat_map(|time| time.to_le_bytes()).collect();
                digest::of_bytes([&*bytes])
            }
            Samples::Rate { .. } => String::new(),
        };
        format!(
            "{} {:?} {times} {:?} {:?} {:?} {:?} {:?}",
            self.method,
            self.sampling,
            self.manner,
            self.layout,
            self.order,
            self.encoding,
            self.what
        )
    }

    /// One input, from its keys to its result.
    fn evaluate(
        &self,
        device: &mut Opened,
        samples: &Samples,
        path: &Path,
        loaded: &Loaded,
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let (name, set) = (input::name(path), &loaded.set);
        let frames = samples.of(set, &name);
        let timeline = frames
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(&name, &error.into()))?;
        target.has_room(
            &name,
            set.track_count(),
            timeline.len(),
            self.what.encoding(self.encoding),
        )?;
        let wished = match self.layout {
            LayoutArgument::Track => Layout::TrackMajor,
            LayoutArgument::Frame => Layout::FrameMajor,
        };
        let layout = target.results().layout.unwrap_or(wished);
        let result = ResultShape {
            name: &name,
            set,
            timeline: &timeline,
            layout,
            order: self.order.into(),
            encoding: self.what.encoding(self.encoding),
        };
        if let Some(kind) = self.what.poses() {
            return self.poses(device, &result, loaded.box_length, &frames, kind, target);
        }
        let started = Instant::now();
        let interpolation = Interpolation {
            quantity: self.what.quantity(),
            ..self.manner.with(self.method)
        };
        if self.explain_route {
            let route = device
                .choose(set.track_count() * timeline.len())
                .and_then(|()| {
                    device.work(|engine| engine.explain_route(set, interpolation, &frames, layout))
                })
                .map_err(|error| Failure::evaluating(&name, &error))?;
            words::note(&format!("{name}: {route}"));
        }
        let written = target.write_rotations(&result, |sink| {
            device.stream(set, interpolation, &frames, layout, sink)
        })?;
        Ok(self.evaluated(written, device, &result, target, started))
    }

    /// Whole poses, `[frame][track]`: of the boxes of a chain, each of which hangs at the
    /// end of the one before it.
    fn poses(
        &self,
        device: &mut Opened,
        result: &ResultShape<'_>,
        box_length: f64,
        frames: &Frames,
        kind: PoseKind,
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let ResultShape {
            name,
            set,
            timeline,
            ..
        } = *result;
        // The rotations, and twice what becomes of them.
        room::in_memory(name, set, frames, 5)?;
        let started = Instant::now();
        let interpolation = self.manner.with(self.method);
        let skeleton = self
            .what
            .skeleton(set.track_count(), box_length)
            .map_err(|message| Failure::usage(format!("{name}: {message}")))?;
        let evaluated = device
            .choose(set.track_count() * timeline.len())
            .and_then(|()| {
                device.work(|engine| {
                    let local =
                        engine.evaluate_as(set, interpolation, frames, Layout::FrameMajor)?;
                    match kind {
                        PoseKind::World => {
                            let world = engine.world(&local, &skeleton)?;
                            let numbers = world.as_slice().chunks_exact(2).flat_map(|pose| {
                                let ([x, y, z, w], [px, py, pz, _]) = (pose[0], pose[1]);
                                [px, py, pz, x, y, z, w]
                            });
                            Ok(numbers.collect::<Vec<f32>>())
                        }
                        PoseKind::Transform => {
                            let hung = |place: usize| match place % set.track_count() {
                                0 => 0.0,
                                _ => -box_length as f32,
                            };
                            let quats = local.as_quats().iter().enumerate();
                            let numbers = quats.flat_map(|(place, q)| {
                                [0.0, hung(place), 0.0, q.x, q.y, q.z, q.w, 1.0, 1.0, 1.0]
                            });
                            Ok(numbers.collect())
                        }
                    }
                })
            });
        let numbers = evaluated.map_err(|error: Error| Failure::evaluating(name, &error))?;
        let components: &[&str] = match kind {
            PoseKind::World => &WORLD,
            PoseKind::Transform => &TRANSFORM,
        };
        let poses = Poses {
            set,
            timeline,
            components,
            numbers: &numbers,
        };
        let written = target.prepare(|out| (target.results().poses)(&poses, out))?;
        Ok(self.evaluated(written, device, result, target, started))
    }

    fn evaluated(
        &self,
        written: Written,
        device: &Opened,
        result: &ResultShape<'_>,
        target: &Target,
        started: Instant,
    ) -> Evaluated {
        let told = format!(
            "{}: {} × {}, {}, on {} in {} → {target}",
            result.name,
            words::count(result.set.track_count(), "track"),
            words::count(result.timeline.len(), "frame"),
            self.method,
            device.label,
            words::duration(started.elapsed()),
        );
        Evaluated {
            written,
            device: device.label.clone(),
            told,
        }
    }
}
