//! `--fps`, `--times`, `--start`, `--end`: which samples to evaluate.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::builder::TypedValueParser;
use clap::{Args, ValueEnum};
use tumble::{FrameRate, SampleTimes, SampleTimesError, Timeline};
use tumble_formats::end_frame::{
    EndFrame, EndFrameError, EndSample, FramesToEnd, RateFrames, SampledResult,
};
use tumble_formats::format::Document;
use tumble_formats::motion::Motion;
use tumble_formats::outside::Outside;
use tumble_formats::times::{clock_text, open_times};
use tumble_formats::{Code, Diagnostic, Format, ReadOptions};

use crate::arguments::interpolation::{kept, of_outside};
use crate::arguments::output::one_of;
use crate::arguments::tolerance::not_negative;
use crate::batch::digest;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::names;
use crate::messages::words;

/// Broadcast rates are n × 1000/1001; written as decimals they drift by a frame in
/// some hours.
const BROADCAST: [u64; 5] = [24, 30, 48, 60, 120];

/// A decimal rate this close to a broadcast rate (relative) was probably meant to
/// be it: 23.98 is, 24 is not.
const BROADCAST_TOLERANCE: f64 = 2e-4;

#[derive(Debug, Clone, Args)]
pub(crate) struct SamplingArguments {
    /// Frames per second: a number, a ratio such as 30000/1001, or `source`, the rate of the input's keys (25 if they have no rate, or a rate below 10)
    #[arg(
        short = 'f',
        long,
        value_name = "FPS",
        default_value_t = RateChoice::Source,
        allow_hyphen_values = true
    )]
    fps: RateChoice,
    /// Evaluate at the times in a text file instead: seconds, one per line (`-`: standard input)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fps", "start", "end"])]
    times: Option<PathBuf>,
    /// Where to start, seconds [default: the first key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// Start at 0 s if the first key is later, and hold the first key until its time, as players of glTF do
    #[arg(long, conflicts_with_all = ["times", "start"])]
    from_zero: bool,
}

/// `--fps`: how many frames a second has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RateChoice {
    /// The rate of each input's keys.
    Source,
    /// Twice the rate of each input's keys: their frames, and those halfway between them, where curves differ.
    SourceAndHalves,
    Number(FrameRate),
}

/// The lowest rate of keys that is taken for a frame rate. Keys that are further apart were set by a person, or come
/// from a slow log.
const MIN_SOURCE_RATE: f64 = 10.0;

/// The rate of frames if the keys have no rate.
const DEFAULT_RATE: u64 = 25;

const SOURCE: &str = "source";

impl RateChoice {
    /// The rate of a clip's frames.
    pub(crate) fn of(self, clip: &Motion) -> FrameRate {
        let found = match self {
            Self::Number(rate) => Some(rate),
            Self::Source => source_rate(clip),
            Self::SourceAndHalves => source_rate(clip).and_then(|rate| rate.times(2).ok()),
        };
        let found = found.or_else(|| FrameRate::new(DEFAULT_RATE, 1).ok());
        found.expect("25 frames a second are a rate")
    }

    /// The rate that was assumed, because the keys of the clip have none.
    pub(crate) fn assumed(self, clip: &Motion) -> Option<FrameRate> {
        let is_assumed = self == Self::Source && source_rate(clip).is_none();
        is_assumed.then(|| self.of(clip))
    }
}

/// The rate of a clip's keys, if they are dense enough to be frames.
fn source_rate(clip: &Motion) -> Option<FrameRate> {
    clip.rate
        .filter(|rate| rate.per_second() >= MIN_SOURCE_RATE)
}

impl FromStr for RateChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            SOURCE => Ok(Self::Source),
            _ => text
                .parse()
                .map(Self::Number)
                .map_err(|error: SampleTimesError| {
                    format!("{error}; or `{SOURCE}`, the rate of the input's keys")
                }),
        }
    }
}

impl fmt::Display for RateChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source | Self::SourceAndHalves => f.write_str(SOURCE),
            Self::Number(rate) => rate.fmt(f),
        }
    }
}

/// The requested samples, before the tracks are known.
pub(crate) enum SampleChoice {
    Rate {
        rate: RateChoice,
        start: Option<f64>,
        end: Option<f64>,
        /// Start at 0 if the first key is later.
        from_zero: bool,
    },
    Times(Vec<f64>),
    /// The key times of another file.
    Keys(KeyTimes),
}

/// The key times of another file.
pub(crate) struct KeyTimes {
    /// Seconds, increasing, counted from a whole second.
    times: Vec<f64>,
    from: i64,
}

