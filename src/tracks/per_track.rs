//! Values that all tracks of a set share, or that each track has.

use crate::names::counted;

/// A value for all tracks of a set, or one for each track.
///
/// Functions that take it also take the value alone, or a list:
///
/// ```
/// use tumble::glam::Quat;
/// use tumble::{Device, Engine, Interpolation, SampleTimes, TrackSet, method};
/// let mut set = TrackSet::new();
/// let keys = [Quat::IDENTITY, Quat::from_rotation_z(1.0)];
/// set.push("lever", &[0.0, 1.0], &keys)?;
/// set.push("switch", &[0.0, 1.0], &keys)?;
/// let engine = Engine::new(Device::Cpu)?;
/// let half = SampleTimes::at(vec![0.5]);
/// let each: Vec<Interpolation> = vec![method::SLERP.into(), method::STEP.into()];
/// let found = engine.evaluate(&set, each, &half)?;
/// assert_eq!(found.get(0, 0), engine.evaluate(&set, method::SLERP, &half)?.get(0, 0));
/// assert_eq!(found.get(1, 0), Some(keys[0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum PerTrack<T> {
    /// The same value for every track.
    All(T),
    /// A value for each track, in the order of the tracks.
    Each(Vec<T>),
}

/// The tracks of a set that have equal values.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TrackGroup<T> {
    /// Their value.
    pub value: T,
    /// Their indices in the set, increasing.
    pub tracks: Vec<usize>,
}

/// A list of values is not as long as the list of tracks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a list of {values} is given for {}; give one for each track, or a single one for all", counted(*.tracks, "track")
)]
#[non_exhaustive]
pub struct PerTrackCountError {
    /// The number of values.
    pub values: usize,
    /// The number of tracks.
    pub tracks: usize,
}

impl<T: Clone + PartialEq> PerTrack<T> {
    /// The value that all of `tracks` tracks have; `None` if they differ, or if there are not as many values.
    #[must_use]
    pub fn uniform(&self, tracks: usize) -> Option<T> {
        match self {
            Self::All(value) => Some(value.clone()),
            Self::Each(values) => {
                let first = values.first().filter(|_| values.len() == tracks)?;
                values
                    .iter()
                    .all(|value| value == first)
                    .then(|| first.clone())
            }
        }
    }

    /// The value of all tracks alone, or that of each track.
    #[must_use]
    pub fn values(&self) -> &[T] {
        match self {
            Self::All(value) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }

    /// The value of every one of `tracks` tracks.
    ///
    /// # Errors
    /// When there are values for another number of tracks.
    pub fn list(self, tracks: usize) -> Result<Vec<T>, PerTrackCountError> {
        match self {
            Self::All(value) => Ok(vec![value; tracks]),
            Self::Each(values) if values.len() == tracks => Ok(values),
            Self::Each(values) => {
                let values = values.len();
                Err(PerTrackCountError { values, tracks })
            }
        }
    }

    /// `tracks` tracks in groups of equal values, ordered by their first tracks.
    ///
    /// # Errors
    /// When there are values for another number of tracks.
    pub fn groups(self, tracks: usize) -> Result<Vec<TrackGroup<T>>, PerTrackCountError> {
        let mut groups: Vec<TrackGroup<T>> = Vec::new();
        for (track, value) in self.list(tracks)?.into_iter().enumerate() {
            match groups.iter_mut().find(|group| group.value == value) {
                Some(group) => group.tracks.push(track),
                None => groups.push(TrackGroup {
                    value,
                    tracks: vec![track],
                }),
            }
        }
        Ok(groups)
    }

    /// The values of two lists together.
    pub(crate) fn zip<U: Clone + PartialEq>(
        self,
        other: PerTrack<U>,
        tracks: usize,
    ) -> Result<PerTrack<(T, U)>, PerTrackCountError> {
        Ok(match (self, other) {
            (Self::All(one), PerTrack::All(other)) => PerTrack::All((one, other)),
            (these, others) => {
                let others = others.list(tracks)?;
                PerTrack::Each(these.list(tracks)?.into_iter().zip(others).collect())
            }
        })
    }
}

impl<T> From<Vec<T>> for PerTrack<T> {
    fn from(values: Vec<T>) -> Self {
        Self::Each(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_are_one_group_in_the_order_of_first_tracks() {
        let groups = PerTrack::Each(vec!['b', 'a', 'b', 'a', 'c']).groups(5);
        let group = |value, tracks: &[usize]| TrackGroup {
            value,
            tracks: tracks.to_vec(),
        };
        let expected = [group('b', &[0, 2]), group('a', &[1, 3]), group('c', &[4])];
        assert_eq!(groups.unwrap(), expected);
        assert_eq!(PerTrack::All(7).groups(2).unwrap().len(), 1);
        assert_eq!(PerTrack::<u8>::Each(Vec::new()).groups(0), Ok(Vec::new()));
    }

    #[test]
    fn a_list_of_another_length_is_refused() {
        let (values, tracks) = (2, 3);
        let error = Err(PerTrackCountError { values, tracks });
        assert_eq!(PerTrack::Each(vec![1, 1]).groups(3), error);
        assert_eq!(PerTrack::Each(vec![1, 1]).uniform(3), None);
        assert_eq!(PerTrack::Each(vec![1, 1]).uniform(2), Some(1));
        assert_eq!(PerTrack::Each(vec![1, 2]).uniform(2), None);
    }
}
