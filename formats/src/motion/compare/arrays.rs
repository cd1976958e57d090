//! Compares two arrays of results, number by number.

use glam::DQuat;
use serde::Serialize;
use tumble::reference::angle_between;

use crate::array::NumberArray;
use crate::motion::compare::CompareError;
use crate::motion::compare::tally::{Spread, Tally};

/// Largest difference from 1 of the norm of a rotation: results in 16 bits still count as rotations.
const UNIT: f64 = 1e-2;

/// The differences of two arrays of the same shape.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ArrayDifference {
    /// Shape of both arrays.
    pub shape: Vec<usize>,
    /// Number of elements of each array.
    pub numbers: usize,
    /// Number of elements whose bits differ; NaN values count as equal.
    pub differing: usize,
    /// Number of elements whose difference is not finite: NaN or infinite in one array, and another value in the
    /// other. [`difference`](Self::difference) is that of the others.
    pub not_finite: usize,
    /// Absolute differences of the elements.
    pub difference: Spread,
    /// Indices of the element with the largest difference.
    pub largest_at: Vec<usize>,
    /// Angles between the rotations, in degrees, if the last axis of both arrays consists of unit quaternions.
    pub rotation: Option<Spread>,
    /// Indices of the rotation with the largest angle, without that of the last axis.
    pub largest_rotation_at: Option<Vec<usize>>,
}

impl ArrayDifference {
    /// Compares two arrays; `inputs` are their names in errors. NaN equals NaN.
    ///
    /// # Errors
    /// When the shapes of the arrays differ.
    pub fn of(inputs: [&str; 2], [first, second]: [&NumberArray; 2]) -> Result<Self, CompareError> {
        if first.shape != second.shape {
            return Err(CompareError::Shapes {
                inputs: inputs.map(str::to_owned),
                shapes: [first.shape.clone(), second.shape.clone()],
            });
        }
        let mut difference = Tally::default();
        let (mut differing, mut not_finite) = (0, 0);
        for (&a, &b) in first.values.iter().zip(&second.values) {
            let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            let apart = if same { 0.0 } else { (a - b).abs() };
            differing += usize::from(!same);
            not_finite += usize::from(!apart.is_finite());
            difference.add(if apart.is_finite() { apart } else { 0.0 });
        }
        let angles = rotations(first).zip(rotations(second)).map(|(a, b)| {
            let mut tally = Tally::default();
            a.zip(b).for_each(|(a, b)| tally.add(angle_between(a, b)));
            tally
        });
        let rows = &first.shape[..first.shape.len().saturating_sub(1)];
        Ok(Self {
            shape: first.shape.clone(),
            numbers: first.values.len(),
            differing,
            not_finite,
            difference: difference.times(1.0),
            largest_at: indices(difference.largest_at, &first.shape),
            rotation: angles.map(|tally| tally.times(1f64.to_degrees())),
            largest_rotation_at: angles.map(|tally| indices(tally.largest_at, rows)),
        })
    }
}

/// The rotations of an array that contains nothing else: four numbers each, of norm 1. The order of their components
/// does not matter for the angle between two rotations.
fn rotations(array: &NumberArray) -> Option<impl Iterator<Item = DQuat> + '_> {
    let rows = || {
        let rows = array.values.chunks_exact(4);
        rows.filter_map(|row| Some(DQuat::from_array(row.try_into().ok()?)))
    };
    let is_unit = |q: DQuat| (q.length() - 1.0).abs() <= UNIT;
    let whole = array.shape.last() == Some(&4) && !array.values.is_empty();
    (whole && rows().all(is_unit)).then(rows)
}

/// The indices of an element of an array whose last axis is the fastest.
fn indices(mut index: u64, shape: &[usize]) -> Vec<usize> {
    let mut found: Vec<usize> = shape
        .iter()
        .rev()
        .map(|&length| {
            let length = length.max(1) as u64;
            let along_axis = (index % length) as usize;
            index /= length;
            along_axis
        })
        .collect();
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(shape: &[usize], values: &[f64]) -> NumberArray {
        NumberArray {
            shape: shape.to_vec(),
            values: values.to_vec(),
        }
    }

    #[test]
    fn the_largest_difference_has_its_place() {
        let first = numbers(&[2, 3], &[0.0, 1.0, 2.0, 3.0, f64::NAN, 5.0]);
        let second = numbers(&[2, 3], &[0.0, 1.0, 2.5, 3.0, f64::NAN, 4.0]);
        let found = ArrayDifference::of(["a", "b"], [&first, &second]).unwrap();
        assert_eq!((found.differing, found.difference.largest), (2, 1.0));
        assert_eq!(
            (found.largest_at, found.rotation.is_none()),
            (vec![1, 2], true)
        );
    }

    #[test]
    fn numbers_without_a_difference_are_counted() {
        let first = numbers(
            &[5],
            &[f64::NAN, f64::INFINITY, 1.0, f64::NAN, f64::INFINITY],
        );
        let second = numbers(&[5], &[f64::NAN, f64::INFINITY, 1.5, 2.0, 3.0]);
        let found = ArrayDifference::of(["a", "b"], [&first, &second]).unwrap();
        assert_eq!((found.differing, found.not_finite), (3, 2));
        assert_eq!((found.difference.largest, found.largest_at), (0.5, vec![2]));
    }

    #[test]
    fn four_numbers_of_norm_one_are_rotations() {
        let half = 0.5f64.sqrt();
        let first = numbers(&[1, 2, 4], &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let second = numbers(&[1, 2, 4], &[0.0, 0.0, 0.0, -1.0, half, half, 0.0, 0.0]);
        let found = ArrayDifference::of(["a", "b"], [&first, &second]).unwrap();
        let angles = found.rotation.unwrap();
        assert!((angles.largest - 90.0).abs() < 1e-12 && (angles.mean - 45.0).abs() < 1e-12);
        assert_eq!(found.largest_rotation_at, Some(vec![0, 1]));
    }

    #[test]
    fn other_shapes_are_refused() {
        let [first, second] = [numbers(&[2], &[0.0; 2]), numbers(&[1, 2], &[0.0; 2])];
        let error = ArrayDifference::of(["a.npy", "b.npy"], [&first, &second]).unwrap_err();
        let expected =
            "a.npy has the shape [2] and b.npy has [1, 2]; arrays of one shape can be compared";
        assert_eq!(error.to_string(), expected);
    }
}
