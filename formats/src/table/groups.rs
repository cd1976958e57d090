//! Rows shared out to what a column names.

use std::collections::HashMap;
use std::ops::Range;

use crate::table::columns::{Numbers, Table, Values};

/// The distinct values of a column in the order in which they come up, and which each row has.
pub(crate) fn labels(table: &Table, column: usize) -> (Vec<u32>, Vec<String>) {
    match &table.columns[column].values {
        Values::Words { codes, words } => {
            let mut place: Vec<Option<u32>> = vec![None; words.len()];
            let mut names = Vec::new();
            let codes = codes.iter().map(|&code| {
                *place[code as usize].get_or_insert_with(|| {
                    names.push(words[code as usize].clone());
                    names.len() as u32 - 1
                })
            });
            (codes.collect(), names)
        }
        Values::Numbers(Numbers::Whole(numbers)) => {
            let mut place = HashMap::new();
            let mut names = Vec::new();
            let codes = numbers.iter().map(|&number| {
                *place.entry(number).or_insert_with(|| {
                    names.push(number.to_string());
                    names.len() as u32 - 1
                })
            });
            (codes.collect(), names)
        }
        // The plan asked for names.
        _ => (
            vec![0; table.rows],
            vec![table.columns[column].name.clone()],
        ),
    }
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
