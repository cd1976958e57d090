//! Arcs with fewer samples than keys: a sample to a lane, straight from the two keys
//! beside it. No segment is kept, and none is made where no sample falls. The same
//! operations as by way of segments, and so the same bits.

use std::ops::Range;

use glam::Quat;

use super::dispatch::in_lanes;
use super::sample_lanes::{Boundaries, Dots, IN_DOUBT, LANES, SampleBlock};
use crate::clock::{FramesError, Ticks, Timeline};
use crate::engine::Error;
use crate::frame_clock::{FrameClock, in_frames};
use crate::method::{Form, Interpolation, InterpolationError, Path};
use crate::prepare::arc;
use crate::schedule::COUNTABLE;
use crate::tracks::TrackSet;

/// Evaluates tracks; what it needs for that is kept.
pub(super) struct SampledArcs<'a> {
    interpolation: &'a Interpolation,
    samples: Box<SampleBlock>,
    boundaries: Boundaries,
    plan: Plan<'a>,
    dots: Dots,
    /// For each interval of the track, the sign of its first key.
    signs: Vec<f32>,
}

/// Where samples lie among the keys of a track. Tracks that share their times share it.
#[derive(Default)]
struct Plan<'a> {
    times: &'a [f64],
    clock: Option<FrameClock>,
    window: Range<usize>,
    /// Samples up to here lie before the first key, and from there on behind the last.
    begin: usize,
    end: usize,
    /// Samples on keys: the sample, the key.
    on_keys: Vec<(usize, usize)>,
    between: Vec<Between>,
}

/// A sample between two keys.
struct Between {
    sample: usize,
    /// The first of them.
    key: usize,
    /// Where they lie: frames.
    start: f64,
    end: f64,
}

/// Some intervals of a track that follow one another.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub(super) times: &'a [f64],
    pub(super) keys: &'a [Quat],
    /// The track's place in the set.
    pub(super) index: usize,
    /// The first of their keys.
    pub(super) first_key: usize,
}

