//! Spread runs: the list of a window for devices on which neighbouring invocations evaluate a run together. A power of
//! two of invocations, the lanes of a run, take its samples in turn; frame by frame each takes those of a track
//! ([`LaneAxis`]).
//!
//! A wave of 32 or 64 invocations has several runs, and goes on until the longest one ends. So long runs are cut, and
//! runs near each other in the list are put in order of their iterations. Their order in the list is free, because each
//! says where its samples are stored.

use rayon::prelude::*;

use crate::machine::options::RunLanes;
use crate::shader::{IS_CONSTANT, LINE, NEEDS_CARE, NO_KEY, SPREAD_WORKGROUP, Spread, SpreadRun};
use crate::work::lists::{GroupWork, WorkChunk};

/// The maximum number of iterations of a run. With 16 a run of 200 samples began twice, which took a twelfth of its
/// instructions.
const MAX_ITERATIONS: u32 = 32;

/// The invocations that a large card runs at once.
const FULL_CARD: u64 = 1 << 17;

/// Runs that are put in order of their iterations; whole workgroups with any number of lanes.
const ORDERED_RUNS: usize = 128;

/// A run without samples, which fills a workgroup.
pub(crate) const NO_RUN: SpreadRun = SpreadRun {
    source: 0,
    output: 0,
    count: 0,
    first: 0,
    scale: 0.0,
    offset: 0.0,
    key: NO_KEY,
    iterations: 0,
};

/// The number of samples of a run.
pub(crate) fn sample_count(run: &SpreadRun) -> u32 {
    run.count & !(IS_CONSTANT | NEEDS_CARE)
}

/// The numbers of the runs of a window and of their samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunCounts {
    runs: u64,
    samples: u64,
}

impl RunCounts {
    pub(crate) fn of_lists(lists: &[GroupWork]) -> Self {
        Self::of_chunks(lists.iter().flat_map(|list| &list.chunks), 1)
    }

    /// As [`Self::of_lists`], for chunks that are repeated `repetitions` times.
    pub(crate) fn of_chunks<'a>(
        chunks: impl Iterator<Item = &'a WorkChunk> + Clone,
        repetitions: u64,
    ) -> Self {
        let runs = || chunks.clone().flat_map(|chunk| &chunk.runs);
        let samples: u64 = runs().map(|run| u64::from(sample_count(run))).sum();
        Self {
            runs: runs().count() as u64 * repetitions,
            samples: samples * repetitions,
        }
    }

    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            runs: self.runs + other.runs,
            samples: self.samples + other.samples,
        }
    }

    /// Whether runs have so few samples on average that samples should rather be listed one by one.
    pub(crate) fn are_too_short(self) -> bool {
        const TOO_SHORT: u64 = 4;
        self.samples < TOO_SHORT * self.runs
    }
}

/// The neighbours in the result, which the lanes of a run store together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LaneAxis {
    /// Samples of a track: each lane evaluates some samples of a run.
    Samples,
    /// Tracks with the same runs, frame by frame: each lane evaluates a whole run of its track. Neighbouring samples of
    /// a track are `stride` values from each other in the result.
    Tracks { stride: u32 },
}

/// How often the entries of a list are evaluated, and by how much the indices of segments, constants and results grow
/// each time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RunRepetitions {
    pub(crate) count: u32,
    pub(crate) segments: u32,
    pub(crate) constants: u32,
    pub(crate) outputs: u32,
}

impl RunRepetitions {
    /// Once.
    pub(crate) const ONE: Self = Self {
        count: 1,
        segments: 0,
        constants: 0,
        outputs: 0,
    };
}

/// The number of lanes of a run, a power of two, and the invocations of a workgroup.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SpreadLanes {
    log2: u32,
    workgroup: u32,
    axis: LaneAxis,
    /// The maximum number of iterations of an entry.
    max_iterations: u32,
}

impl SpreadLanes {
    /// Lanes with neighbouring samples, 4 to 32.
    pub(crate) fn new(log2: u32) -> Self {
        Self {
            log2,
            workgroup: SPREAD_WORKGROUP,
            axis: LaneAxis::Samples,
            max_iterations: MAX_ITERATIONS,
        }
    }