/// `--max-gap`: between which keys a clip is not interpolated.
#[derive(Debug, Clone, Args)]
pub(crate) struct GapArguments {
    /// The longest gap, seconds: keys that are farther apart are not interpolated
    #[arg(long, value_name = "SECONDS", value_parser = not_negative)]
    max_gap: Option<f64>,
    /// What to do with times between keys that are more than --max-gap apart
    #[arg(long, value_enum, requires = "max_gap", default_value = "leave-out")]
    in_gaps: InGaps,
}

impl GapArguments {
    /// The participle for times in gaps in messages: "held" or "left out".
    pub(crate) fn done_in_gaps(&self) -> &'static str {
        match self.in_gaps {
            InGaps::Hold => "held",
            InGaps::LeaveOut | InGaps::Refuse => "left out",
        }
    }
}

/// How times between two keys that are too far apart are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum InGaps {
    /// leave them out
    LeaveOut,
    /// refuse the input
    Refuse,
    /// stay at the key before
    Hold,
}

/// `--end-frame`: the last sample of a result whose clip ends between two frames.
#[derive(Debug, Clone, Args)]
pub(crate) struct EndFrameArguments {
    /// If a clip ends between two frames: add a key at its end (`key`), one more frame with the value of the end
    /// (`hold`), or nothing (`leave-out`) [default: key; hold in clips of formats without times; leave-out in NPY, and
    /// in results other than rotations]
    #[arg(long, value_name = "HOW", value_parser = end_frame(), conflicts_with_all = ["times", "at"])]
    end_frame: Option<EndFrame>,
}

impl EndFrameArguments {
    /// Whether the command line sets it.
    pub(crate) fn is_chosen(&self) -> bool {
        self.end_frame.is_some()
    }

    /// The rule for a new result.
    ///
    /// # Errors
    /// When the result has no time for a key at the end.
    pub(crate) fn for_result(&self, result: SampledResult<'_>) -> Result<EndFrame, String> {
        EndFrame::for_result(self.end_frame, result).map_err(Self::refusal)
    }

    /// The rule for a file that is written again.
    ///
    /// # Errors
    /// As [`EndFrameArguments::for_result`].
    pub(crate) fn for_document(&self, document: &dyn Document) -> Result<EndFrame, String> {
        EndFrame::for_document(self.end_frame, document).map_err(Self::refusal)
    }

    fn refusal(error: EndFrameError) -> String {
        let remedy = match error {
            EndFrameError::NoFileOfTimes { .. } => {
                "give --times-out, or --end-frame hold or leave-out"
            }
            _ => "give --end-frame hold or leave-out",
        };
        format!("{error}; {remedy}")
    }
}

fn end_frame() -> impl TypedValueParser<Value = EndFrame> {
    let help = |end_frame| match end_frame {
        EndFrame::Key => "a sample at the end, less than a frame after the last frame",
        EndFrame::Hold => "one more frame, after the end, with the value of the end",
        EndFrame::LeaveOut => "nothing: the last frame before the end is the last sample",
    };
    one_of(EndFrame::ALL.map(|end_frame| (end_frame.name(), help(end_frame), end_frame)))
}

/// The samples of one clip.
pub(crate) struct ClipFrames {
    /// The times at which it is evaluated.
    pub(crate) frames: SampleTimes,
    /// The times written with the results, if they differ from `frames`: in gaps, a key is held.
    held: Option<SampleTimes>,
    /// The sample at the end of the clip, after its frames.
    pub(crate) end: Option<EndSample>,
    /// The seconds from the last frame to the end of the clip, if no sample follows the last frame.
    pub(crate) left_out: Option<f64>,
    /// The rate of which all written times are neighbouring frames.
    pub(crate) rate: Option<FrameRate>,
    /// How many of the times were in gaps, and were left out or held.
    pub(crate) in_gaps: usize,
    /// The whole second of the clip from which times count.
    pub(crate) time_offset: i64,
}

impl From<SampleTimes> for ClipFrames {
    fn from(frames: SampleTimes) -> Self {
        Self {
            frames,
            held: None,
            end: None,
            left_out: None,
            rate: None,
            in_gaps: 0,
            time_offset: 0,
        }
    }
}

impl ClipFrames {
    /// Frames of a rate, and the sample at the end of the clip.
    pub(crate) fn at_rate(
        clip: &Motion,
        frames: RateFrames,
        end_frame: EndFrame,
        name: &str,
    ) -> Result<Self, Failure> {
        let found = FramesToEnd::new(clip, frames, end_frame)
            .map_err(|error| Failure::evaluating(name, &error))?;
        Ok(Self {
            end: found.end,
            left_out: found.left_out,
            rate: found.rate,
            time_offset: found.time_offset,
            ..found.frames.into()
        })
    }

