//! Statistics of differences: the largest, its index, the mean and the root mean square.

use serde::Serialize;

/// The statistics of the added differences.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    count: u64,
    sum: f64,
    squares: f64,
    largest: f64,
    /// Index of the largest difference, in the order in which they were added.
    pub(super) largest_at: u64,
}

/// Mean, root mean square and maximum of many differences.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Maximum.
    pub largest: f64,
}

impl Tally {
    /// Adds one difference, 0 or more. NaN counts as infinity.
    pub(super) fn add(&mut self, difference: f64) {
        let difference = match difference.is_nan() {
            true => f64::INFINITY,
            false => difference,
        };
        if difference > self.largest {
            self.largest = difference;
            self.largest_at = self.count;
        }
        self.count += 1;
        self.sum += difference;
        self.squares += difference * difference;
    }

    /// The statistics with each difference multiplied by `factor`, for example to convert radians to degrees.
    pub(super) fn times(self, factor: f64) -> Spread {
        let count = self.count.max(1) as f64;
        Spread {
            mean: self.sum / count * factor,
            rms: (self.squares / count).sqrt() * factor,
            largest: self.largest * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_the_largest_is_named() {
        let mut tally = Tally::default();
        for value in [1.0, 3.0, 0.0, 3.0, 1.0] {
            tally.add(value);
        }
        let spread = tally.times(10.0);
        assert_eq!(
            (spread.mean, spread.largest, spread.rms, tally.largest_at),
            (16.0, 30.0, 20.0, 1)
        );
        tally.add(f64::NAN);
        assert_eq!(
            (tally.times(1.0).largest, tally.largest_at),
            (f64::INFINITY, 5)
        );
        assert_eq!(Tally::default().times(1.0).mean, 0.0);
    }
}
