//! Restores times that a file rounded to the frames from which they were rounded.
//!
//! glTF stores times in f32, and text has few decimals. A key at frame 17 of 24 fps is then at 0.70833331 s, and
//! sampling at 120 fps would miss it, and the end, by 2e-9 s.

use tumble::FrameRate;

use crate::motion::Motion;
use crate::rate::{FrameGrid, Precision, RateSource, frame_time, of, of_sums, on_frames};

/// Moves the lists of times of one clip to the frames of the rate that fits all of them. If there is none, each list
/// is moved to the frames of the rate that fits it, or stays unchanged. Returns the common rate of the keys, if there
/// is one; the end of a clip may lie between two frames of it ([`frames_before_end`]).
pub(crate) fn restore(lists: &mut [Vec<f64>], precision: Precision) -> Option<FrameRate> {
    let common = of(&RateSource::Times(lists, precision));
    let before_end = frames_before_end(lists, precision);
    for list in &mut *lists {
        if let (None, Some(found)) = (common, before_end) {
            let count = count_on_frames(list, found);
            put(&mut list[..count], found);
            continue;
        }
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
    if let Some(found) = before_end {
        return found.rate();
    }
    // Exact times may show a rate that rounded ones did not.
    let again = || of(&RateSource::Times(lists, Precision::F64)).and_then(FrameGrid::rate);
    let rate = common.and_then(|common| common.rate().or_else(again));
    // If each time is a sum of rounded frame times, the times keep their values, and only the rate is returned.
    rate.or_else(|| of_sums(lists).filter(|_| precision == Precision::F32))
}

/// At least this many keys on successive frames are needed to conclude that only the key at the end is between two
/// frames.
const FRAMES_IN_A_ROW: usize = 8;

/// The frames of clips that end between two of them: a clip of 1.158 s that was evaluated at 60 frames a second has a
/// key on every frame and one at its end. One of the lists has a key on each of its frames, the others have theirs on
/// some. `None` if the end is on a frame too, or if there are no such frames.
pub(crate) fn frames_before_end(lists: &[Vec<f64>], precision: Precision) -> Option<FrameGrid> {
    let ends = lists.iter().filter_map(|list| list.last().copied());
    let end = ends.fold(f64::NEG_INFINITY, f64::max);
    let before_end = |list: &[f64]| match list.last() {
        Some(&last) if last == end => list.len() - 1,
        _ => list.len(),
    };
    let longest = lists.iter().max_by_key(|list| before_end(list))?;
    let longest = &longest[..before_end(longest)];
    let (&first, &last) = (longest.first()?, longest.last()?);
    // Most clips return here, because their last two keys are as far apart as the others.
    let mean = (last - first) / (longest.len() - 1) as f64;
    let is_short = (0.0..0.999 * mean).contains(&(end - last));
    if longest.len() < FRAMES_IN_A_ROW || !is_short || end == last {
        return None;
    }
    let frames = lists.iter().map(|list| list[..before_end(list)].to_vec());
    let frames: Vec<Vec<f64>> = frames.collect();
    let found = of(&RateSource::Times(&frames, precision)).filter(|found| found.is_rate)?;
    let count = ((last - first) * found.grid.per_second()).round() as usize + 1;
    let is_between = !on_frames(std::iter::once(end), found.grid, found.phase, precision);
    (count == longest.len() && is_between).then_some(found)
}

/// How many times of a list are on frames: all, or all but that of the clip's end.
fn count_on_frames(list: &[f64], frames: FrameGrid) -> usize {
    let is_between = |time: f64| {
        let off = (time - frame_time(frames.grid, frames.phase, time)).abs();
        off * frames.grid.per_second() > 1e-3
    };
    let ends_between = list.last().is_some_and(|&last| is_between(last));
    list.len() - usize::from(ends_between)
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
        let before_end = frames_before_end(&all, Precision::F64);
        before_end
            .or_else(|| of(&RateSource::Times(&all, Precision::F64)))?
            .rate()
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

    #[test]
    fn a_clip_may_end_between_two_frames() {
        for (rate, frames, end) in [(60u32, 70, 139.0 / 120.0), (30, 30, 0.98), (25, 9, 0.3501)] {
            let mut times = rounded(0..frames, f64::from(rate));
            times.push(f64::from(end as f32));
            let mut lists = vec![times, rounded([0, 3].into_iter(), f64::from(rate))];
            let found = restore(&mut lists, Precision::F32);
            assert_eq!(found, FrameRate::new(u64::from(rate), 1).ok(), "{rate}");
            assert_eq!(lists[0][7], 7.0 / f64::from(rate));
            assert_eq!(lists[1][1], 3.0 / f64::from(rate));
            assert!((lists[0].last().unwrap() - end).abs() < 1e-7);
        }
        // Four even keys are too few for a rate of their own. So the shorter last step determines the rate.
        let mut lists = vec![vec![0.0, 1.0, 2.0, 3.0, 3.5]];
        assert_eq!(
            restore(&mut lists, Precision::F64),
            FrameRate::new(2, 1).ok()
        );
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