    /// Whether a key is held in gaps.
    pub(crate) fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// The times written with the results.
    pub(crate) fn written_times(&self, clip: &Motion, name: &str) -> Result<Timeline, Failure> {
        let frames = resolved(self.held.as_ref().unwrap_or(&self.frames), clip, name)?;
        let Some(end) = self.end else {
            return Ok(frames);
        };
        let times = frames.times(0).chain([end.time]).collect();
        resolved(&SampleTimes::at(times), clip, name)
    }
}

fn resolved(frames: &SampleTimes, clip: &Motion, name: &str) -> Result<Timeline, Failure> {
    let timeline = frames.resolve(clip.set.track_count(), clip.set.time_span());
    timeline.map_err(|error| Failure::evaluating(name, &error.into()))
}

/// `--at`: the times of another file.
#[derive(Debug, Clone, Args)]
pub(crate) struct AtKeysArguments {
    /// Evaluate at the key times of another motion file instead
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fps", "times", "start", "end", "from_zero"])]
    at: Option<PathBuf>,
}

impl AtKeysArguments {
    /// The times of the file; `None` without `--at`.
    pub(crate) fn samples(&self) -> Result<Option<SampleChoice>, Failure> {
        let Some(path) = &self.at else {
            return Ok(None);
        };
        let loaded = Format::open_detected(path, &ReadOptions::default())
            .map_err(|diagnostic| Failure::input(&diagnostic, ""))?;
        let [clip] = &loaded.clips[..] else {
            let message = "--at needs a file with a single animation";
            return Err(Failure::usage(format!("{}: {message}", names::input(path))));
        };
        Ok(Some(SampleChoice::Keys(KeyTimes {
            times: clip.key_times(),
            from: clip.time_offset,
        })))
    }
}

impl SamplingArguments {
    /// Whether the list of times comes from standard input.
    pub(crate) fn reads_standard_input(&self) -> bool {
        self.times.as_deref().is_some_and(names::is_standard)
    }

    /// Checks what can be checked without the tracks, and reads the list of times.
    pub(crate) fn samples(&self) -> Result<SampleChoice, Failure> {
        if let Some(path) = &self.times {
            return Ok(SampleChoice::Times(times(path)?));
        }
        check_range(self.start, self.end)?;
        if let RateChoice::Number(rate) = self.fps
            && let Some(meant) = broadcast_rate(rate)
        {
            words::warning(&format!(
                "exactly {} frames per second is used; for the broadcast (NTSC) rate write {meant}",
                rate.per_second()
            ));
        }
        Ok(SampleChoice::Rate {
            rate: self.fps,
            start: self.start,
            end: self.end,
            from_zero: self.from_zero,
        })
    }
}

impl SampleChoice {
    /// The same, but with frames halfway between keys if `--fps` is the rate of the input, because the curve must be
    /// compared between keys, too.
    pub(crate) fn and_halves(mut self) -> Self {
        if let Self::Rate { rate, .. } = &mut self
            && *rate == RateChoice::Source
        {
            *rate = RateChoice::SourceAndHalves;
        }
        self
    }

    /// The rate that was assumed for a clip, because its keys have none.
    pub(crate) fn assumed_rate(&self, clip: &Motion) -> Option<FrameRate> {
        match self {
            Self::Rate { rate, .. } => rate.assumed(clip),
            Self::Times(_) | Self::Keys(_) => None,
        }
    }

    /// The hash of a list of times; empty for a rate.
    pub(crate) fn digest(&self) -> String {
        match self {
            Self::Times(times) => {
                let bytes: Vec<u8> = times.iter().flat_map(|time| time.to_le_bytes()).collect();
                digest::of_bytes([&*bytes])
            }
            Self::Keys(KeyTimes { times, from }) => {
                let numbers = times.iter().map(|time| time.to_le_bytes());
                let bytes: Vec<u8> = numbers.flatten().chain(from.to_le_bytes()).collect();
                digest::of_bytes([&*bytes])
            }
            Self::Rate { .. } => String::new(),
        }
    }

    /// The end of the frames of a rate in a clip, in seconds: the end that the command line sets, otherwise the last
    /// key. `None` for listed times, or if there is neither.
    pub(crate) fn end_of(&self, clip: &Motion, outside: Outside) -> Option<f64> {
        let Self::Rate { end, .. } = *self else {
            return None;
        };
        let end = end.map(|end| clip.time_in_set(end));
        let is_known = end.is_some() || clip.set.time_span().is_some();
        is_known.then(|| outside.end(end, clip))
    }

