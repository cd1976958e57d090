//! Times that a file rounded, put back on the frames that they were rounded from.
//!
//! glTF keeps times in f32, BVH prints its frame time with few digits. A key at frame 17 of 24 fps
//! is then at 0.70833331 s, and sampling at 120 fps would miss it, and the end, by 2e-9 s.

use tumble::{Channel, FrameRate};

use crate::motion::Motion;

/// The rates that are tried, frames and seconds, from the lowest.
const RATES: [(u64, u64); 14] = [
    (24_000, 1_001),
    (24, 1),
    (25, 1),
    (30_000, 1_001),
    (30, 1),
    (48, 1),
    (50, 1),
    (60_000, 1_001),
    (60, 1),
    (90, 1),
    (100, 1),
    (120_000, 1_001),
    (120, 1),
    (240, 1),
];

/// The type that a file kept its times in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Precision {
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 double precision.
    F64,
}

impl Precision {
    /// The distance from the number to the next one of this type, away from 0.
    pub(crate) fn ulp(self, number: f64) -> f64 {
        match self {
            Self::F32 => {
                let near = (number as f32).abs();
                f64::from(near.next_up()) - f64::from(near)
            }
            Self::F64 => number.abs().next_up() - number.abs(),
        }
    }
}

/// Puts lists of times of one clip on the frames of one rate, the lowest that fits all of them;
/// where there is none, each list on those of a rate of its own, or it stays as it is. Gives the
/// common rate.
///
/// A time fits if it is within one ulp of its type of a frame's time; a rate is not considered if
/// an ulp of the last time is more than 1/100 of a frame.
pub(crate) fn restore(lists: &mut [Vec<f64>], precision: Precision) -> Option<FrameRate> {
    let common = rate_of(lists.iter().flatten().copied(), precision);
    for list in lists {
        let rate = common.or_else(|| rate_of(list.iter().copied(), precision));
        if let Some(rate) = rate {
            for time in list {
                *time = frame_time(rate, frame(rate, *time));
            }
        }
    }
    common
}

/// The lowest rate on whose frames all times lie; `None` for no times, or for 0 alone, which says
/// nothing about a rate.
pub(crate) fn rate_of(
    times: impl Iterator<Item = f64> + Clone,
    precision: Precision,
) -> Option<FrameRate> {
    let largest = times.clone().map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let rates = RATES
        .iter()
        .filter_map(|&(frames, seconds)| FrameRate::new(frames, seconds).ok());
    rates
        .filter(|rate| precision.ulp(largest) * rate.per_second() < 0.01)
        .find(|&rate| fits(times.clone(), rate, precision))
}

impl Motion {
    /// The lowest of the usual rates on whose frames all key times lie, if there is one.
    #[must_use]
    pub fn rate_of_keys(&self) -> Option<FrameRate> {
        let channels = [Channel::Translation, Channel::Scale];
        let times = (0..self.set.track_count()).flat_map(|track| {
            let vectors = channels
                .into_iter()
                .filter_map(move |channel| self.set.vector_keys(channel, track));
            let rotations = self.set.track(track).times;
            std::iter::once(rotations).chain(vectors.map(|keys| keys.times))
        });
        rate_of(times.flatten().copied(), Precision::F64)
    }
}

/// Whether all times are within one ulp of frames of the rate.
pub(crate) fn fits(
    mut times: impl Iterator<Item = f64>,
    rate: FrameRate,
    precision: Precision,
) -> bool {
    times.all(|time| {
        let exact = frame_time(rate, frame(rate, time));
        (time - exact).abs() <= precision.ulp(exact)
    })
}

/// The nearest frame, negative before time 0.
fn frame(rate: FrameRate, time: f64) -> f64 {
    (time * rate.per_second()).round()
}

fn frame_time(rate: FrameRate, frame: f64) -> f64 {
    rate.time_of(frame.abs() as u64).copysign(frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(frames: impl Iterator<Item = u32>, rate: f64) -> Vec<f64> {
        frames
            .map(|n| f64::from((f64::from(n) / rate) as f32))
            .collect()
    }

    #[test]
    fn times_rounded_to_f32_are_frames_again() {
        let mut lists = vec![rounded(0..=17, 24.0), rounded([3, 17].into_iter(), 24.0)];
        assert_eq!(lists[0][17], 0.708_333_313_465_118_4);
        let rate = restore(&mut lists, Precision::F32);
        assert_eq!(rate, FrameRate::new(24, 1).ok());
        assert_eq!(lists[0][17], 17.0 / 24.0);
        assert_eq!(lists[1], [3.0 / 24.0, 17.0 / 24.0]);
        let mut ntsc = vec![rounded((0..90).map(|n| n * 1001), 30_000.0)];
        assert_eq!(
            restore(&mut ntsc, Precision::F32),
            FrameRate::new(30_000, 1001).ok()
        );
        assert_eq!(ntsc[0][89], 89.0 * 1001.0 / 30_000.0);
    }

    #[test]
    fn times_off_every_grid_stay() {
        let times = vec![0.0, 0.1234, 2.5];
        let mut lists = vec![times.clone(), vec![0.25, 0.5]];
        assert_eq!(restore(&mut lists, Precision::F32), None);
        assert_eq!(lists, [times, vec![0.25, 0.5]]);
        // A day in, an f32 is 7.8 ms wide: nothing can be told from it.
        let late = vec![vec![86_400.0, 86_400.039]];
        assert_eq!(restore(&mut late.clone(), Precision::F32), None);
        assert_eq!(restore(&mut [vec![0.0]], Precision::F64), None);
    }

    #[test]
    fn times_before_zero_are_frames_too() {
        let mut lists = vec![vec![
            f64::from(-1.0f32 / 30.0),
            0.0,
            f64::from(1.0f32 / 3.0),
        ]];
        assert_eq!(
            restore(&mut lists, Precision::F32),
            FrameRate::new(30, 1).ok()
        );
        assert_eq!(lists[0], [-1.0 / 30.0, 0.0, 10.0 / 30.0]);
    }
}
