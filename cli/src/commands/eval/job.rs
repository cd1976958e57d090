//! What `tumble eval` does to one input: its clips are evaluated and written into one file.

mod motion;
mod rotations;

use std::borrow::Cow;

use serde::Serialize;
use tumble::{Engine, Error, Interpolation, Layout, Method, SampleTimes};
use tumble_formats::motion::Motion;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::{ChannelMethods, Samples};

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::curve_warning;
use crate::arguments::options::ResultKind;
use crate::arguments::results::document_to_rewrite;
use crate::arguments::time::SampleRequest;
use crate::batch::destination::WrittenFile;
use crate::batch::pipeline::{ClipWork, EvaluatedResult, OpenInput, Pipeline};
use crate::batch::target::ResultTarget;
use crate::commands::eval::arguments::Arguments;
use crate::messages::exit::Failure;
use crate::messages::words;

/// The report of one result with `--json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct EvaluationReport {
    /// The input, and its animation where it has several.
    input: String,
    /// Where the result is; `-` is standard output.
    output: String,
    format: &'static str,
    tracks: usize,
    frames: usize,
    /// Of the first and the last frame, seconds; null where there are none.
    first_time: Option<f64>,
    last_time: Option<f64>,
    /// Times between keys that are too far apart, which were left out or held; nothing without `--max-gap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    in_gaps: Option<usize>,
    /// What was written for each rotation.
    #[serde(rename = "what")]
    output_kind: &'static str,
    /// The order of a quaternion's components as written; null where none are written, or where the
    /// format fixes the order.
    order: Option<&'static str>,
    method: String,
    device: String,
    seconds: f64,
}

impl EvaluationReport {
    /// How many were evaluated.
    pub(crate) fn rotations(&self) -> u64 {
        self.tracks as u64 * self.frames as u64
    }
}

/// Evaluates all that a pipeline has; gives a report of each result that is kept.
pub(super) fn evaluate_all(
    arguments: &Arguments,
    samples: &SampleRequest,
    device: &mut OpenedDevice,
    pipeline: &mut Pipeline<'_>,
) -> Vec<EvaluationReport> {
    let mut reports = Vec::new();
    while let Some(work) = pipeline.next_work() {
        let mut job = EvaluationJob {
            arguments,
            device,
            samples,
            input: &work.input,
            in_gaps: 0,
        };
        let made = job.evaluate(&work);
        reports.extend(pipeline.keep(&work, made));
    }
    reports
}

/// The evaluation of some clips of an input, into one file.
struct EvaluationJob<'a> {
    arguments: &'a Arguments,
    device: &'a mut OpenedDevice,
    samples: &'a SampleRequest,
    input: &'a OpenInput,
    /// Times in gaps of the clips that are being evaluated.
    in_gaps: usize,
}