    /// The samples for one clip; warns when they exceed its keys, and of those in gaps.
    ///
    /// # Errors
    /// When a sample is in a gap, and samples in gaps are refused.
    pub(crate) fn of_clip(
        &self,
        clip: &Motion,
        gaps: &GapArguments,
        outside: Outside,
        end_frame: EndFrame,
        name: &str,
    ) -> Result<ClipFrames, Failure> {
        let frames = self.of(clip, outside, name)?;
        let all = match *self {
            Self::Rate { rate, .. } => {
                let rate = rate.of(clip);
                let end = self.end_of(clip, outside).unwrap_or(0.0);
                let frames = RateFrames { frames, rate, end };
                ClipFrames::at_rate(clip, frames, end_frame, name)?
            }
            Self::Times(_) | Self::Keys(_) => frames.into(),
        };
        let Some(max_gap) = gaps.max_gap else {
            return Ok(all);
        };
        let mut times: Vec<f64> = resolved(&all.frames, clip, name)?.times(0).collect();
        times.extend(all.end.map(|end| end.at));
        let known = clip.key_times();
        // The key before the gap is held.
        let held = |time: f64| {
            let next = known.partition_point(|&key| key < time);
            let before = known[next.checked_sub(1)?];
            let after = *known.get(next).filter(|&&key| key != time)?;
            (after - before > max_gap).then_some(before)
        };
        let held: Vec<Option<f64>> = times.iter().map(|&time| held(time)).collect();
        let Some(first) = held.iter().position(Option::is_some) else {
            return Ok(all);
        };
        let in_gaps = held.iter().flatten().count();
        let lie = if times.len() == 1 { "lies" } else { "lie" };
        let found = format!(
            "{in_gaps} of {} {lie} between keys that are more than {max_gap} s apart",
            words::count(times.len(), "time")
        );
        let each = times.iter().zip(&held);
        let written: Vec<f64> = all.written_times(clip, name)?.times(0).collect();
        let mut samples = ClipFrames {
            in_gaps,
            left_out: all.left_out,
            ..all.frames.into()
        };
        let done = match gaps.in_gaps {
            InGaps::Refuse => {
                let time = clock_text(clip.time_offset, times[first]);
                let message = format!(
                    "{name}: {found}, the first at {time} s; continue with --in-gaps leave-out or hold"
                );
                return Err(Failure::new(ALL_INPUTS, message));
            }
            InGaps::LeaveOut => {
                let outside = |times: &[f64]| {
                    let each = times.iter().zip(&held);
                    let outside = each.filter(|(_, held)| held.is_none());
                    SampleTimes::at(outside.map(|(&time, _)| time).collect())
                };
                samples.frames = outside(&times);
                samples.held = (written != times).then(|| outside(&written));
                "left out"
            }
            InGaps::Hold => {
                let evaluated = each.map(|(&time, held)| held.unwrap_or(time));
                samples.frames = SampleTimes::at(evaluated.collect());
                samples.held = Some(SampleTimes::at(written));
                samples.rate = all.rate;
                "held at the key before"
            }
        };
        let message = format!("{found}; they are {done}");
        words::warn_of(Diagnostic::new(name, Code::InGaps, message));
        Ok(samples)
    }

    /// The samples for one clip; warns when they exceed its keys.
    ///
    /// # Errors
    /// When no time is left: if the times of another file are all outside the clip, or if times outside its keys are
    /// left out.
    pub(crate) fn of(
        &self,
        clip: &Motion,
        outside: Outside,
        name: &str,
    ) -> Result<SampleTimes, Failure> {
        let at = |times: Vec<f64>| {
            let start = times.iter().copied().fold(f64::INFINITY, f64::min);
            let end = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            warn_outside_keys(start, end, clip, outside, name);
            SampleTimes::at(times)
        };
        let frames = match self {
            Self::Rate {
                rate,
                end,
                from_zero: true,
                ..
            } => {
                let (first, last) = clip.set.time_span().unwrap_or((0.0, 0.0));
                let end = end.map_or(last, |end| clip.time_in_set(end));
                warn_outside_keys(first, end, clip, outside, name);
                SampleTimes::rate(rate.of(clip)).between(first.min(0.0), end)
            }
            Self::Rate {
                rate, start, end, ..
            } => return in_frames(rate.of(clip), [*start, *end], clip, outside, name),
            Self::Times(times) => at(times.iter().map(|&time| clip.time_in_set(time)).collect()),
            Self::Keys(keys) => {
                // The times of another clip are relative to its time offset, so they are shifted to the offset of
                // this clip.
                let shift = (keys.from - clip.time_offset) as f64;
                let times: Vec<f64> = keys.times.iter().map(|time| time + shift).collect();
                let common = outside.check_common(&times, clip);
                common.map_err(|error| of_outside(error, name))?;
                at(times)
            }
        };
        let rate = match self {
            Self::Rate { rate, .. } => Some(rate.of(clip)),
            Self::Times(_) | Self::Keys(_) => None,
        };
        kept(outside, frames, rate, clip, name)
    }
}