impl<'a> SampledArcs<'a> {
    pub(super) fn new(interpolation: &'a Interpolation, timeline: &Timeline) -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            interpolation,
            samples: Box::new(SampleBlock {
                from: [identity; LANES],
                to: [identity; LANES],
                signs: [1.0; LANES],
                starts: [0.0; LANES],
                ends: [1.0; LANES],
                places: [0.0; LANES],
                frames: matches!(timeline.ticks, Ticks::Frames { .. }),
                noise: interpolation.path.flips_below(),
                as_polynomials: interpolation.form() == Form::Polynomial,
                outputs: [0; LANES],
                count: 0,
                rotations: [identity; LANES],
            }),
            plan: Plan::default(),
            boundaries: Boundaries {
                times: [0.0; LANES],
                count: 0,
                clock: None,
                frames: [0.0; LANES],
                firsts: [0; LANES],
                whole: [0; LANES],
            },
            dots: Dots {
                keys: [identity; LANES + 1],
                count: 0,
                dots: [0.0; LANES],
                doubtful: 0,
            },
            signs: Vec::new(),
        }
    }

    /// Every sample of some tracks, `[track][sample]`.
    pub(super) fn tracks(
        &mut self,
        set: &'a TrackSet,
        tracks: Range<usize>,
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let samples = timeline.len();
        for (place, index) in tracks.enumerate() {
            let (times, keys) = set.times_and_keys(index);
            self.interpolation.ends.check(keys, index)?;
            let stretch = Stretch {
                times,
                keys,
                index,
                first_key: 0,
            };
            self.align(stretch, 1.0)?;
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let latest = times[times.len() - 1];
                    let clock = FrameClock::new(*rate, *start, latest);
                    let all = 0..samples;
                    self.frames(stretch, clock, all, place * samples, output)?;
                }
                Ticks::Times {
                    times: asked,
                    stride,
                } => {
                    let own = &asked[index * stride..][..samples];
                    let row = place * samples..(place + 1) * samples;
                    self.times(stretch, own, row, output);
                }
            }
        }
        self.flush(output);
        Ok(())
    }

    /// The samples of some intervals of a track, `window`, whose first key counts with
    /// `sign`.
    pub(super) fn stretch(
        &mut self,
        stretch: Stretch<'a>,
        sign: f32,
        clock: FrameClock,
        window: Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        self.align(stretch, sign)?;
        self.frames(stretch, clock, window, 0, output)?;
        self.flush(output);
        Ok(())
    }

    /// The sign of every interval's first key, where the first one's is given; what it
    /// is behind the last.
    pub(super) fn align(
        &mut self,
        stretch: Stretch<'_>,
        mut sign: f32,
    ) -> Result<f32, InterpolationError> {
        let path = self.interpolation.path;
        let noise = path.flips_below();
        let keys = stretch.keys;
        self.signs.clear();
        if keys.len() == 2 && path == Path::Shortest && stretch.first_key == 0 {
            // The second key's sign is nobody's first.
            self.signs.push(sign);
            return Ok(sign);
        }
        for start in (0..keys.len() - 1).step_by(LANES) {
            let keys = &keys[start..keys.len().min(start + LANES + 1)];
            for (own, key) in self.dots.keys.iter_mut().zip(keys) {
                *own = key.to_array();
            }
            self.dots.count = keys.len() - 1;
            in_lanes(&mut self.dots);
            if self.dots.doubtful == 0 {
                self.signs.resize(self.signs.len() + keys.len() - 1, sign);
                continue;
            }
            for (i, &near) in self.dots.dots[..keys.len() - 1].iter().enumerate() {
                self.signs.push(sign);
                let dot = if near > IN_DOUBT || (-0.99..-IN_DOUBT).contains(&near) {
                    f64::from(near)
                } else {
                    arc(keys[i].to_array(), keys[i + 1].to_array(), noise).dot
                };
                if path.refuses(dot) {
                    return Err(InterpolationError::Antipodal {
                        track: stretch.index,
                        key: stretch.first_key + start + i,
                    });
                }
                if dot < noise {
                    sign = -sign;
                }
            }
        }
        Ok(sign)
    }

    /// The samples in `window` of a stretch's intervals, and of what lies beside the
    /// track where it ends; the first of them goes to `place`.
    fn frames(
        &mut self,
        stretch: Stretch<'a>,
        clock: FrameClock,
        window: Range<usize>,
        place: usize,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        self.plan(stretch, clock, &window)?;
        // Apart from the rest, which changes while it is gone through.
        let plan = std::mem::take(&mut self.plan);
        let keys = stretch.keys;
        let row = &mut output[place..place + window.len()];
        row[..plan.begin].fill(keys[0].to_array());
        row[plan.end..].fill(keys[keys.len() - 1].to_array());
        for &(sample, key) in &plan.on_keys {
            row[sample - window.start] = keys[key].to_array();
        }
        for between in &plan.between {
            let &Between {
                sample,
                key,
                start,
                end,
            } = between;
            let interval = (start, end, sample as f64);
            let place = place + sample - window.start;
            self.push(keys, key, interval, place, output);
        }
        self.plan = plan;
        Ok(())
    }

    /// Finds out where the samples of a window lie, unless that is known already.
    fn plan(
        &mut self,
        stretch: Stretch<'a>,
        clock: FrameClock,
        window: &Range<usize>,
    ) -> Result<(), FramesError> {
        let times = stretch.times;
        let plan = &mut self.plan;
        if std::ptr::eq(plan.times, times) && plan.clock == Some(clock) && plan.window == *window {
            return Ok(());
        }
        plan.times = &[];
        plan.on_keys.clear();
        plan.between.clear();
        let (from, samples) = (window.start, window.end);
        let last = times.len() - 1;
        let inside = |first: i64| first.clamp(from as i64, samples as i64) as usize - from;
        (plan.begin, plan.end) = (0, samples - from);
        if last == 0 {
            plan.begin = inside(clock.first_frame(times[0]) as i64);
            plan.end = plan.begin;
        }
        self.boundaries.clock = Some(clock);
        // Each block starts with the boundary that the one before it ended with.
        'blocks: for block in (0..last).step_by(LANES - 1) {
            let own = &times[block..times.len().min(block + LANES)];
            self.boundaries.times[..own.len()].copy_from_slice(own);
            self.boundaries.count = own.len();
            in_lanes(&mut self.boundaries);
            let bounds = &self.boundaries;
            if block == 0 {
                plan.begin = inside(bounds.firsts[0]);
            }
            if block + own.len() == times.len() {
                plan.end = inside(bounds.firsts[own.len() - 1]);
            }
            for j in 0..own.len() - 1 {
                let (frame, end) = (bounds.frames[j], bounds.frames[j + 1]);
                let mut first = bounds.firsts[j];
                let to = bounds.firsts[j + 1].min(samples as i64);
                if first >= samples as i64 {
                    break 'blocks;
                }
                if bounds.whole[j] == 1 && (from as i64..to).contains(&first) {
                    plan.on_keys.push((first as usize, block + j));
                    first += 1;
                }
                for sample in first.max(from as i64)..to {
                    let place = sample as f64;
                    if end - frame >= COUNTABLE
                        && (place - in_frames(frame, end, 0.0).whole).abs() >= COUNTABLE
                    {
                        return Err(FramesError::GapTooLong {
                            track: stretch.index,
                            key: stretch.first_key + block + j,
                            frames: end - frame,
                        });
                    }
                    plan.between.push(Between {
                        sample: sample as usize,
                        key: block + j,
                        start: frame,
                        end,
                    });
                }
            }
        }
        (plan.times, plan.clock, plan.window) = (times, Some(clock), window.clone());
        Ok(())
    }

    fn times(
        &mut self,
        Stretch {
            times: starts,
            keys,
            ..
        }: Stretch<'_>,
        times: &[f64],
        row: Range<usize>,
        output: &mut [[f32; 4]],
    ) {
        let last = starts.len() - 1;
        let mut i = 0;
        for (&time, place) in times.iter().zip(row) {
            if time >= starts[last] {
                output[place] = keys[last].to_array();
                continue;
            }
            if time < starts[0] {
                output[place] = keys[0].to_array();
                continue;
            }
            let holds = |i: usize| starts[i] <= time && time < starts[i + 1];
            // Times mostly increase: look here and next before searching.
            if !holds(i) {
                i = if i + 1 < last && holds(i + 1) {
                    i + 1
                } else {
                    starts.partition_point(|&start| start <= time) - 1
                };
            }
            if time == starts[i] {
                output[place] = keys[i].to_array();
            } else {
                let interval = (starts[i], starts[i + 1], time);
                self.push(keys, i, interval, place, output);
            }
        }
    }

    #[inline(always)]
    fn push(
        &mut self,
        keys: &[Quat],
        key: usize,
        (start, end, place): (f64, f64, f64),
        output_place: usize,
        output: &mut [[f32; 4]],
    ) {
        let samples = &mut *self.samples;
        let lane = samples.count;
        samples.from[lane] = keys[key].to_array();
        samples.to[lane] = keys[key + 1].to_array();
        samples.signs[lane] = self.signs[key];
        samples.starts[lane] = start;
        samples.ends[lane] = end;
        samples.places[lane] = place;
        samples.outputs[lane] = output_place;
        samples.count += 1;
        if samples.count == LANES {
            self.flush(output);
        }
    }

    fn flush(&mut self, output: &mut [[f32; 4]]) {
        let samples = &mut *self.samples;
        in_lanes(samples);
        let places = &samples.outputs[..samples.count];
        for (&place, &rotation) in places.iter().zip(&samples.rotations) {
            output[place] = rotation;
        }
        samples.count = 0;
    }
}
