//! The comparison of two results, which does not rely on the engine's.

/// The differing values of two results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Differences {
    /// The number of values whose bits differ; values that only one result has are among them.
    pub(crate) count: u64,
    /// The index of the first such value.
    pub(crate) first: Option<usize>,
}

impl Differences {
    /// The differences of two results of values of `size` bytes each.
    pub(crate) fn of(found: &[u8], expected: &[u8], size: usize) -> Self {
        let values = found.chunks(size).zip(expected.chunks(size));
        let mut differing = (0..).zip(values).filter(|(_, (a, b))| a != b);
        let first = differing.next().map(|(index, _)| index);
        let mut differences = Self {
            count: u64::from(first.is_some()) + differing.count() as u64,
            first,
        };
        if found.len() != expected.len() {
            let shorter = found.len().min(expected.len()) / size;
            differences.count += found.len().abs_diff(expected.len()).div_ceil(size) as u64;
            differences.first = differences.first.or(Some(shorter));
        }
        differences
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A comparison that cannot fail proves nothing.
    #[test]
    fn a_bit_that_differs_is_found_and_a_result_that_is_too_short() {
        let expected = [7u8; 64];
        let mut found = expected;
        found[33] ^= 1;
        let one = |count, index| Differences {
            count,
            first: Some(index),
        };
        assert_eq!(Differences::of(&found, &expected, 16), one(1, 2));
        assert_eq!(Differences::of(&expected[..48], &expected, 16), one(1, 3));
        let none = Differences {
            count: 0,
            first: None,
        };
        assert_eq!(Differences::of(&expected, &expected, 16), none);
    }
}
