//! Groups rows by the values of a column.

use std::collections::HashMap;
use std::hash::Hash;
use std::ops::Range;

use crate::table::columns::{ColumnNumbers, ColumnValues, Table};

/// The distinct values of a column in the order of their first rows, and the index of the value of each row.
pub(crate) fn labels(table: &Table, column: usize) -> (Vec<u32>, Vec<String>) {
    match &table.columns[column].values {
        ColumnValues::Words { codes, words } => {
            let (codes, distinct) = numbered(codes.iter().copied(), |code| code as usize);
            let names = distinct.iter().map(|&code| words[code as usize].clone());
            (codes, names.collect())
        }
        ColumnValues::Numbers(ColumnNumbers::Whole(numbers)) => {
            let slot = |number| usize::try_from(number).unwrap_or(usize::MAX);
            let (codes, distinct) = numbered(numbers.iter().copied(), slot);
            (codes, distinct.iter().map(i64::to_string).collect())
        }
        // The plan allows only columns of names here; any other column counts as a single name.
        _ => (
            vec![0; table.rows],
            vec![table.columns[column].name.clone()],
        ),
    }
}

/// Assigns indices to distinct values in the order in which they occur. Values with a small slot are found in a list,
/// which is faster than a map.
pub(crate) fn numbered<T: Copy + Eq + Hash>(
    values: impl Iterator<Item = T>,
    slot_of: impl Fn(T) -> usize,
) -> (Vec<u32>, Vec<T>) {
    const SMALL: usize = 1 << 16;
    /// No value has this index, because there are fewer rows.
    const NONE: u32 = u32::MAX;
    let mut small: Vec<u32> = Vec::new();
    let mut large: HashMap<T, u32> = HashMap::new();
    let mut distinct = Vec::new();
    let codes = values.map(|value| {
        let slot = slot_of(value);
        if let Some(&code) = small.get(slot)
            && code != NONE
        {
            return code;
        }
        let next = distinct.len() as u32;
        let code = if slot < SMALL {
            if slot >= small.len() {
                small.resize(slot + 1, NONE);
            }
            small[slot] = next;
            next
        } else {
            *large.entry(value).or_insert(next)
        };
        if code == next {
            distinct.push(value);
        }
        code
    });
    (codes.collect(), distinct)
}

/// The indices of a list's entries sorted by code, with those of equal codes in their order, and the range of each
/// code.
pub(crate) fn rows_by_code(codes: &[u32], count: usize) -> (Vec<u32>, Vec<Range<usize>>) {
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
    for (row, &code) in (0..).zip(codes) {
        let next = &mut next[code as usize];
        order[*next] = row;
        *next += 1;
    }
    (order, ranges)
}
