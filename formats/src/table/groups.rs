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
    /// There are fewer rows than this.
    const NONE: u32 = u32::MAX;
    let mut small: Vec<u32> = Vec::new();
    let mut large: HashMap<T, u32> = HashMap::new();
    let mut own = Vec::new();
    let codes = values.map(|value| {
        let place = place(value);
        if let Some(&code) = small.get(place)
            && code != NONE
        {
            return code;
        }
        let next = own.len() as u32;
        let code = if place < SMALL {
            if place >= small.len() {
                small.resize(place + 1, NONE);
            }
            small[place] = next;
            next
        } else {
            *large.entry(value).or_insert(next)
        };
        if code == next {
            own.push(value);
        }
        code
    });
    (codes.collect(), own)
}

/// The places of a list's entries sorted by code, those of equal ones in their order, and the range
/// of each code among them.
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
    let mut order = vec![0; codes.len()];
    for (place, &code) in (0..).zip(codes) {
        let next = &mut next[code as usize];
        order[*next] = place;
        *next += 1;
    }
    (order, ranges)
}
