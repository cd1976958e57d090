//! `--shard`: which shards of a plan a process evaluates.

use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::messages::exit::Failure;
use crate::messages::words;

/// Which shards of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ShardSelection {
    /// That one.
    One(usize),
    /// The shards of one process of several, both from 1.
    Of(usize, usize),
}

impl FromStr for ShardSelection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let number = |text: &str| text.parse().ok().filter(|&number: &usize| number > 0);
        let part = match text.split_once('/') {
            None => number(text).map(Self::One),
            Some((index, all)) => (number(index).zip(number(all)))
                .filter(|(index, all)| index <= all)
                .map(|(index, all)| Self::Of(index, all)),
        };
        part.ok_or_else(|| "give I/N, from 1/N to N/N, or the number of a shard, from 1".to_owned())
    }
}

impl ShardSelection {
    /// The numbers of its shards, from 1. Parts differ by one shard at most.
    pub(super) fn shards(self, all: usize) -> Result<RangeInclusive<usize>, Failure> {
        let share = |part: usize, of: usize| (all as u128 * part as u128 / of as u128) as usize;
        match self {
            Self::One(one) if one > all => {
                let all = words::count(all, "shard");
                let message = format!("--shard {one}: there are {all}");
                Err(Failure::usage(message))
            }
            Self::One(one) => Ok(one..=one),
            Self::Of(index, of) => Ok(share(index - 1, of) + 1..=share(index, of)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_every_shard_once() {
        for (all, of) in [(0, 3), (1, 64), (79, 64), (79, 2), (3, 3)] {
            let parts =
                (1..=of).flat_map(|index| ShardSelection::Of(index, of).shards(all).unwrap());
            assert!(parts.eq(1..=all), "{all} in {of}");
        }
        assert!(ShardSelection::One(4).shards(3).is_err());
    }

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!("3/64".parse(), Ok(ShardSelection::Of(3, 64)));
        assert_eq!("17".parse(), Ok(ShardSelection::One(17)));
        for text in ["0", "0/4", "5/4", "1/0", "-1/4", "1/", "/", "", "1.5"] {
            assert!(text.parse::<ShardSelection>().is_err(), "{text}");
        }
    }
}
