//! The one rule of signs. `q` and `-q` are one rotation, but a player that joins samples without a
//! test goes the long way round where neighbours differ in sign: of the two, whatever is written has
//! the one that is nearer to the sample of the track before it.

use std::borrow::Cow;

use glam::Quat;
use tumble::Layout;

/// Gives each rotation, in the order `[sample][track]`, the sign that is nearer to the sample before.
pub fn continue_signs(rotations: &mut [Quat], tracks: usize) {
    for next in tracks..rotations.len() {
        if rotations[next - tracks].dot(rotations[next]) < 0.0 {
            rotations[next] = -rotations[next];
        }
    }
}

/// Whether [`continue_signs`] would change any of them.
pub(crate) fn signs_jump(rotations: &[Quat], tracks: usize) -> bool {
    let after = rotations.get(tracks..).unwrap_or_default();
    let mut pairs = rotations.iter().zip(after);
    pairs.any(|(before, after)| before.dot(*after) < 0.0)
}

/// Continues the signs of rotations that come some at a time, in the order of a layout.
#[derive(Debug)]
pub(crate) struct Signs {
    layout: Layout,
    samples: usize,
    /// The rotations before the next ones, each with the sign that it was given: of every track in
    /// turn where all tracks of a sample come together, else of the track that comes.
    before: Vec<Quat>,
    place: usize,
}

impl Signs {
    /// For so many tracks and samples.
    pub(crate) fn new(layout: Layout, tracks: usize, samples: usize) -> Self {
        let tracks = match layout {
            Layout::TrackMajor => 1,
            Layout::FrameMajor => tracks,
        };
        Self {
            layout,
            samples,
            before: vec![Quat::from_array([0.0; 4]); tracks],
            place: 0,
        }
    }

    /// The next rotations; nothing is copied where no sign changes.
    pub(crate) fn next<'a>(&mut self, rotations: &'a [Quat]) -> Cow<'a, [Quat]> {
        let mut all = Cow::Borrowed(rotations);
        for (place, &own) in rotations.iter().enumerate() {
            let track = self.place % self.before.len().max(1);
            let is_first = self.layout == Layout::TrackMajor && self.place % self.samples == 0;
            let Some(before) = self.before.get_mut(track) else {
                break;
            };
            let turns = !is_first && before.dot(own) < 0.0;
            *before = if turns { -own } else { own };
            if turns {
                all.to_mut()[place] = *before;
            }
            self.place += 1;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_those_of_the_samples_before_in_every_layout_and_piece() {
        let (tracks, samples) = (3, 7);
        let rotation = |track: usize, sample: usize| {
            let turned = Quat::from_rotation_y(0.3 * (track * samples + sample) as f32);
            let flips = sample * (track + 2) % 3 == 1;
            if flips { -turned } else { turned }
        };
        let mut expected: Vec<Quat> = (0..samples * tracks)
            .map(|place| rotation(place % tracks, place / tracks))
            .collect();
        assert!(signs_jump(&expected, tracks));
        continue_signs(&mut expected, tracks);
        assert!(!signs_jump(&expected, tracks));
        for piece in 1..=samples * tracks {
            for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                let place = |place: usize| match layout {
                    Layout::FrameMajor => (place % tracks, place / tracks),
                    Layout::TrackMajor => (place / samples, place % samples),
                };
                let all: Vec<Quat> = (0..samples * tracks)
                    .map(|at| rotation(place(at).0, place(at).1))
                    .collect();
                let mut signs = Signs::new(layout, tracks, samples);
                let found: Vec<Quat> = all
                    .chunks(piece)
                    .flat_map(|piece| signs.next(piece).into_owned())
                    .collect();
                for (at, found) in found.into_iter().enumerate() {
                    let (track, sample) = place(at);
                    assert_eq!(found, expected[sample * tracks + track], "{layout:?} {at}");
                }
            }
        }
    }
}
