//! Runs: consecutive samples of a track with one source, the unit of work of every device. A run's
//! numbers do not depend on where a window of work starts, so results are the same however work is
//! cut. [`Spans`](crate::time::spans::Spans) cuts the samples of a track into them.

use crate::math::canonical::round_f32;

/// Instead of an index: there is nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// Consecutive samples of one track with one source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// The first sample.
    pub(crate) sample: usize,
    /// Number of samples.
    pub(crate) count: usize,
    pub(crate) source: RunSource,
}

impl Run {
    #[inline(always)]
    pub(crate) fn new(sample: usize, count: usize, source: RunSource) -> Self {
        Self {
            sample,
            count,
            source,
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum RunSource {
    /// Store a constant.
    Constant(u32),
    /// Evaluate a segment.
    Segment(u32, Distance, Affine),
    /// Evaluate a curve in f64 on the host.
    Exact { index: u32, parameter: Parameter },
}

impl RunSource {
    /// A constant, if it is not [`NONE`].
    #[inline]
    pub(crate) fn held(constant: u32) -> Option<Self> {
        (constant != NONE).then_some(Self::Constant(constant))
    }

    /// What gives samples outside the keys: a constant, or a curve whose parameter is seconds from
    /// the outermost key; `None` if another part has them. In the unit of the timeline that key lies
    /// at `start`, and a second is `length` long.
    #[inline]
    pub(crate) fn outside(constant: u32, index: u32, start: f64, length: f64) -> Option<Self> {
        let parameter = Parameter { start, length };
        let curve = (index != NONE).then_some(Self::Exact { index, parameter });
        Self::held(constant).or(curve)
    }

    /// A segment at one parameter, whatever the sample.
    pub(crate) fn at(index: u32, parameter: f32) -> Self {
        let (scale, offset) = (0.0, parameter);
        Self::Segment(
            index,
            Distance::Near { first: 0.0 },
            Affine { scale, offset },
        )
    }

    /// A curve in f64 at one parameter, whatever the sample.
    pub(crate) fn exact_at(index: u32, t: f64) -> Self {
        let (start, length) = (t, f64::INFINITY);
        let parameter = Parameter { start, length };
        Self::Exact { index, parameter }
    }
}

/// How a run's parameter follows from the distance to the segment's middle:
/// `distance × scale + offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Affine {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// A sample's distance from the middle of its segment.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Distance {
    /// Frames from the whole frame nearest to the middle, for the run's first sample; one more for
    /// each sample after it. f32 holds all of them exactly, also those that fill the run's last
    /// vector.
    Near { first: f32 },
    /// The same where f32 may not have them exactly.
    Frames { first: i32 },
    /// Seconds from the middle, which is `half` a length after `start`, to a sample's explicit time.
    Seconds { start: f64, half: f64 },
}

impl Distance {
    /// The distance of a run's `j`th sample, in frames or seconds; `time` gives that sample's time.
    #[inline(always)]
    pub(crate) fn at_sample(self, j: usize, time: impl FnOnce() -> f64) -> f32 {
        match self {
            Self::Near { first } => first + j as f32,
            // An integer converts with one rounding, like the shader's sum of two exact halves.
            Self::Frames { first } => first.wrapping_add(j as i32) as f32,
            Self::Seconds { start, half } => round_f32((time() - start) - half),
        }
    }
}

/// Where the interval of a curve that is evaluated in f64 starts, and its length: in frames, or in
/// seconds if samples have explicit times. If `length` is infinite, the curve is evaluated at the
/// parameter `start` for all samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter {
    pub(crate) start: f64,
    pub(crate) length: f64,
}

impl Parameter {
    /// The curve's parameter at a frame or a time.
    #[inline]
    pub(crate) fn at(self, coordinate: f64) -> f64 {
        match self.length {
            f64::INFINITY => self.start,
            length => (coordinate - self.start) / length,
        }
    }
}

/// Takes runs. A trait rather than a closure: a closure's body is not compiled for
/// the vector width of the function that it is inlined into.
pub(crate) trait Emit {
    fn run(&mut self, run: Run);
}

impl Emit for Vec<Run> {
    fn run(&mut self, run: Run) {
        self.push(run);
    }
}

/// Distances in frames must be below this: they are kept in 32 bits.
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;
