//! The rule for the signs of quaternions, [`continue_signs`], and its application to rotations that arrive in parts.

use std::borrow::Cow;

use glam::Quat;
use tumble::{Layout, signs_differ};

pub use tumble::continue_signs;
pub(crate) use tumble::signs_jump;

/// Continues the signs of rotations that arrive in parts, in the order of a layout.
#[derive(Debug)]
pub(crate) struct Signs {
    layout: Layout,
    samples: usize,
    /// The last rotations, with the signs that they got: of every track if the layout is frame by frame, otherwise of
    /// the current track.
    before: Vec<Quat>,
    index: usize,
}

impl Signs {
    /// The state for `tracks` tracks with `samples` samples each.
    pub(crate) fn new(layout: Layout, tracks: usize, samples: usize) -> Self {
        let tracks = match layout {
            Layout::TrackMajor => 1,
            Layout::FrameMajor => tracks,
        };
        Self {
            layout,
            samples,
            before: vec![Quat::from_array([0.0; 4]); tracks],
            index: 0,
        }
    }

    /// The next rotations with continued signs; they are copied only if a sign changes.
    pub(crate) fn next<'a>(&mut self, rotations: &'a [Quat]) -> Cow<'a, [Quat]> {
        if self.layout == Layout::TrackMajor && self.go_on(rotations) {
            return Cow::Borrowed(rotations);
        }
        let mut all = Cow::Borrowed(rotations);
        for (i, &rotation) in rotations.iter().enumerate() {
            let track = self.index % self.before.len().max(1);
            let is_first =
                self.layout == Layout::TrackMajor && self.index.is_multiple_of(self.samples);
            let Some(before) = self.before.get_mut(track) else {
                break;
            };
            let is_negated = !is_first && signs_differ(*before, rotation);
            *before = if is_negated { -rotation } else { rotation };
            if is_negated {
                all.to_mut()[i] = *before;
            }
            self.index += 1;
        }
        all
    }

    /// Goes through samples that continue the tracks, one track after another, if no sign changes among them. Returns
    /// whether this is so.
    fn go_on(&mut self, mut rotations: &[Quat]) -> bool {
        let [mut before] = self.before[..] else {
            return false;
        };
        let mut index = self.index;
        while let [first, ..] = *rotations {
            let done = index % self.samples;
            let (row, rest) = rotations.split_at(rotations.len().min(self.samples - done));
            if done > 0 && signs_jump(&[before, first], 1) || signs_jump(row, 1) {
                return false;
            }
            (before, index) = (row[row.len() - 1], index + row.len());
            rotations = rest;
        }
        self.before[0] = before;
        self.index = index;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_those_of_the_samples_before_in_every_layout_and_piece() {
        let (tracks, samples) = (3, 7);
        let rotation = |track: usize, sample: usize| {
            let exact = Quat::from_rotation_y(0.3 * (track * samples + sample) as f32);
            let flips = sample * (track + 2) % 3 == 1;
            if flips { -exact } else { exact }
        };
        let mut expected: Vec<Quat> = (0..samples * tracks)
            .map(|index| rotation(index % tracks, index / tracks))
            .collect();
        assert!(signs_jump(&expected, tracks));
        continue_signs(&mut expected, tracks);
        assert!(!signs_jump(&expected, tracks));
        for piece in 1..=samples * tracks {
            for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                let position = |index: usize| match layout {
                    Layout::FrameMajor => (index % tracks, index / tracks),
                    Layout::TrackMajor => (index / samples, index % samples),
                };
                let all: Vec<Quat> = (0..samples * tracks)
                    .map(|at| rotation(position(at).0, position(at).1))
                    .collect();
                let mut signs = Signs::new(layout, tracks, samples);
                let found: Vec<Quat> = all
                    .chunks(piece)
                    .flat_map(|piece| signs.next(piece).into_owned())
                    .collect();
                for (at, found) in found.into_iter().enumerate() {
                    let (track, sample) = position(at);
                    assert_eq!(found, expected[sample * tracks + track], "{layout:?} {at}");
                }
            }
        }
    }
}
