//! How the lab decides: functions of measured times, in microseconds, which a test calls with made-up ones. They were
//! written before a card was measured, so that results cannot influence the choice of the rules.

/// A time counts as shorter than another only if it is shorter by this share plus the spread of two measurements.
const MARGIN: f64 = 0.02;

/// Stores side by side count as near the rate of filling below the first ratio. Stores of eight lanes at a distance
/// count as slower from the second ratio on. On an H200, which fills 79 MB in 18.7 µs, these are 20.5 µs and 23 µs.
const NEAR_FILL: f64 = 20.5 / 18.7;
const ABOVE_FILL: f64 = 23.0 / 18.7;

/// The gain from which stores past the caches are chosen.
const GAIN_OF_STREAMING: f64 = 1.1;

/// Barriers between kernels only are chosen if they save at least this many microseconds.
const SAVED_BY_SCOPES: f64 = 2.0;

/// A time in microseconds that was measured twice.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Timed {
    /// The shorter and the longer time.
    pub microseconds: [f64; 2],
}

impl Timed {
    pub(super) fn new(one: f64, other: f64) -> Self {
        Self {
            microseconds: [one.min(other), one.max(other)],
        }
    }

    /// The shorter time.
    #[must_use]
    pub fn best(&self) -> f64 {
        self.microseconds[0]
    }

    /// The difference of two measurements, as a share of the shorter.
    fn spread(&self) -> f64 {
        let [shorter, longer] = self.microseconds;
        (longer - shorter) / shorter.max(f64::MIN_POSITIVE)
    }

    /// Whether it is shorter than another time by more than the margin and what either was measured to vary.
    pub(super) fn beats(&self, other: &Self) -> bool {
        let spread = self.spread().max(other.spread());
        self.best() < other.best() * (1.0 - MARGIN - spread)
    }
}

/// The index of the shortest of some times; the first of them, today's, unless another beats it. Of those that do not
/// beat the shortest, and beat the first, the one with the fewest pipelines that are not there today is taken.
pub(super) fn winner(candidates: &[(Timed, usize)]) -> usize {
    let Some((today, _)) = candidates.first() else {
        return 0;
    };
    let best = |(_, one): &(usize, &(Timed, usize)), (_, other): &(usize, &(Timed, usize))| {
        one.0.best().total_cmp(&other.0.best())
    };
    let better = || {
        let all = candidates.iter().enumerate();
        all.filter(|(_, (timed, _))| timed.beats(today))
    };
    let Some((_, (shortest, _))) = better().min_by(best) else {
        return 0;
    };
    let alike = better().filter(|(_, (timed, _))| !shortest.beats(timed));
    let fewest = alike.min_by(|one, other| (one.1.1.cmp(&other.1.1)).then(best(one, other)));
    fewest.map_or(0, |(index, _)| index)
}

/// Whether long runs get 32 lanes instead of eight, by the times of filling, of stores side by side, and of stores of
/// eight lanes at a distance.
pub(super) fn needs_wide_runs(fill: f64, linear: f64, strided: f64) -> bool {
    linear < NEAR_FILL * fill && strided >= ABOVE_FILL * fill
}

/// Whether results go past the caches, by the times of kernels that keep them there and of those that do not.
pub(super) fn streams(cached: f64, streamed: f64) -> bool {
    cached >= GAIN_OF_STREAMING * streamed
}

/// Whether applications should name the users of results: compares the time of a barrier for all commands with that of
/// a barrier for kernels.
pub(super) fn needs_scopes(for_all: f64, for_kernels: f64) -> bool {
    for_all - for_kernels >= SAVED_BY_SCOPES
}

/// Times candidates in rounds of one row, two, four …; after each round the slower half goes, but never the first.
/// Returns the last `kept` of them, the first among them. `time` is the time of a candidate in so many rows.
pub(super) fn halve<E>(
    count: usize,
    kept: usize,
    time: &mut dyn FnMut(usize, u32) -> Result<f64, E>,
) -> Result<Vec<usize>, E> {
    let mut left: Vec<usize> = (0..count).collect();
    let mut rows = 1;
    while left.len() > kept.max(1) {
        let mut times = Vec::new();
        for &candidate in &left {
            times.push((time(candidate, rows)?, candidate));
        }
        times.sort_by(|one, other| one.0.total_cmp(&other.0));
        times.truncate((left.len() / 2).max(kept.max(1)));
        let mut next: Vec<usize> = times.iter().map(|&(_, candidate)| candidate).collect();
        if !next.contains(&0) {
            next.pop();
            next.push(0);
        }
        next.sort_unstable();
        left = next;
        rows *= 2;
    }
    Ok(left)
}

