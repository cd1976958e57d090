//! Scalars as the positions of tracks that do not rotate: three scalars with the same key times are one track's
//! coordinates. Then motion libraries sample them as positions, and their rates as velocities.

use glam::{Quat, Vec3};
use tumble::{ScalarKeys, TrackError, TrackSet};

use crate::motion::Motion;

/// The coordinates of a track.
const COORDINATES: usize = 3;

/// Some scalars of clips as tracks.
#[derive(Debug, Clone)]
pub struct ScalarTracks {
    names: Vec<String>,
    /// The first scalar of each track, then the number of scalars.
    starts: Vec<usize>,
}

impl ScalarTracks {
    /// Tracks for the scalars with these names, in this order. The scalars of a track have the same key times in every clip;
    /// a clip need not have all of them.
    #[must_use]
    pub fn new<'a>(
        names: Vec<String>,
        clips: impl IntoIterator<Item = &'a Motion, IntoIter: Clone>,
    ) -> Self {
        let clips = clips.into_iter();
        let mut starts = vec![0];
        for index in 1..names.len() {
            let start = starts[starts.len() - 1];
            let joins = |clip: &Motion| {
                let Some((_, next)) = scalar_of(clip, &names[index]) else {
                    return true;
                };
                let mut before = names[start..index].iter();
                let first = before.find_map(|name| scalar_of(clip, name));
                first.is_none_or(|(_, first)| {
                    let has_tangents = |keys: &ScalarKeys<'_>| !keys.tangents.is_empty();
                    first.times == next.times && has_tangents(&first) == has_tangents(&next)
                })
            };
            if index - start == COORDINATES || !clips.clone().all(joins) {
                starts.push(index);
            }
        }
        if !names.is_empty() {
            starts.push(names.len());
        }
        Self { names, starts }
    }

    /// The names of the scalars.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The track of each scalar, and its coordinate.
    pub fn coordinates(&self) -> impl Iterator<Item = [usize; 2]> {
        let tracks = self.starts.windows(2).enumerate();
        tracks.flat_map(|(track, ends)| {
            (0..ends[1] - ends[0]).map(move |coordinate| [track, coordinate])
        })
    }

    /// Adds the tracks to a set, with the scalars of a clip. `rest` is the value of each scalar that the clip does not have.
    ///
    /// # Errors
    /// As [`TrackSet::set_translations`].
    pub fn add_to(
        &self,
        set: &mut TrackSet,
        clip: &Motion,
        rest: impl Fn(usize) -> f64,
    ) -> Result<(), TrackError> {
        // All tracks have the start and the end of the clip.
        let (first, last) = clip.set.time_span().unwrap_or_default();
        let (ends, still) = ([first, last], [Quat::IDENTITY; 2]);
        let count = if first < last { 2 } else { 1 };
        for pair in self.starts.windows(2) {
            let track = set.track_count();
            set.push("", &ends[..count], &still[..count])?;
            let scalars: Vec<Option<(usize, ScalarKeys<'_>)>> = self.names[pair[0]..pair[1]]
                .iter()
                .map(|name| scalar_of(clip, name))
                .collect();
            let (times, has_tangents) = match scalars.iter().flatten().next() {
                Some((_, keys)) => (keys.times, !keys.tangents.is_empty()),
                None => (&ends[..1], false),
            };
            let mut points = vec![Vec3::ZERO; times.len()];
            let tangent_count = if has_tangents { times.len() } else { 0 };
            let mut tangents = vec![[Vec3::ZERO; 2]; tangent_count];
            for (coordinate, scalar) in scalars.iter().enumerate() {
                let Some((index, keys)) = scalar else {
                    let value = rest(pair[0] + coordinate) as f32;
                    points
                        .iter_mut()
                        .for_each(|point| point[coordinate] = value);
                    continue;
                };
                let origin = clip.scalar(*index).origin;
                for (point, &key) in points.iter_mut().zip(keys.keys) {
                    point[coordinate] = (f64::from(key) + origin) as f32;
                }
                for (tangent, sides) in tangents.iter_mut().zip(keys.tangents) {
                    (tangent[0][coordinate], tangent[1][coordinate]) = (sides[0], sides[1]);
                }
            }
            set.set_translations(track, times, &points, &tangents)?;
        }
        Ok(())
    }
}

/// The scalar of a clip with this name, and its index.
#[must_use]
pub fn scalar_of<'a>(clip: &'a Motion, name: &str) -> Option<(usize, ScalarKeys<'a>)> {
    let index = clip.set.scalar_named(name)?;
    Some((index, clip.set.scalar(index)?))
}
