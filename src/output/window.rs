//! Division of a result into windows: the parts that are evaluated at once, on a device or into a stream.

use std::ops::Range;

use crate::output::rotations::Layout;

/// A part of a result that is contiguous in memory: some samples of some tracks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Window {
    /// The window's start in the result that it is a part of, in rotations.
    pub(crate) start: usize,
    pub(crate) tracks: Range<usize>,
    pub(crate) samples: Range<usize>,
    pub(crate) layout: Layout,
}

impl Window {
    pub(crate) fn whole(tracks: usize, samples: usize, layout: Layout) -> Self {
        Self::of(0..tracks, 0..samples, layout)
    }

    /// Some samples of some tracks, as a separate result.
    pub(crate) fn of(tracks: Range<usize>, samples: Range<usize>, layout: Layout) -> Self {
        Self {
            start: 0,
            tracks,
            samples,
            layout,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.tracks.len() * self.samples.len()
    }

    /// The distance between neighbouring samples of a track, in rotations.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    pub(crate) fn stride(&self) -> usize {
        match self.layout {
            Layout::TrackMajor => 1,
            Layout::FrameMajor => self.tracks.len(),
        }
    }

    /// The index of a rotation in the window.
    pub(crate) fn offset(&self, track: usize, sample: usize) -> usize {
        let (track, sample) = (track - self.tracks.start, sample - self.samples.start);
        self.layout
            .offset(track, sample, self.tracks.len(), self.samples.len())
    }

    /// Divides the window into windows of at most `limit` rotations, in the order of memory.
    pub(crate) fn cut(&self, limit: usize) -> impl Iterator<Item = Self> + Send + use<> {
        let layout = self.layout;
        let (rows, columns) = match layout {
            Layout::TrackMajor => (self.tracks.clone(), self.samples.clone()),
            Layout::FrameMajor => (self.samples.clone(), self.tracks.clone()),
        };
        // A piece has as many whole rows as fit into the limit; if a single row does not fit, it has a part of one.
        let rows_each = (limit / columns.len().max(1)).max(1);
        let columns_each = columns.len().min(limit).max(1);
        let pieces = |of: Range<usize>, each: usize| {
            let end = of.end;
            of.step_by(each)
                .map(move |from| from..from.saturating_add(each).min(end))
        };
        let parts = pieces(rows, rows_each).flat_map(move |row| {
            pieces(columns.clone(), columns_each).map(move |column| (row.clone(), column))
        });
        let mut start = 0;
        parts.map(move |(row, column)| {
            let (tracks, samples) = match layout {
                Layout::TrackMajor => (row, column),
                Layout::FrameMajor => (column, row),
            };
            let window = Self {
                start,
                ..Self::of(tracks, samples, layout)
            };
            start += window.len();
            window
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_every_rotation_once_in_order() {
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            for (tracks, samples) in [(0, 5), (1, 1), (3, 7), (7, 3), (1, 100), (100, 1)] {
                let whole = Window::whole(tracks, samples, layout);
                for (outer, inner) in [(1000, 1), (1000, 64), (64, 5), (7, 2), (2, 2)] {
                    let mut next = 0;
                    for window in whole.cut(outer) {
                        assert_eq!(window.start, next);
                        for part in window.cut(inner) {
                            assert!(part.len() <= inner);
                            assert_eq!(window.start + part.start, next);
                            for track in part.tracks.clone() {
                                for sample in part.samples.clone() {
                                    let offset = next + part.offset(track, sample);
                                    let expected = layout.offset(track, sample, tracks, samples);
                                    assert_eq!(offset, expected);
                                }
                            }
                            next += part.len();
                        }
                    }
                    assert_eq!(next, tracks * samples);
                }
            }
        }
    }
}
