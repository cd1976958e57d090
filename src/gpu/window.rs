//! The output cut into windows, and the work list of one window.

use std::ops::Range;

use rayon::prelude::*;

use crate::clock::{FramesError, Timeline};
use crate::numeric::round_f32;
use crate::prepare::ClipData;
use crate::prepare::Prepared;
use crate::rotations::Layout;
use crate::schedule::{Distance, Run, RunSource};
use crate::segment::Item;
use crate::segment::shader::{HOLD, ITEM_SAMPLES};

/// A contiguous stretch of the output: some samples of some tracks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Window {
    /// Where it starts in the output, in rotations.
    pub(super) start: usize,
    pub(super) tracks: Range<usize>,
    pub(super) samples: Range<usize>,
    layout: Layout,
}

impl Window {
    /// Number of rotations.
    pub(super) fn len(&self) -> usize {
        self.tracks.len() * self.samples.len()
    }

    /// Distance in the output between neighbouring samples of a track.
    pub(super) fn stride(&self) -> usize {
        match self.layout {
            Layout::TrackMajor => 1,
            Layout::FrameMajor => self.tracks.len(),
        }
    }

    /// Where a rotation lies in the window.
    fn place(&self, track: usize, sample: usize) -> usize {
        let (track, sample) = (track - self.tracks.start, sample - self.samples.start);
        self.layout
            .index(track, sample, self.tracks.len(), self.samples.len())
    }
}

/// Cuts `tracks × samples` rotations into windows of at most `limit`.
pub(super) fn windows(tracks: usize, samples: usize, layout: Layout, limit: usize) -> Vec<Window> {
    let (rows, columns) = match layout {
        Layout::TrackMajor => (tracks, samples),
        Layout::FrameMajor => (samples, tracks),
    };
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    // Whole rows while they fit, pieces of one row where it does not.
    let rows_each = (limit / columns).max(1);
    let columns_each = if columns > limit { limit } else { columns };
    let mut windows = Vec::new();
    for first_row in (0..rows).step_by(rows_each) {
        let row = first_row..(first_row + rows_each).min(rows);
        for first_column in (0..columns).step_by(columns_each) {
            let column = first_column..(first_column + columns_each).min(columns);
            let start = first_row * columns + first_column;
            let (tracks, samples) = match layout {
                Layout::TrackMajor => (row.clone(), column),
                Layout::FrameMajor => (column, row.clone()),
            };
            windows.push(Window {
                start,
                tracks,
                samples,
                layout,
            });
        }
    }
    windows
}

/// What one group of a clip has to do in a window.
pub(super) struct GroupWork {
    pub(super) group: usize,
    pub(super) chunks: Vec<WorkChunk>,
}

/// A piece of a work list, made by one thread. The `first` of items that take their
/// distances from `distances` counts from the chunk's own first.
#[derive(Default)]
pub(super) struct WorkChunk {
    pub(super) items: Vec<Item>,
    pub(super) distances: Vec<f32>,
    /// Rotations that the host computed: (place in the window, value).
    pub(super) patches: Vec<(usize, [f32; 4])>,
}

impl GroupWork {
    pub(super) fn item_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.items.len()).sum()
    }

    pub(super) fn distance_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.distances.len()).sum()
    }
}

/// Parts of a group that one thread turns into items.
const PARTS_PER_CHUNK: usize = 64;

/// The work lists of a window: one for each group that has any of its tracks.
/// `shift` is added to every place in the output.
pub(super) fn work(
    clip: &ClipData,
    timeline: &Timeline,
    window: &Window,
    shift: u32,
) -> Result<Vec<GroupWork>, FramesError> {
    let mut all = Vec::new();
    for (group, prepared) in clip.groups.iter().enumerate() {
        let first = prepared
            .parts
            .partition_point(|part| part.track < window.tracks.start);
        let last = prepared
            .parts
            .partition_point(|part| part.track < window.tracks.end);
        let chunks: Vec<WorkChunk> = prepared.parts[first..last]
            .par_chunks(PARTS_PER_CHUNK)
            .map(|parts| {
                let mut chunk = WorkChunk::default();
                for part in parts {
                    let mut push = |run| {
                        chunk.push(prepared, timeline, window, part.track, shift, &run);
                    };
                    let samples = window.samples.clone();
                    prepared.runs(part, timeline, samples, &mut push)?;
                }
                Ok(chunk)
            })
            .collect::<Result<_, FramesError>>()?;
        if first < last {
            all.push(GroupWork { group, chunks });
        }
    }
    Ok(all)
}

impl WorkChunk {
    fn push(
        &mut self,
        prepared: &Prepared,
        timeline: &Timeline,
        window: &Window,
        track: usize,
        shift: u32,
        run: &Run,
    ) {
        let output = |sample| window.place(track, sample) as u32 + shift;
        let samples = run.sample..run.sample + run.count;
        let (source, hold, scale, offset) = match run.source {
            RunSource::Constant(source) => (source, HOLD, 0.0, 0.0),
            RunSource::Segment {
                index,
                scale,
                offset,
                ..
            } => (index, 0, scale, offset),
            RunSource::Exact { index, parameter } => {
                self.patches.extend(samples.map(|sample| {
                    let value = prepared.exact(index, parameter, timeline, track, sample);
                    (window.place(track, sample), value)
                }));
                return;
            }
        };
        let mut first = 0;
        if let RunSource::Segment { distance, .. } = run.source {
            first = match distance {
                Distance::Frames { first } => first,
                Distance::Seconds { middle } => {
                    let own = self.distances.len() as i32;
                    let from_middle = |sample| round_f32(timeline.time(track, sample) - middle);
                    self.distances.extend(samples.clone().map(from_middle));
                    own
                }
            };
        }
        for done in (0..run.count).step_by(ITEM_SAMPLES as usize) {
            let count = (run.count - done).min(ITEM_SAMPLES as usize) as u32;
            self.items.push(Item {
                source,
                output: output(run.sample + done),
                count: count | hold,
                first: first.wrapping_add(done as i32),
                scale,
                offset,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_every_rotation_once_in_order() {
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            for (tracks, samples) in [(0, 5), (1, 1), (3, 7), (7, 3), (1, 100), (100, 1)] {
                for limit in [1, 2, 5, 64, 1000] {
                    let mut next = 0;
                    for window in windows(tracks, samples, layout, limit) {
                        assert_eq!(window.start, next);
                        assert!(window.len() <= limit);
                        for track in window.tracks.clone() {
                            for sample in window.samples.clone() {
                                let place = window.start + window.place(track, sample);
                                assert_eq!(place, layout.index(track, sample, tracks, samples));
                            }
                        }
                        next += window.len();
                    }
                    assert_eq!(next, tracks * samples);
                }
            }
        }
    }
}
