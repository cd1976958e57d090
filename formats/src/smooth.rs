//! Clips without their noise: samples of all channels at even times, smoothed.

use tumble::{
    Channel, Engine, Error, FrameRate, Layout, Rotations, SampleTimes, Smoothing, SmoothingError,
    SmoothingKernel, TrackError, Vectors,
};

use crate::motion::{ChannelInterpolation, Motion};
use crate::sample::{ChannelMethods, Samples};

/// Why a clip cannot be smoothed as asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SmoothMotionError {
    /// Kernels go over even samples, and the keys are none.
    #[error("the keys are not evenly spaced, or not at the same times in all tracks")]
    Uneven,
    /// No kernel keeps what is slower than this frequency at the rate of the samples.
    #[error("{hz} Hz: {reason}")]
    LowPass {
        /// The frequency.
        hz: f64,
        /// Why not.
        reason: SmoothingError,
    },
    /// The samples are no rotations of the engine's.
    #[error(transparent)]
    Evaluating(#[from] Error),
}

/// The smoothing of one clip: which samples, and by which kernel.
#[derive(Debug, Clone)]
pub struct SmoothJob {
    /// The samples.
    pub frames: SampleTimes,
    /// The rate that they are frames of.
    pub rate: Option<FrameRate>,
    /// The kernel is that of the frequency, where one was asked for.
    pub smoothing: Smoothing,
}

/// The samples of a clip as they were, and smoothed.
#[derive(Debug, Clone)]
pub struct Smoothed {
    /// As they were.
    pub before: Samples,
    /// Smoothed.
    pub after: Samples,
}

/// How far steps of time may differ, as a part of a step.
const EVEN: f64 = 1e-3;

impl SmoothJob {
    /// The smoothing of a clip's frames at a rate or, without one, of its keys. `low_pass`, Hz, takes the
    /// place of the kernel: what is slower is kept, whatever the rate of the samples.
    ///
    /// # Errors
    /// When there is no rate and the keys are not even, or the frequency is too high or too low for the samples.
    pub fn new(
        clip: &Motion,
        smoothing: Smoothing,
        low_pass: Option<f64>,
        rate: Option<FrameRate>,
    ) -> Result<Self, SmoothMotionError> {
        let (frames, rate) = match rate {
            Some(rate) => (SampleTimes::rate(rate), Some(rate)),
            None => match even_times(clip) {
                Some(times) => (SampleTimes::at(times), clip.rate),
                None => return Err(SmoothMotionError::Uneven),
            },
        };
        let mut job = Self {
            frames,
            rate,
            smoothing,
        };
        let Some(hz) = low_pass else {
            return Ok(job);
        };
        let timeline = job
            .frames
            .resolve(clip.set.track_count(), clip.set.time_span());
        let times: Vec<f64> = timeline.map_err(Error::from)?.times(0).collect();
        if let [first, .., last] = &*times {
            let rate = (times.len() - 1) as f64 / (last - first);
            let kernel = SmoothingKernel::low_pass(hz, rate);
            job.smoothing.kernel =
                kernel.map_err(|reason| SmoothMotionError::LowPass { hz, reason })?;
        }
        Ok(job)
    }

    /// Samples the clip and smooths rotations and translations.
    ///
    /// # Errors
    /// As [`Engine::smooth`].
    pub fn run(&self, engine: &Engine, clip: &Motion) -> Result<Smoothed, Error> {
        let before = ChannelMethods::AUTHORED.sample(engine, clip, &self.frames)?;
        let mut after = before.clone();
        let (tracks, layout) = (clip.set.track_count(), Layout::FrameMajor);
        if let Ok(rotations) = Rotations::of(&after.rotations, tracks, layout) {
            let smoothed = engine.smooth(&rotations, &self.smoothing)?;
            after.rotations = smoothed.as_quats().to_vec();
        }
        if let Ok(translations) = Vectors::of(&after.translations, tracks, layout) {
            let smoothed = engine.smooth_vectors(&translations, &self.smoothing)?;
            after.translations = smoothed.as_slice().iter().map(|v| v.truncate()).collect();
        }
        Ok(Smoothed { before, after })
    }

    /// The clip with its smoothed samples as keys; all else stays, and steps stay as they were.
    ///
    /// # Errors
    /// When a sample is no key.
    pub fn clip(&self, clip: &Motion, smoothed: &Smoothed) -> Result<Motion, TrackError> {
        let tracks = clip.set.track_count();
        let mut keys = smoothed.after.clone();
        for (track, channels) in clip.channels.iter().enumerate() {
            let indices = || (track..smoothed.before.rotations.len()).step_by(tracks);
            if channels.rotation == Some(ChannelInterpolation::Step) {
                indices()
                    .for_each(|index| keys.rotations[index] = smoothed.before.rotations[index]);
            }
            if channels.translation == Some(ChannelInterpolation::Step)
                && !keys.translations.is_empty()
            {
                indices().for_each(|index| {
                    keys.translations[index] = smoothed.before.translations[index];
                });
            }
        }
        Ok(Motion {
            rate: self.rate,
            ..clip.with_keys(&keys)?
        })
    }
}

/// The times of the keys, if all tracks have the same and these are evenly spaced.
fn even_times(clip: &Motion) -> Option<Vec<f64>> {
    let longest = clip.set.tracks().max_by_key(|track| track.times.len())?;
    let times = longest.times;
    let fits = |list: &[f64]| list == times || list.len() == 1;
    let channels = [Channel::Translation, Channel::Scale];
    let vectors = (0..clip.set.track_count())
        .flat_map(|track| channels.map(|channel| clip.set.vector_keys(channel, track)));
    let all = clip.set.tracks().all(|track| fits(track.times))
        && vectors.flatten().all(|keys| fits(keys.times));
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, largest) = (
        steps().fold(f64::INFINITY, f64::min),
        steps().fold(0.0, f64::max),
    );
    (all && (times.len() < 2 || largest - least <= EVEN * largest)).then(|| times.to_vec())
}