impl EvaluationJob<'_> {
    /// Evaluates the clips of a file, and writes it.
    fn evaluate(
        &mut self,
        work: &ClipWork,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let (name, clips, target) = (&*work.name, &*work.clips(), &work.target);
        for clip in clips {
            self.check_interpolation(name, clip)?;
            self.note_curves(name, clip)?;
        }
        let output = &self.arguments.output;
        let kind = match output.poses() {
            _ if self.is_baked(target) => ResultKind::Baked,
            _ if self.is_motion(clips, target) => ResultKind::Motion,
            Some(_) => ResultKind::Poses,
            None => ResultKind::Rotations,
        };
        let refused = |failure: Failure| failure.of(name);
        self.arguments
            .check(kind, target.format())
            .map_err(refused)?;
        if kind == ResultKind::Baked {
            return self.bake(name, clips, target);
        }
        let tracks = &self.arguments.inputs.tracks;
        if kind == ResultKind::Motion {
            let some = self.arguments.command_line.has("tracks");
            let some = some.then_some("some tracks make");
            document_to_rewrite(name, &self.input.loaded, target, some);
            let selected = clips
                .iter()
                .map(|&clip| tracks.select_with_ancestors(clip, name));
            let selected: Vec<Cow<'_, Motion>> = selected.collect::<Result<_, Failure>>()?;
            let clips: Vec<&Motion> = selected.iter().map(|clip| &**clip).collect();
            return self.motion(name, &clips, target);
        }
        let [clip] = clips else {
            let message =
                format!("{name}: --output needs a single animation; choose one with --animation");
            return Err(Failure::usage(message));
        };
        if let (ResultKind::Poses, Some(poses)) = (kind, output.poses()) {
            return self.poses(name, clip, poses, target);
        }
        self.rotations(name, &*tracks.select(clip, name)?, target)
    }

    /// Warns where the evaluated curves are less smooth than their method promises.
    fn note_curves(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (Some(method), with) = self.methods() else {
            return Ok(()); // No file asks for such a method.
        };
        let selected = self.arguments.inputs.tracks.select(clip, name)?;
        if let Some(warning) = curve_warning(name, &selected.set, &with(method)) {
            words::note(&warning.to_string());
        }
        Ok(())
    }

    /// Refuses options that have no effect on the methods of a clip's channels.
    fn check_interpolation(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let used_methods: Vec<Method> = methods
            .groups_of(clip)
            .iter()
            .map(|group| group.0)
            .collect();
        let checked = self.arguments.interpolation.check(&used_methods);
        checked.map_err(|message| Failure::usage(format!("{name}: {message}")))
    }

    /// With `--explain-route`, prints the route by which a clip's rotations are evaluated.
    fn explain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<(), Failure> {
        if !self.arguments.explain_route {
            return Ok(());
        }
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let groups = methods.groups_of(clip);
        let whole = groups.len() == 1;
        for (method, tracks) in groups {
            let set = (clip.set.select(tracks.iter().copied()))
                .map_err(|error| Failure::evaluating(name, &error.into()))?;
            let explain =
                |engine: &Engine| engine.explain_route(&set, with(method), frames, layout);
            let samples = frames.resolve(set.track_count(), clip.set.time_span());
            let route = samples
                .map_err(Error::from)
                .and_then(|timeline| {
                    self.device
                        .choose(clip.set.track_count() * timeline.len())?;
                    self.device.work(explain)
                })
                .map_err(|error| Failure::evaluating(name, &error))?;
            words::note(&match whole {
                true => format!("{name}: {route}"),
                false => format!(
                    "{name}, {} by {method}: {route}",
                    words::count(tracks.len(), "track")
                ),
            });
        }
        Ok(())
    }

    /// All channels of a clip.
    fn sample(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
    ) -> Result<Samples, Failure> {
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let tracks = clip.set.track_count();
        let samples = frames.resolve(tracks, clip.set.time_span());
        let found = samples.map_err(Error::from).and_then(|timeline| {
            self.device.choose(tracks * timeline.len())?;
            self.device
                .work(|engine| methods.sample(engine, clip, frames))
        });
        found.map_err(|error| Failure::evaluating(name, &error))
    }

    /// How a result was made, for formats that store it.
    fn notes(&self, name: &str) -> Result<Vec<(&'static str, String)>, Failure> {
        let mut notes = vec![
            ("method", self.arguments.method.to_string()),
            ("input", name.to_owned()),
        ];
        let sha256 = self.input.file.sha256().map(str::to_owned);
        // The hash is of the bytes that were read, or none.
        self.input.file.check_unchanged()?;
        notes.extend(sha256.map(|hash| ("input_sha256", hash)));
        Ok(notes)
    }

    /// The method of all channels, if there is one, and the interpolation by a method.
    fn methods(&self) -> (Option<Method>, impl Fn(Method) -> Interpolation + use<>) {
        let quantity = self.arguments.output.quantity();
        let interpolation = self.arguments.interpolation;
        let with = move |method| Interpolation {
            quantity,
            ..interpolation.with(method)
        };
        (self.arguments.method.0, with)
    }

    fn evaluated(
        &self,
        name: &str,
        (tracks, frames, span): (usize, usize, Option<(f64, f64)>),
        method: &str,
        written: WrittenFile,
        target: &ResultTarget,
        order: Option<ComponentOrder>,
    ) -> (EvaluatedResult, EvaluationReport) {
        let elapsed = self.input.started.elapsed();
        let message = format!(
            "{name}: {} × {}{}, {method}, on {} in {} → {target}",
            words::count(tracks, "track"),
            words::count(frames, "frame"),
            match self.in_gaps {
                0 => String::new(),
                count => format!(
                    " ({} in gaps {})",
                    count,
                    self.arguments.at_keys.done_in_gaps()
                ),
            },
            self.device.label,
            words::duration(elapsed),
        );
        let report = EvaluationReport {
            input: name.to_owned(),
            output: target.path().display().to_string(),
            format: target.format().name,
            tracks,
            frames,
            first_time: span.map(|span| span.0),
            in_gaps: self
                .arguments
                .command_line
                .has("max_gap")
                .then_some(self.in_gaps),
            last_time: span.map(|span| span.1),
            output_kind: self.arguments.output.name(),
            order: order.map(ComponentOrder::name),
            method: method.to_owned(),
            device: self.device.label.clone(),
            seconds: elapsed.as_secs_f64(),
        };
        let evaluated = EvaluatedResult {
            written,
            device: self.device.label.clone(),
            message,
        };
        (evaluated, report)
    }
}
