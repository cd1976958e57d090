//! Rows shared out to what a column names.

use std::collections::HashMap;
use std::hash::Hash;
use std::ops::Range;

use crate::table::columns::{Numbers, Table, Values};

/// The distinct values of a column in the order in which they come up, and which each row has.
pub(crate) fn labels(table: &Table, column: usize) -> (Vec<u32>, Vec<String>) {
    match &table.columns[column].values {
        Values::Words { codes, words } => {
            let (codes, own) = numbered(codes.iter().copied(), |code| code as usize);
            let names = own.iter().map(|&code| words[code as usize].clone());
            (codes, names.collect())
        }
        Values::Numbers(Numbers::Whole(numbers)) => {
            let place = |number| usize::try_from(number).unwrap_or(usize::MAX);
            let (codes, own) = numbered(numbers.iter().copied(), place);
            (codes, own.iter().map(i64::to_string).collect())
        }
        // The plan asked for names.
        _ => (
            vec![0; table.rows],
            vec![table.columns[column].name.clone()],
        ),
    }
}

/// Numbers the distinct values in the order in which they come up. Those whose `place` is small are
/// found in a list, which is quicker than a map.
pub(crate) fn numbered<T: Copy + Eq + Hash>(
    values: impl Iterator<Item = T>,
    place: impl Fn(T) -> usize,
) -> (Vec<u32>, Vec<T>) {
    const SMALL: usize = 1 << 16;
    let mut small: Vec<Option<u32>> = Vec::new();
    let mut large: HashMap<T, u32> = HashMap::new();
    let mut own = Vec::new();
    let codes = values.map(|value| {
        let mut next = || {
            own.push(value);
            own.len() as u32 - 1
        };
        match place(value) {
            place if place < SMALL => {
                if place >= small.len() {
                    small.resize(place + 1, None);
                }
                *small[place].get_or_insert_with(next)
            }
            _ => *large.entry(value).or_insert_with(&mut next),
        }
    });
    (codes.collect(), own)
}

/// Sorts by code, keeping the order of equal ones: where each entry goes, and the range of each
/// code.
pub(crate) fn share_out(codes: &[u32], count: usize) -> (Vec<u32>, Vec<Range<usize>>) {
    let mut next = vec![0usize; count];
    for &code in codes {
        next[code as usize] += 1;
    }
    let mut start = 0;
    let ranges: Vec<Range<usize>> = next
        .iter_mut()
        .map(|next| {
            let range = start..start + *next;
            (*next, start) = (range.start, range.end);
            range
        })
        .collect();
    let order = codes.iter().map(|&code| {
        let place = next[code as usize];
        next[code as usize] += 1;
        place as u32
    });
    (order.collect(), ranges)
}

/// Puts each value where `order` says.
pub(crate) fn scatter<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    let Some(&first) = values.first() else {
        return Vec::new();
    };
    let mut sorted = vec![first; values.len()];
    for (&value, &place) in values.iter().zip(order) {
        sorted[place as usize] = value;
    }
    sorted
}