    /// Lanes with neighbouring tracks. Neighbouring samples of a track are `stride` values from each other in the
    /// result.
    #[cfg(feature = "lab")]
    pub(crate) fn with_tracks(log2: u32, stride: u32) -> Self {
        Self {
            axis: LaneAxis::Tracks { stride },
            ..Self::new(log2)
        }
    }

    /// The same for a kernel whose workgroups have another number of invocations.
    #[cfg(feature = "lab")]
    pub(crate) fn with_workgroup(self, workgroup: u32) -> Self {
        Self { workgroup, ..self }
    }

    /// The lanes for the runs of a window.
    pub(crate) fn of_runs(counts: RunCounts, run_lanes: RunLanes) -> Self {
        let class = RunLanes::class(counts.runs, counts.samples);
        Self::new(run_lanes.of_class(class).ilog2())
    }

    /// The lanes for runs of neighbouring tracks: at least as many as a cache line has rotations, at most a workgroup.
    /// Of these sizes, it is the largest at which at most an eighth of the lanes has no track.
    pub(crate) fn of_tracks(tracks: u32, samples: u32, stride: u32) -> Self {
        let is_used = |log2: &u32| {
            let lanes = tracks.next_multiple_of(1 << log2);
            8 * (lanes - tracks) <= lanes
        };
        let mut sizes = (LINE.ilog2()..=SPREAD_WORKGROUP.ilog2()).rev();
        // Runs are cut until the dispatch has as many invocations as a large card runs at once, but not so short that
        // their beginnings would take longer than their samples.
        let samples_each = u64::from(tracks) * u64::from(samples) / FULL_CARD;
        Self {
            log2: sizes.find(is_used).unwrap_or(LINE.ilog2()),
            workgroup: SPREAD_WORKGROUP,
            axis: LaneAxis::Tracks { stride },
            max_iterations: samples_each.clamp(8, MAX_ITERATIONS.into()) as u32,
        }
    }

    pub(crate) fn axis(self) -> LaneAxis {
        self.axis
    }

    pub(crate) fn lanes(self) -> u32 {
        1 << self.log2
    }

    /// The number of lanes with neighbouring samples, as a power of two.
    fn sample_lanes_log2(self) -> u32 {
        match self.axis {
            LaneAxis::Samples => self.log2,
            LaneAxis::Tracks { .. } => 0,
        }
    }

    /// The distance in the result between neighbouring samples of a track.
    fn stride(self) -> u32 {
        match self.axis {
            LaneAxis::Samples => 1,
            LaneAxis::Tracks { stride } => stride,
        }
    }

    /// The lanes that store a line of memory of samples together, less one.
    fn line_mask(self) -> u32 {
        (1 << self.sample_lanes_log2()).min(LINE) - 1
    }

    pub(crate) fn runs_of_workgroup(self) -> usize {
        (self.workgroup >> self.log2) as usize
    }

    /// The iterations of a run, wherever in a line it begins.
    fn iterations(self, samples: u32) -> u32 {
        (samples + self.line_mask()).div_ceil(1 << self.sample_lanes_log2())
    }

    /// The number of samples of the pieces into which a run is cut; the last one may have fewer. Those of tracks are about
    /// as long as each other, so that none is short.
    fn piece_samples(self, run: &SpreadRun) -> u32 {
        let max_samples = self.max_iterations << self.sample_lanes_log2();
        match self.axis {
            LaneAxis::Samples => max_samples,
            LaneAxis::Tracks { .. } => {
                let count = sample_count(run).max(1);
                count.div_ceil(count.div_ceil(max_samples))
            }
        }
    }

    /// The pieces into which a run is cut.
    fn pieces(self, run: &SpreadRun) -> impl Iterator<Item = SpreadRun> + use<> {
        let (run, count, each) = (*run, sample_count(run), self.piece_samples(run));
        (0..count)
            .step_by(each as usize)
            .map(move |done| SpreadRun {
                output: run.output + done * self.stride(),
                count: (count - done).min(each) | (run.count & (IS_CONSTANT | NEEDS_CARE)),
                first: run.first.wrapping_add(done as i32),
                key: if done == 0 { run.key } else { NO_KEY },
                iterations: self.iterations((count - done).min(each)),
                ..run
            })
    }