/// Frames from `start`, or the first key, to `end`, or the last key; warns when they exceed the keys.
///
/// # Errors
/// When times outside the keys are left out, and none is left.
pub(crate) fn in_frames(
    rate: FrameRate,
    [start, end]: [Option<f64>; 2],
    clip: &Motion,
    outside: Outside,
    name: &str,
) -> Result<SampleTimes, Failure> {
    if (start, end) == (None, None) {
        return Ok(SampleTimes::rate(rate));
    }
    let whole = clip.set.time_span().unwrap_or((0.0, 0.0));
    let (start, end) = clip.range_in_set(start, end, whole);
    warn_outside_keys(start, end, clip, outside, name);
    let frames = SampleTimes::rate(rate).between(start, end);
    kept(outside, frames, Some(rate), clip, name)
}

fn warn_outside_keys(start: f64, end: f64, clip: &Motion, outside: Outside, name: &str) {
    let (first, last) = clip.set.time_span().unwrap_or((0.0, 0.0));
    // With an explicit option the user has chosen what happens outside the keys, so there is no warning; `kept`
    // prints how many times are left out.
    let [is_default_before, is_default_after] = outside.is_default();
    if start < first && is_default_before || end > last && is_default_after {
        let [start, end, first, last] =
            [start, end, first, last].map(|time| clock_text(clip.time_offset, time));
        let message = format!(
            "the times from {start} to {end} s exceed the keys, {first} to {last} s; outside them the first or the last \
             key is held (--before and --after select other values)"
        );
        words::warn_of(Diagnostic::new(name, Code::OutsideKeys, message));
    }
}

/// The broadcast rate that a decimal stands for.
fn broadcast_rate(rate: FrameRate) -> Option<FrameRate> {
    BROADCAST
        .into_iter()
        .filter_map(|frames| FrameRate::new(frames * 1000, 1001).ok())
        .filter(|&exact| exact != rate)
        .find(|exact| (rate.per_second() / exact.per_second() - 1.0).abs() < BROADCAST_TOLERANCE)
}

/// Refuses a range that ends before it starts.
pub(crate) fn check_range(start: Option<f64>, end: Option<f64>) -> Result<(), Failure> {
    if let (Some(start), Some(end)) = (start, end)
        && end < start
    {
        return Err(Failure::usage(format!(
            "the range ends at {} s, before it starts at {} s; swap --start and --end",
            clock_text(0, end),
            clock_text(0, start)
        )));
    }
    Ok(())
}

/// Parses a time.
pub(crate) fn finite_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if time.is_finite() => Ok(time),
        _ => Err(format!(
            "invalid time `{text}`: expected a finite number of seconds"
        )),
    }
}

/// Parses the difference of two clocks.
pub(crate) fn clock_difference(text: &str) -> Result<f64, String> {
    /// The largest difference of two clocks that count seconds, one from 1970 and one from the start of a recording:
    /// 1970 to the year 5138.
    const LARGEST: f64 = 1e11;
    match finite_seconds(text)? {
        difference if difference.abs() <= LARGEST => Ok(difference),
        _ => Err(format!(
            "{text} s is too long a time between two clocks; give seconds from -1e11 to 1e11"
        )),
    }
}

/// Reads a list of times.
pub(crate) fn times(path: &Path) -> Result<Vec<f64>, Failure> {
    open_times(path).map_err(|diagnostic| Failure::input(&diagnostic, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_of_broadcast_rates_are_noticed() {
        let meant = |text: &str| broadcast_rate(text.parse().unwrap()).map(|r| r.to_string());
        for (text, exact) in [
            ("29.97", "30000/1001"),
            ("23.976", "24000/1001"),
            ("23.98", "24000/1001"),
            ("59.94", "60000/1001"),
        ] {
            assert_eq!(meant(text).as_deref(), Some(exact), "{text}");
        }
        for text in ["25", "24", "30", "60", "30000/1001", "12.5"] {
            assert_eq!(meant(text), None, "{text}");
        }
    }
}
