//! Results that are motion files themselves: clips with their skeletons, sampled.

use tumble::{FrameRate, Frames};

use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::motion::{Motion, Sampled};
use tumble_formats::{Diagnostic, sample};

use crate::arguments::time::Samples;
use crate::batch::output::Target;
use crate::batch::room;
use crate::batch::run::Evaluated;
use crate::commands::eval::Job;
use crate::messages::exit::Failure;

impl Job<'_> {
    /// Whether the result is the input's own file with other keys.
    pub(super) fn is_baked(&self, target: &Target) -> bool {
        let document = self.loaded.document.as_ref();
        self.arguments.what.is_rotations()
            && document.is_some_and(|document| document.writes(target.format()))
    }

    /// Whether the result is a motion file: of a format that holds nothing else, or of a clip that
    /// is more than rotations.
    pub(super) fn is_motion(&self, clips: &[&Motion], target: &Target) -> bool {
        self.arguments.what.is_rotations() && target.format().takes_motion(clips)
    }

    /// Clips as a file of their own.
    pub(super) fn motion(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let frames = |clip: &Motion| Ok(self.samples.of(&clip.set, name));
        let times: Vec<Frames> = clips
            .iter()
            .map(|clip| frames(clip))
            .collect::<Result<_, _>>()?;
        let rate = match self.samples {
            Samples::Rate { rate, .. } => Some(*rate),
            Samples::Times(_) => None,
        };
        let write = target.format().write_motion;
        let options = self.options(target);
        self.written(
            name,
            clips,
            &times,
            rate,
            target,
            |sampled, out| match write {
                Some(write) => write(sampled, &options, out),
                None => Ok(Vec::new()),
            },
        )
    }

    /// The input's own file, everything kept but the keys of some of its animations.
    pub(super) fn bake(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let (
            Some(document),
            &Samples::Rate {
                rate,
                start: None,
                end: None,
            },
        ) = (self.loaded.document.clone(), self.samples)
        else {
            return Err(Failure::usage(format!(
                "{name}: the animations of a file that is kept keep their lengths; leave out \
                 --times, --start and --end, or write another format"
            )));
        };
        let at = |clip: &&Motion| document.times(clip.place, rate).map(Frames::at);
        let times: Result<Vec<Frames>, _> = clips.iter().map(at).collect();
        let times = times.map_err(|diagnostic| Failure::input(&diagnostic, ""))?;
        let options = self.options(target);
        let places: Vec<usize> = clips.iter().map(|clip| clip.place).collect();
        self.written(name, clips, &times, Some(rate), target, |sampled, out| {
            let clips: Vec<(usize, Sampled<'_>)> = places
                .iter()
                .copied()
                .zip(sampled.iter().cloned())
                .collect();
            document.write(&clips, &options, target.path(), out)
        })
    }

    fn options(&self, target: &Target) -> MotionOptions {
        MotionOptions {
            sequence: self.arguments.what.sequence(),
            linear: self.arguments.linear.clone(),
            ..target.motion_options()
        }
    }

    /// Samples clips and writes them.
    fn written(
        &mut self,
        name: &str,
        clips: &[&Motion],
        frames: &[Frames],
        rate: Option<FrameRate>,
        target: &Target,
        write: impl FnOnce(&[Sampled<'_>], &mut Vec<u8>) -> Result<Vec<Diagnostic>, WriteError>,
    ) -> Result<Evaluated, Failure> {
        let mut all: Vec<sample::Samples> = Vec::new();
        for (clip, frames) in clips.iter().zip(frames) {
            // Rotations, translations, scales, and what they are written as.
            room::in_memory(name, &clip.set, frames, 6)?;
            all.push(self.sample(name, clip, frames)?);
        }
        let method = self.arguments.method.to_string();
        let notes = self.notes(name);
        let sampled: Vec<Sampled<'_>> = (clips.iter().zip(&all))
            .map(|(clip, samples)| samples.of(clip, rate, &notes))
            .collect();
        let written = target.write_motion(|out| write(&sampled, out))?;
        let tracks = clips.iter().map(|clip| clip.set.track_count()).max();
        let samples = all.iter().map(|samples| samples.times.len()).sum();
        Ok(self.evaluated(
            name,
            (tracks.unwrap_or(0), samples),
            &method,
            written,
            target,
        ))
    }
}