    /// The number of pieces of a chunk's runs.
    pub(crate) fn piece_count(self, chunk: &WorkChunk) -> usize {
        let pieces = |run: &SpreadRun| sample_count(run).div_ceil(self.piece_samples(run)) as usize;
        chunk.runs.iter().map(pieces).sum()
    }

    /// The number of entries of a chunk in the list: whole workgroups.
    pub(crate) fn entries(self, chunk: &WorkChunk) -> usize {
        (self.piece_count(chunk)).next_multiple_of(self.runs_of_workgroup())
    }

    /// The number of entries of a group in the list.
    pub(crate) fn entries_of_group(self, list: &GroupWork) -> usize {
        list.chunks.iter().map(|chunk| self.entries(chunk)).sum()
    }

    /// Writes the list of a chunk, whose distances begin at an index in the list of distances. Each element is written
    /// once, in order, and none is read again, because the memory may be slow to read.
    pub(crate) fn write_chunk(self, chunk: &WorkChunk, distances: i32, list: &mut [SpreadRun]) {
        let mut pieces = chunk.runs.iter().flat_map(|run| self.pieces(run));
        let mut ordered = [NO_RUN; ORDERED_RUNS];
        for list in list.chunks_mut(ORDERED_RUNS) {
            let ordered = &mut ordered[..list.len()];
            ordered.fill_with(|| pieces.next().unwrap_or(NO_RUN));
            ordered.sort_by_key(|piece| piece.iterations);
            for workgroup in ordered.chunks_mut(self.runs_of_workgroup()) {
                let iterations = workgroup.last().map_or(0, |piece| piece.iterations);
                for piece in workgroup {
                    piece.iterations = iterations;
                    piece.first = piece.first.wrapping_add(distances);
                }
            }
            list.copy_from_slice(ordered);
        }
    }

    /// Writes the lists of all groups, one after another, as [`SpreadLanes::write_chunk`] does.
    pub(crate) fn write(
        self,
        lists: &[GroupWork],
        mut list: &mut [SpreadRun],
        mut distances: &mut [f32],
    ) {
        let mut next_distance = 0;
        let mut destinations = Vec::new();
        for chunk in lists.iter().flat_map(|list| &list.chunks) {
            let (runs, other_runs) = list.split_at_mut(self.entries(chunk));
            let (chunk_distances, others) = distances.split_at_mut(chunk.distances.len());
            (list, distances) = (other_runs, others);
            destinations.push((chunk, runs, chunk_distances, next_distance));
            next_distance += chunk.distances.len() as i32;
        }
        destinations
            .into_par_iter()
            .for_each(|(chunk, runs, distances, first)| {
                distances.copy_from_slice(&chunk.distances);
                let first = if distances.is_empty() { 0 } else { first };
                self.write_chunk(chunk, first, runs);
            });
    }

    /// The push constants of a dispatch, whose values are stored from an index on.
    // Lists without repetitions are used only by the lab and by tests.
    #[cfg_attr(not(feature = "lab"), allow(dead_code))]
    pub(crate) fn dispatch(self, entries: [u32; 2], detail: u32, output: u32) -> Spread {
        self.dispatch_repeated(entries, RunRepetitions::ONE, detail, output)
    }

    /// As [`SpreadLanes::dispatch`], for entries that are repeated.
    pub(crate) fn dispatch_repeated(
        self,
        [first, count]: [u32; 2],
        repetitions: RunRepetitions,
        detail: u32,
        output: u32,
    ) -> Spread {
        Spread {
            detail,
            first_item: first,
            item_count: count,
            first_output: output,
            lanes_log2: self.log2,
            sample_mask: (1 << self.sample_lanes_log2()) - 1,
            track_mask: self.layer_repetitions() - 1,
            step: 1 << self.sample_lanes_log2(),
            step_log2: self.sample_lanes_log2(),
            stride: self.stride(),
            line_mask: self.line_mask(),
            repetitions: repetitions.count,
            layer_repetitions: self.layer_repetitions(),
            segments: repetitions.segments,
            constants: repetitions.constants,
            outputs: repetitions.outputs,
        }
    }

    /// The repetitions of a layer of workgroups.
    fn layer_repetitions(self) -> u32 {
        match self.axis {
            LaneAxis::Samples => 1,
            LaneAxis::Tracks { .. } => self.lanes(),
        }
    }

