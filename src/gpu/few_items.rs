//! The work of windows with few explicit times of each track, as a crowd's poses are: an
//! item for each sample, listed where the device reads it.

use rayon::prelude::*;

use super::work_list::{Patch, Work, item, parts_in, parts_per_chunk};
use crate::clock::{Ticks, Timeline};
use crate::cpu::{FEW, InLanes, Lanes, in_lanes};
use crate::numeric::round_f32;
use crate::prepare::{ClipData, Part, Prepared};
use crate::schedule::{Distance, Run, RunSource};
use crate::segment::Item;
use crate::window::Window;

/// A window, each sample of which is one item.
pub(super) struct FewItems<'a> {
    clip: &'a ClipData,
    timeline: &'a Timeline,
    times: &'a [f64],
    stride: usize,
    window: &'a Window,
    /// Added to every place in the output.
    shift: u32,
}

impl<'a> FewItems<'a> {
    /// Nothing where a window's work is listed by runs.
    pub(super) fn new(
        clip: &'a ClipData,
        timeline: &'a Timeline,
        window: &'a Window,
        shift: u32,
    ) -> Option<Self> {
        let Ticks::Times { times, stride } = &timeline.ticks else {
            return None;
        };
        if window.samples.len() > FEW || clip.interpolation.sides().repeats() {
            return None;
        }
        // Of tracks in several parts most items would be for nothing.
        let parts = clip.groups.iter().map(|group| parts_in(group, window));
        let are_whole = parts.map(<[Part]>::len).sum::<usize>() == window.tracks.len();
        are_whole.then_some(Self {
            clip,
            timeline,
            times,
            stride: *stride,
            window,
            shift,
        })
    }

    /// Items that it takes, and distances.
    pub(super) fn count(&self) -> usize {
        self.window.len()
    }

    /// Writes them.
    pub(super) fn write(&self, mut items: &mut [Item], mut distances: &mut [f32]) -> Work {
        let samples = self.window.samples.len();
        let parts_each = parts_per_chunk(self.window);
        let mut pieces = Vec::new();
        let (mut groups, mut first) = (Vec::new(), 0);
        for (group, prepared) in self.clip.groups.iter().enumerate() {
            let parts = parts_in(prepared, self.window);
            if parts.is_empty() {
                continue;
            }
            groups.push((group, (parts.len() * samples) as u32));
            for parts in parts.chunks(parts_each) {
                let count = parts.len() * samples;
                let (own_items, other_items) = items.split_at_mut(count);
                let (own_distances, others) = distances.split_at_mut(count);
                (items, distances) = (other_items, others);
                pieces.push(Piece {
                    all: self,
                    prepared,
                    parts,
                    first,
                    items: own_items,
                    distances: own_distances,
                    patches: Vec::new(),
                });
                first += count;
            }
        }
        let patches = pieces.into_par_iter().flat_map_iter(|mut piece| {
            in_lanes(&mut piece);
            piece.patches
        });
        Work {
            patches: patches.collect(),
            groups,
        }
    }
}

/// What one thread writes.
struct Piece<'a> {
    all: &'a FewItems<'a>,
    prepared: &'a Prepared,
    parts: &'a [Part],
    /// The place of its first item.
    first: usize,
    items: &'a mut [Item],
    distances: &'a mut [f32],
    patches: Vec<Patch>,
}

impl InLanes for Piece<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let FewItems {
            times,
            stride,
            window,
            shift,
            ..
        } = *self.all;
        let mut places = self.items.iter_mut().zip(&mut *self.distances);
        let mut first = self.first as i32;
        for part in self.parts {
            let track = part.track as usize;
            let own = &times[track * stride..];
            for sample in window.samples.clone() {
                let source = match self.prepared.source_at(part, own[sample]) {
                    Some(source) => source,
                    None => source_outside(self.prepared, part, own, sample),
                };
                let place = window.place(track, sample);
                let mut from_middle = 0.0;
                match source {
                    RunSource::Segment {
                        distance: Distance::Seconds { middle },
                        ..
                    } => from_middle = round_f32(own[sample] - middle),
                    RunSource::Exact { index, parameter } => {
                        let Self { all, prepared, .. } = self;
                        let exact = prepared.exact(index, parameter, all.timeline, track, sample);
                        self.patches.push((place, exact));
                    }
                    _ => {}
                }
                if let Some((own_item, own_distance)) = places.next() {
                    *own_item = item(source, place as u32 + shift, 1, first);
                    *own_distance = from_middle;
                }
                first += 1;
            }
        }
    }
}

/// What gives a sample of a part where that takes more than to look. Apart, so that what is
/// usual stays small.
#[inline(never)]
fn source_outside(prepared: &Prepared, part: &Part, times: &[f64], sample: usize) -> RunSource {
    // Replaced: every time lies somewhere in a whole track, or outside.
    let mut source = RunSource::Constant(0);
    let mut found = |run: Run| source = run.source;
    prepared.time_runs(part, times, sample..sample + 1, &mut found);
    source
}