/// The number of lanes for runs of a class: of each number the mean over kernels of the time as a share of today's, and
/// what these shares vary. Today's is the first.
pub(super) fn lanes(shares: &[(u32, Timed)]) -> u32 {
    let candidates: Vec<(Timed, usize)> = shares.iter().map(|&(_, share)| (share, 0)).collect();
    shares
        .get(winner(&candidates))
        .map_or(8, |(lanes, _)| *lanes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(times: &[[f64; 2]]) -> Vec<(Timed, usize)> {
        let each = |&[one, other]: &[f64; 2]| (Timed::new(one, other), 0);
        times.iter().map(each).collect()
    }

    /// Two hundredths beyond the spread: 24 µs are beaten by 23.5 of no spread, and not by 23.0 that vary by a µs.
    #[test]
    fn a_winner_needs_more_than_measurements_vary() {
        assert_eq!(winner(&timed(&[[24.0, 24.0], [23.6, 23.6]])), 0);
        assert_eq!(winner(&timed(&[[24.0, 24.0], [23.5, 23.5]])), 1);
        assert_eq!(winner(&timed(&[[24.0, 24.0], [24.0, 23.0]])), 0);
        assert_eq!(winner(&timed(&[[25.0, 24.0], [23.5, 23.5]])), 0);
        assert_eq!(
            winner(&timed(&[[24.0, 24.0], [22.0, 22.1], [21.0, 21.1]])),
            2
        );
        assert_eq!(winner(&[]), 0);
    }

    #[test]
    fn of_equal_times_the_fewest_pipelines_win() {
        let mut all = timed(&[[24.0, 24.0], [20.0, 20.0], [20.2, 20.2], [21.0, 21.0]]);
        (all[1].1, all[2].1, all[3].1) = (2, 1, 0);
        assert_eq!(winner(&all), 2);
        all[2].1 = 2;
        assert_eq!(winner(&all), 1);
    }

    /// The figures of the H200.
    #[test]
    fn wide_runs_streaming_and_scopes_follow_from_ceilings() {
        assert!(needs_wide_runs(18.7, 20.4, 23.1));
        assert!(!needs_wide_runs(18.7, 20.6, 23.1));
        assert!(!needs_wide_runs(18.7, 20.4, 22.9));
        assert!(streams(24.8, 22.5) && !streams(24.7, 22.5));
        assert!(needs_scopes(9.0, 7.0) && !needs_scopes(8.9, 7.0));
    }

    /// Sixteen candidates need 16 rows, 8 times 2, 4 times 4: the fastest is found, and the first stays.
    #[test]
    fn halving_keeps_the_fastest_and_the_first() {
        let mut rows_of = [0; 16];
        let left = halve(16, 2, &mut |candidate, rows| {
            rows_of[candidate] += rows;
            Ok::<_, ()>(if candidate == 11 {
                5.0
            } else {
                20.0 - 0.1 * candidate as f64
            })
        });
        assert_eq!(left, Ok(vec![0, 11]));
        assert_eq!(rows_of[0], 7);
        assert_eq!(rows_of.iter().sum::<u32>(), 16 + 8 * 2 + 4 * 4);
        assert_eq!(halve(1, 2, &mut |_, _| Ok::<_, ()>(1.0)), Ok(vec![0]));
        assert_eq!(halve(4, 2, &mut |_, _| Err("lost")), Err("lost"));
    }

    #[test]
    fn lanes_of_a_class_are_todays_unless_others_beat_them() {
        let share = |value| Timed::new(value, value);
        let all = [
            (8, share(1.0)),
            (4, share(1.1)),
            (16, share(0.99)),
            (32, share(0.985)),
        ];
        assert_eq!(lanes(&all), 8);
        let all = [
            (8, share(1.0)),
            (4, share(1.1)),
            (16, share(0.9)),
            (32, share(0.95)),
        ];
        assert_eq!(lanes(&all), 16);
    }
}
