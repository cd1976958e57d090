//! Smooths clips: rotations and translations at samples with equal intervals.

use tumble::{
    Channel, Engine, Error, FrameRate, Layout, Rotations, SampleTimes, Smoothing, SmoothingError,
    SmoothingKernel, TrackError, Vectors,
};

use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::scalars;
use crate::motion::{ChannelInterpolation, Motion};

/// Why a clip cannot be smoothed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SmoothMotionError {
    /// The keys have different intervals, or tracks have different key times. Smoothing needs samples with equal
    /// intervals.
    #[error("the keys are not evenly spaced, or not at the same times in all tracks")]
    Uneven,
    /// No kernel is a low-pass filter of this frequency at the rate of the samples.
    #[error("{hz} Hz: {reason}")]
    LowPass {
        /// The frequency, in hertz.
        hz: f64,
        /// The error of the kernel.
        reason: SmoothingError,
    },
    /// The sample times are invalid, or the samples could not be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
}

/// The smoothing of one clip: its samples and its kernel.
#[derive(Debug, Clone)]
pub struct SmoothJob {
    /// The sample times.
    pub frames: SampleTimes,
    /// The rate whose frames the samples are, if there is one.
    pub rate: Option<FrameRate>,
    /// The kernel and its options. If a frequency was requested, the kernel is that of the frequency.
    pub smoothing: Smoothing,
}

/// The samples of a clip, before and after smoothing.
#[derive(Debug, Clone)]
pub struct Smoothed {
    /// The samples before.
    pub before: Samples,
    /// The samples after.
    pub after: Samples,
}

/// How much intervals may differ, relative to an interval.
const EVEN: f64 = 1e-3;

impl SmoothJob {
    /// The smoothing of a clip at the frames of `rate`, or at its keys if there is no rate. `low_pass`, in hertz,
    /// replaces the kernel of `smoothing` by one that keeps lower frequencies, for samples of any rate.
    ///
    /// # Errors
    /// When there is no rate and the keys do not have equal intervals, or when the frequency is too high or too low
    /// for the samples.
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

    /// Samples the clip, and smooths rotations, translations and scalars. Scales are sampled only.
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
        after.scalars =
            scalars::smoothed(clip, &after.scalars, |packed, packs| {
                match Vectors::of(packed, packs, layout) {
                    Ok(packed) => {
                        let smoothed = engine.smooth_vectors(&packed, &self.smoothing)?;
                        Ok(smoothed.as_slice().iter().map(|v| v.truncate()).collect())
                    }
                    Err(_) => Ok(packed.to_vec()),
                }
            })?;
        Ok(Smoothed { before, after })
    }

    /// The clip with its smoothed samples as keys. Channels with steps get the samples before smoothing; all else
    /// stays.
    ///
    /// # Errors
    /// When a sample is not a valid key.
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

/// The key times, if all tracks have the same ones at equal intervals.
fn even_times(clip: &Motion) -> Option<Vec<f64>> {
    let longest = clip.set.tracks().max_by_key(|track| track.times.len())?;
    let times = longest.times;
    let fits = |list: &[f64]| list == times || list.len() == 1;
    let channels = [Channel::Translation, Channel::Scale];
    let vectors = (0..clip.set.track_count())
        .flat_map(|track| channels.map(|channel| clip.set.vector_keys(channel, track)));
    let all = clip.set.tracks().all(|track| fits(track.times))
        && vectors.flatten().all(|keys| fits(keys.times))
        && clip.scalar_keys().all(|keys| fits(keys.times));
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, largest) = (
        steps().fold(f64::INFINITY, f64::min),
        steps().fold(0.0, f64::max),
    );
    (all && (times.len() < 2 || largest - least <= EVEN * largest)).then(|| times.to_vec())
}
