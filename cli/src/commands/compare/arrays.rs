//! Two arrays of results, number by number.

use std::path::Path;

use glam::DQuat;
use serde::Serialize;
use tumble::reference::angle_between;
use tumble_formats::npz::{Numbers, open_numbers};
use tumble_formats::{Diagnostic, ReadOptions};

use crate::arguments::input::name;
use crate::commands::compare::tally::{Spread, Tally};
use crate::messages::exit::{ALL_INPUTS, Failure};

/// How far the norm of what counts as a rotation may be from 1: results in 16 bits are still rotations.
const UNIT: f64 = 1e-2;

/// What two arrays come to.
#[derive(Debug, Serialize)]
pub(crate) struct Compared {
    shape: Vec<usize>,
    /// Of all numbers.
    numbers: usize,
    /// Numbers that differ.
    pub(crate) differing: usize,
    /// The difference of numbers.
    pub(crate) difference: Spread,
    /// The place of the largest in the array.
    pub(crate) largest_at: Vec<usize>,
    /// Angles in degrees, where four numbers each are a rotation.
    pub(crate) rotation: Option<Spread>,
    /// The rotation of the largest angle.
    pub(crate) largest_rotation_at: Option<Vec<usize>>,
}

/// Compares the arrays of two NPY files.
pub(crate) fn compare(paths: [&Path; 2], options: &ReadOptions) -> Result<Compared, Failure> {
    let read =
        |path| open_numbers(path, options).map_err(|error: Diagnostic| Failure::input(&error, ""));
    let (first, second) = (read(paths[0])?, read(paths[1])?);
    if first.shape != second.shape {
        let [a, b] = paths.map(name);
        return Err(Failure::new(
            ALL_INPUTS,
            format!(
                "{a} has the shape {:?} and {b} has {:?}; arrays of one shape can be compared",
                first.shape, second.shape
            ),
        ));
    }
    Ok(Compared::of(&first, &second))
}

impl Compared {
    fn of(first: &Numbers, second: &Numbers) -> Self {
        let mut difference = Tally::default();
        let mut differing = 0;
        for (&a, &b) in first.values.iter().zip(&second.values) {
            let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            differing += usize::from(!same);
            difference.add(if same { 0.0 } else { (a - b).abs() });
        }
        let turns = rotations(first).zip(rotations(second)).map(|(a, b)| {
            let mut tally = Tally::default();
            a.zip(b).for_each(|(a, b)| tally.add(angle_between(a, b)));
            tally
        });
        let rows = &first.shape[..first.shape.len().saturating_sub(1)];
        Self {
            shape: first.shape.clone(),
            numbers: first.values.len(),
            differing,
            difference: difference.times(1.0),
            largest_at: place(difference.place, &first.shape),
            rotation: turns.map(|tally| tally.times(1f64.to_degrees())),
            largest_rotation_at: turns.map(|tally| place(tally.place, rows)),
        }
    }

    /// Lines that say it.
    pub(crate) fn told(&self) -> String {
        let mut text = format!(
            "array of shape {:?}: {} of {} numbers differ\n  difference   mean {:.3e}, rms {:.3e}, \
             largest {:.3e} at {:?}\n",
            self.shape,
            self.differing,
            self.numbers,
            self.difference.mean,
            self.difference.rms,
            self.difference.largest,
            self.largest_at
        );
        if let (Some(turn), Some(at)) = (&self.rotation, &self.largest_rotation_at) {
            text += &format!(
                "  angle        mean {:.3e}°, rms {:.3e}°, largest {:.3e}° at {at:?}\n",
                turn.mean, turn.rms, turn.largest
            );
        }
        text
    }
}

/// The rotations that an array holds, if it holds nothing else: four numbers each, of norm 1. The order
/// of their components does not matter to the angle between two.
fn rotations(array: &Numbers) -> Option<impl Iterator<Item = DQuat> + '_> {
    let rows = || {
        let rows = array.values.chunks_exact(4);
        rows.filter_map(|row| Some(DQuat::from_array(row.try_into().ok()?)))
    };
    let is_unit = |q: DQuat| (q.length() - 1.0).abs() <= UNIT;
    let whole = array.shape.last() == Some(&4) && !array.values.is_empty();
    (whole && rows().all(is_unit)).then(rows)
}

/// The indices of the number that lies at a place of an array whose last axis is the fastest.
fn place(mut index: u64, shape: &[usize]) -> Vec<usize> {
    let mut found: Vec<usize> = shape
        .iter()
        .rev()
        .map(|&length| {
            let length = length.max(1) as u64;
            let own = (index % length) as usize;
            index /= length;
            own
        })
        .collect();
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(shape: &[usize], values: &[f64]) -> Numbers {
        Numbers {
            shape: shape.to_vec(),
            values: values.to_vec(),
        }
    }

    #[test]
    fn the_largest_difference_has_its_place() {
        let first = numbers(&[2, 3], &[0.0, 1.0, 2.0, 3.0, f64::NAN, 5.0]);
        let second = numbers(&[2, 3], &[0.0, 1.0, 2.5, 3.0, f64::NAN, 4.0]);
        let found = Compared::of(&first, &second);
        assert_eq!((found.differing, found.difference.largest), (2, 1.0));
        assert_eq!(
            (found.largest_at, found.rotation.is_none()),
            (vec![1, 2], true)
        );
    }

    #[test]
    fn four_numbers_of_norm_one_are_rotations() {
        let half = 0.5f64.sqrt();
        let first = numbers(&[1, 2, 4], &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let second = numbers(&[1, 2, 4], &[0.0, 0.0, 0.0, -1.0, half, half, 0.0, 0.0]);
        let found = Compared::of(&first, &second);
        let turn = found.rotation.unwrap();
        assert!((turn.largest - 90.0).abs() < 1e-12 && (turn.mean - 45.0).abs() < 1e-12);
        assert_eq!(found.largest_rotation_at, Some(vec![0, 1]));
    }
}