    /// The workgroups of a dispatch over entries with this number of repetitions.
    pub(crate) fn workgroups(self, entries: u32, repetitions: u32) -> [u32; 3] {
        let of_layer = (entries << self.log2).div_ceil(self.workgroup);
        [of_layer, 1, repetitions.div_ceil(self.layer_repetitions())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each sample of each run is in one entry, at its place and with its distance; the key is in the first. Entries
    /// that are near each other take as many iterations.
    #[test]
    fn entries_have_the_samples_of_all_runs() {
        let mut random = fastrand::Rng::with_seed(7);
        let of_tracks =
            [(11, 9), (100, 300), (4096, 1200)].map(|(n, m)| SpreadLanes::of_tracks(n, m, n + 2));
        for lanes in (2..=5).map(SpreadLanes::new).chain(of_tracks) {
            let stride = lanes.stride();
            let mut chunk = WorkChunk::default();
            let mut output = 5;
            for source in 0..300 {
                let max = [3, 90, 2000][random.usize(..3)];
                let count = 1 + random.u32(..max);
                let flags = [0, IS_CONSTANT, NEEDS_CARE][random.usize(..3)];
                let key = [NO_KEY, source + 7][random.usize(..2)];
                chunk.runs.push(SpreadRun {
                    source,
                    output,
                    count: count | flags,
                    first: -30 - source as i32,
                    key,
                    ..NO_RUN
                });
                output += (count + random.u32(..3)) * stride;
            }
            let mut list = vec![NO_RUN; lanes.entries(&chunk)];
            lanes.write_chunk(&chunk, 1000, &mut list);
            assert!(list.len().is_multiple_of(lanes.runs_of_workgroup()));
            for workgroup in list.chunks(lanes.runs_of_workgroup()) {
                let iterations = workgroup.iter().map(|run| match sample_count(run) {
                    0 => 0,
                    count => lanes.iterations(count),
                });
                let max = iterations.max().unwrap();
                assert!(
                    workgroup.iter().all(|run| run.iterations == max) && max <= MAX_ITERATIONS + 1
                );
            }
            list.retain(|run| sample_count(run) > 0);
            list.sort_by_key(|run| run.output);
            let mut entries = list.iter();
            for run in &chunk.runs {
                let (mut done, count) = (0, sample_count(run));
                while done < count {
                    let piece = entries.next().unwrap();
                    let expected = SpreadRun {
                        output: run.output + done * stride,
                        first: run.first + 1000 + done as i32,
                        key: if done == 0 { run.key } else { NO_KEY },
                        count: piece.count,
                        iterations: piece.iterations,
                        ..*run
                    };
                    assert_eq!(*piece, expected);
                    let flags = run.count - count;
                    assert_eq!(piece.count - sample_count(piece), flags);
                    done += sample_count(piece);
                }
                assert_eq!(done, count);
            }
            assert!(entries.next().is_none());
        }
    }

    /// Hardly a lane has no track, and a card is filled if there are samples enough.
    #[test]
    fn lanes_are_as_many_as_tracks_fill() {
        let lanes = |tracks, samples| {
            let lanes = SpreadLanes::of_tracks(tracks, samples, tracks);
            (lanes.lanes(), lanes.max_iterations)
        };
        assert_eq!(lanes(4096, 1200), (128, 32));
        assert_eq!(lanes(509, 1200), (128, 8));
        for (tracks, expected) in [
            (8, 8),
            (9, 8),
            (24, 8),
            (30, 32),
            (60, 64),
            (65, 8),
            (80, 16),
        ] {
            assert_eq!(lanes(tracks, 1 << 16).0, expected, "{tracks} tracks");
        }
        assert_eq!(lanes(60, 1 << 15).1, 15);
        let run = |count| SpreadRun { count, ..NO_RUN };
        let pieces = |count| {
            let pieces = SpreadLanes::of_tracks(4096, 1200, 4096).pieces(&run(count));
            Vec::from_iter(pieces.map(|piece| piece.count))
        };
        assert_eq!(pieces(48), [24, 24]);
        assert_eq!(pieces(65), [22, 22, 21]);
    }
}
