//! Results that are motion files themselves: clips with their skeletons, sampled.

use glam::Vec3;
use tumble::{FrameRate, Layout, SampleTimes};
use tumble_formats::format::{Document, FormatOption, MotionOptions};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::sample;

use crate::arguments::time::{ClipFrames, SampleRequest};
use crate::batch::pipeline::EvaluatedResult;
use crate::batch::room;
use crate::batch::target::ResultTarget;
use crate::commands::eval::job::{EvaluationJob, EvaluationReport};
use crate::messages::exit::Failure;

impl EvaluationJob<'_> {
    /// Whether the result is the input's file with other keys.
    pub(super) fn is_baked(&self, target: &ResultTarget) -> bool {
        // Some tracks alone are another file.
        self.arguments.output.is_rotations()
            && !self.arguments.command_line.has("tracks")
            && self.keeps(target)
    }

    /// Whether the input's own file can be written again.
    pub(super) fn keeps(&self, target: &ResultTarget) -> bool {
        let document = self.input.loaded.document.as_ref();
        !self.input.loaded.is_adjusted
            && document.is_some_and(|document| document.writes(target.format()))
    }

    /// Whether the result is a motion file: of a format that holds nothing else, or of a clip that
    /// is more than rotations.
    pub(super) fn is_motion(&self, clips: &[&Motion], target: &ResultTarget) -> bool {
        self.arguments.output.is_rotations() && target.format().takes_motion(clips)
    }

    /// Clips as a file of their own.
    pub(super) fn motion(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let times: Vec<ClipFrames> = clips
            .iter()
            .map(|clip| self.samples.of_clip(clip, name))
            .collect::<Result<_, _>>()?;
        self.in_gaps = times.iter().map(|of_clip| of_clip.in_gaps).sum();
        let rate = match self.samples {
            SampleRequest::Rate { rate, .. } => Some(*rate),
            SampleRequest::Times(_) | SampleRequest::Keys(_) => None,
        };
        self.written(name, clips, &times, rate, target, None)
    }

    /// The input's own file, everything kept but the keys of some of its animations.
    pub(super) fn bake(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let (
            Some(document),
            &SampleRequest::Rate {
                rate,
                start: None,
                end: None,
                from_zero: false,
            },
        ) = (self.input.loaded.document.clone(), self.samples)
        else {
            return Err(Failure::usage(format!(
                "{name}: the animations of a file that is kept keep their lengths; leave out \
                 --times, --at, --start, --end and --from-zero (`tumble convert --start` cuts a file first), or \
                 write another format"
            )));
        };
        let at = |clip: &&Motion| {
            let times = document.times(clip.index, rate);
            times.map(|times| SampleTimes::at(times).into())
        };
        let times: Result<Vec<ClipFrames>, _> = clips.iter().map(at).collect();
        let times = times.map_err(|diagnostic| Failure::input(&diagnostic, ""))?;
        self.written(name, clips, &times, Some(rate), target, Some(&*document))
    }

    fn options(&self, target: &ResultTarget) -> MotionOptions {
        MotionOptions {
            sequence: self.arguments.output.sequence(),
            linear: self.arguments.linear.clone(),
            order: self.arguments.order(),
            box_length: self.input.loaded.box_length,
            ..target.motion_options()
        }
    }

    /// Samples clips and writes them: into the input's file, if it is given, else into a new one.
    fn written(
        &mut self,
        name: &str,
        clips: &[&Motion],
        frames: &[ClipFrames],
        rate: Option<FrameRate>,
        target: &ResultTarget,
        document: Option<&dyn Document>,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let mut all: Vec<sample::Samples> = Vec::new();
        for (clip, samples) in clips.iter().zip(frames) {
            let frames = &samples.frames;
            let boxes = target.format().takes(FormatOption::BoxLength);
            self.check_scale(name, clip, boxes)?;
            // Rotations, translations, scales, and the same as written.
            room::in_memory(name, &clip.set, frames, 6)?;
            self.explain(name, clip, frames, Layout::FrameMajor)?;
            let mut found = self.sample(name, clip, frames)?;
            if let Some(held) = &samples.held {
                let said = held.resolve(clip.set.track_count(), clip.set.time_span());
                let said = said.map_err(|error| Failure::evaluating(name, &error.into()))?;
                found.times = said.times(0).collect();
            }
            all.push(found);
        }
        let method = self.arguments.method.to_string();
        let notes = self.notes(name)?;
        let sampled: Vec<SampledClip<'_>> = (clips.iter().zip(&all))
            .map(|(clip, samples)| samples.of(clip, rate, &notes))
            .collect();
        let indices = clips.iter().map(|clip| clip.index);
        let written = target.write_clips(&sampled, indices, document, &self.options(target))?;
        let tracks = clips.iter().map(|clip| clip.set.track_count()).max();
        let samples = all.iter().map(|samples| samples.times.len()).sum();
        let times = || all.iter().flat_map(|samples| &samples.times).copied();
        let span = times().reduce(f64::min).zip(times().reduce(f64::max));
        let format = target.format();
        let writer = format
            .takes(FormatOption::Order)
            .then_some(format.write.as_ref())
            .flatten();
        let order = writer.map(|write| self.arguments.order().unwrap_or(write.order));
        let size = (tracks.unwrap_or(0), samples, span);
        Ok(self.evaluated(name, size, &method, written, target, order))
    }

    /// Refuses to scale a clip that goes nowhere. `boxes`: the result has the length of boxes.
    pub(super) fn check_scale(
        &self,
        name: &str,
        clip: &Motion,
        boxes: bool,
    ) -> Result<(), Failure> {
        let is_placed = clip.has_vectors()
            || clip
                .skeleton
                .iter()
                .any(|joint| joint.rest.translation != Vec3::ZERO)
            || boxes && self.input.loaded.box_length.is_some();
        if self.arguments.command_line.has("scale") && !is_placed {
            return Err(Failure::usage(format!(
                "{name}: --scale has no effect on a clip without translations; leave it out"
            )));
        }
        Ok(())
    }
}
