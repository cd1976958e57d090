//! Restores times that a file rounded to the frames from which they were rounded.
//!
//! glTF stores times in f32, and text has few decimals. A key at frame 17 of 24 fps is then at 0.70833331 s, and
//! sampling at 120 fps would miss it, and the end, by 2e-9 s.

use tumble::FrameRate;

use crate::motion::Motion;
use crate::rate::{FrameGrid, Precision, RateSource, frame_time, of};

/// Moves the lists of times of one clip to the frames of the rate that fits all of them. If there is none, each list
/// is moved to the frames of the rate that fits it, or stays unchanged. Returns the common rate of the keys, if there
/// is one.
pub(crate) fn restore(lists: &mut [Vec<f64>], precision: Precision) -> Option<FrameRate> {
    let common = of(&RateSource::Times(lists, precision));
    for list in &mut *lists {
        let found =
            common.or_else(|| of(&RateSource::Times(std::slice::from_ref(list), precision)));
        let Some(found) = found else { continue };
        // If frames are relative to an arbitrary first time, the exact frame time is not a better value than the time
        // in f64, so such times are kept.
        let was_rounded = |&time: &f64| {
            let off = (time - frame_time(found.grid, found.phase, time)).abs();
            off > 2.0 * Precision::F64.rounding(time)
        };
        if found.phase == 0.0 || list.iter().any(was_rounded) {
            put(list, found);
        }
    }
    // Exact times may show a rate that rounded ones did not.
    let again = || of(&RateSource::Times(lists, Precision::F64)).and_then(FrameGrid::rate);
    let common = common?;
    common.rate().or_else(again)
}

/// Moves times to frames. Different times stay different: if two belong to the same frame, as an exporter writes a
/// cut, the nearer one is moved to it, and the other keeps its distance from it.
fn put(list: &mut [f64], found: FrameGrid) {
    let on_frame = |time: f64| frame_time(found.grid, found.phase, time);
    let stored = list.to_vec();
    let off = |i: usize| (stored[i] - on_frame(stored[i])).abs();
    for (i, time) in list.iter_mut().enumerate() {
        let exact = on_frame(stored[i]);
        let beside = |other: usize| {
            let is_other = stored.get(other).is_some_and(|&other| other != stored[i]);
            is_other && on_frame(stored[other]) == exact && off(other) < off(i)
        };
        let neighbours = [i.wrapping_sub(1), i + 1];
        let nearer = neighbours.into_iter().find(|&other| beside(other));
        *time = nearer.map_or(exact, |other| exact + (stored[i] - stored[other]));
    }
    if !list.is_sorted() || same(list) != same(&stored) {
        list.copy_from_slice(&stored);
    }
}

/// For each time but the first, whether it equals the one before.
fn same(list: &[f64]) -> Vec<bool> {
    list.windows(2).map(|pair| pair[0] == pair[1]).collect()
}

impl Motion {
    /// The rate of the keys: all key times are frames of it, and some are neighbouring frames. `None` if there is no
    /// such rate.
    #[must_use]
    pub fn rate_of_keys(&self) -> Option<FrameRate> {
        let mut all: Vec<Vec<f64>> = Vec::new();
        for list in self.key_lists() {
            // Most tracks have the same times as the track before.
            if all.last().is_none_or(|last| last != list) {
                all.push(list.to_vec());
            }
        }
        of(&RateSource::Times(&all, Precision::F64))?.rate()
    }
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
        // After a day, the steps of f32 are 7.8 ms, too large to determine a rate.
        let late = vec![vec![86_400.0, 86_400.039]];
        assert_eq!(restore(&mut late.clone(), Precision::F32), None);
        assert_eq!(restore(&mut [vec![0.0]], Precision::F64), None);
    }

    #[test]
    fn times_before_zero_are_frames_too() {
        let mut lists = vec![rounded([1, 0, 10, 11].into_iter(), 30.0)];
        lists[0][0] = -lists[0][0];
        assert_eq!(
            restore(&mut lists, Precision::F32),
            FrameRate::new(30, 1).ok()
        );
        assert_eq!(lists[0], [-1.0 / 30.0, 0.0, 10.0 / 30.0, 11.0 / 30.0]);
    }

    /// Two keys one step of f32 apart are a cut: rounding must not make one time of them.
    #[test]
    fn a_cut_of_one_step_stays_a_cut() {
        let mut times = rounded(0..=30, 30.0);
        let cut = times[17];
        times.insert(17, f64::from((cut as f32).next_down()));
        let mut lists = vec![times];
        assert_eq!(
            restore(&mut lists, Precision::F32),
            FrameRate::new(30, 1).ok()
        );
        let list = &lists[0];
        assert_eq!(
            (list[16], list[18], list[31]),
            (16.0 / 30.0, 17.0 / 30.0, 1.0)
        );
        assert!(
            list[16] < list[17] && list[17] < list[18],
            "{:?}",
            &list[16..19]
        );
        assert!((list[18] - list[17] - f64::from(f32::EPSILON) / 2.0).abs() < 1e-12);
    }
}
