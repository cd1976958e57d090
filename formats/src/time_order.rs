//! Whether rows whose times go back may be sorted.
//!
//! Rows arrive late, writers take turns, and tables are sorted by something else: sorting by time then restores one
//! recording. A clock that was set back is another matter. The rows before and after it are of two recordings at the
//! same times, and sorting would mix them.

/// The order of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TimeOrder {
    /// No time is before the previous one.
    Sorted,
    /// Times go back, first in this row, and sorting them makes one recording.
    Unsorted {
        /// The first row whose time is before the previous one.
        row: usize,
    },
    /// The clock was set back in this row: long runs of rows before and after it are at the same times.
    Reset {
        /// The first row after the clock was set back.
        row: usize,
    },
}

/// The mean length of ascending runs of rows from which on the order is taken for that of a clock. In a random order it
/// is two.
const LEAST_RUN: usize = 3;

/// The least number of rows of each of two runs whose times lie between times of the other run. A single late row does
/// not count as a run.
const LEAST_MIXED: usize = 2;

/// Finds the order of times, without NaN.
pub(crate) fn time_order<T: PartialOrd + Copy>(times: &[T]) -> TimeOrder {
    let is_back = |row: &usize| times[*row] < times[*row - 1];
    let backs: Vec<usize> = (1..times.len()).filter(is_back).collect();
    let Some(&first) = backs.first() else {
        return TimeOrder::Sorted;
    };
    let unsorted = TimeOrder::Unsorted { row: first };
    if times.len() < LEAST_RUN * (backs.len() + 1) {
        return unsorted;
    }
    let ends = backs.iter().skip(1).copied().chain([times.len()]);
    let mut start = 0;
    for (&row, end) in backs.iter().zip(ends) {
        if are_mixed(&times[start..row], &times[row..end]) {
            return TimeOrder::Reset { row };
        }
        start = row;
    }
    unsorted
}

/// Whether sorting would put the rows of two ascending runs between each other.
fn are_mixed<T: PartialOrd + Copy>(before: &[T], after: &[T]) -> bool {
    let (Some(&last), Some(&first)) = (before.last(), after.first()) else {
        return false;
    };
    let late = &before[before.partition_point(|time| *time < first)..];
    let early = &after[..after.partition_point(|time| *time <= last)];
    if late.len().min(early.len()) < LEAST_MIXED {
        return false;
    }
    // If a block of rows is late as a whole, it fits into one gap between the others.
    let gap = |time: &T| late.partition_point(|other| other < time);
    early.first().map(gap) != early.last().map(gap)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_rows_are_sorted_and_a_clock_set_back_is_told() {
        let unsorted = |row| TimeOrder::Unsorted { row };
        let reset = |row| TimeOrder::Reset { row };
        let cases: [(&[i32], TimeOrder); 12] = [
            (&[], TimeOrder::Sorted),
            (&[1, 1, 2], TimeOrder::Sorted),
            (&[1, 0], unsorted(1)),
            (&[5, 4, 3, 2, 1, 0], unsorted(1)),
            // One late row, then two late rows in sequence, then a late block.
            (&[0, 1, 3, 2, 4, 5], unsorted(3)),
            (&[0, 1, 2, 5, 6, 3, 4, 7, 8], unsorted(5)),
            (&[0, 1, 2, 6, 7, 8, 3, 4, 5, 9], unsorted(6)),
            // Two files in the wrong order.
            (&[10, 11, 12, 13, 0, 1, 2, 3], unsorted(4)),
            // Rows in a random order.
            (&[3, 9, 1, 4, 0, 8, 2, 7, 5, 6], unsorted(2)),
            // A clock that was set back: from the start, from the middle, and with equal times.
            (&[0, 2, 4, 6, 1, 3, 5, 7], reset(4)),
            (&[0, 10, 20, 30, 40, 25, 35, 45], reset(5)),
            (&[0, 1, 2, 3, 0, 1, 2, 3], reset(4)),
        ];
        for (times, expected) in cases {
            assert_eq!(time_order(times), expected, "{times:?}");
        }
    }
}
