//! The work list of one window of the output.

use rayon::prelude::*;

use crate::clock::{FramesError, Timeline};
use crate::numeric::round_f32;
use crate::prepare::ClipData;
use crate::prepare::Prepared;
use crate::schedule::{Distance, Run, RunSource};
use crate::segment::Item;
use crate::segment::shader::{HOLD, ITEM_SAMPLES};
use crate::window::Window;

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
                    for cycle in prepared.cycles(part, timeline, window.samples.clone()) {
                        prepared.runs(part, timeline, &cycle, &mut push)?;
                    }
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
