//! A few explicit times of each of many tracks, as a crowd's poses are: a sample to a lane,
//! and no run for each.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::dispatch::InLanes;
use super::evaluate::{Affine, Evaluate, canonical, one};
use super::lanes::Lanes;
use crate::frame_clock::finite_scale;
use crate::numeric::round_f32;
use crate::prepare::{ClipData, NONE, PartRef, Source};
use crate::segment::{ArcSegment, PolynomialSegment, Segments};
use crate::window::Window;

/// Samples worked out together.
const LANES: usize = 64;

/// Multiples of this many: the lanes of the widest vector.
const BLOCK: usize = 16;

/// What a window of a clip is made of, where that is told by looking.
pub(super) struct FewTimes<'a> {
    pub(super) clip: &'a ClipData,
    /// Sample `k` of track `t` lies at `times[t × stride + k]`.
    pub(super) times: &'a [f64],
    pub(super) stride: usize,
    pub(super) window: &'a Window,
    /// `[track][sample]`.
    pub(super) output: &'a mut [[f32; 4]],
    /// Places of the tracks in the window that are left to do.
    pub(super) others: Vec<usize>,
}

/// Samples of arcs that wait.
struct Block {
    arcs: [ArcSegment; LANES],
    parameters: [f32; LANES],
    /// In the output.
    places: [usize; LANES],
    count: usize,
}

/// What gives one sample.
enum One<'a> {
    Constant([f32; 4]),
    Arc(&'a ArcSegment, f32),
    Polynomial(&'a PolynomialSegment, Affine, f32),
}

impl InLanes for FewTimes<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let samples = self.window.samples.clone();
        let nothing = ArcSegment {
            middle: [0.0; 4],
            tangent: [0.0; 4],
        };
        let mut block = Block {
            arcs: [nothing; LANES],
            parameters: [0.0; LANES],
            places: [0; LANES],
            count: 0,
        };
        for (i, track) in self.window.tracks.clone().enumerate() {
            let Some(part) = self.clip.only_part(track) else {
                self.others.push(i);
                continue;
            };
            let times = &self.times[track * self.stride..][samples.clone()];
            for (k, &time) in times.iter().enumerate() {
                let place = i * samples.len() + k;
                match part.at_time(time) {
                    Some(One::Constant(rotation)) => self.output[place] = rotation,
                    Some(One::Polynomial(segment, affine, distance)) => {
                        self.output[place] = one(segment, affine, distance);
                    }
                    Some(One::Arc(segment, parameter)) => {
                        block.arcs[block.count] = *segment;
                        block.parameters[block.count] = parameter;
                        block.places[block.count] = place;
                        block.count += 1;
                        if block.count == LANES {
                            block.flush(self.output);
                        }
                    }
                    None => {
                        self.others.push(i);
                        break;
                    }
                }
            }
        }
        block.flush(self.output);
    }
}

impl Block {
    #[inline(always)]
    fn flush(&mut self, output: &mut [[f32; 4]]) {
        let [mut x, mut y, mut z, mut w] = [[0.0; LANES]; 4];
        for j in 0..self.count.next_multiple_of(BLOCK) {
            let arc = &self.arcs[j];
            let q = arc.evaluate(arc.constant(), self.parameters[j]);
            x[j] = canonical(q[0]);
            y[j] = canonical(q[1]);
            z[j] = canonical(q[2]);
            w[j] = canonical(q[3]);
        }
        for j in 0..self.count {
            output[self.places[j]] = [x[j], y[j], z[j], w[j]];
        }
        self.count = 0;
    }
}

impl<'a> PartRef<'a> {
    /// What gives the rotation at a time; nothing where that takes more than to look.
    #[inline(always)]
    fn at_time(self, time: f64) -> Option<One<'a>> {
        let PartRef { prepared, part } = self;
        let starts = &prepared.spans.starts[part.spans.clone()];
        let i = match starts.len() {
            0 => return None,
            1 => 0,
            _ => starts
                .partition_point(|&start| start <= time)
                .saturating_sub(1),
        };
        let start = starts[i];
        let end = starts.get(i + 1).copied().unwrap_or(part.end);
        let span = part.spans.start + i;
        if !(start <= time && time < end) {
            return None;
        }
        // Written out: closures are not always inlined.
        let key = prepared.spans.keys[span];
        if time == start && key != NONE {
            return Some(One::Constant(prepared.constants[key as usize]));
        }
        let index = match prepared.spans.sources[span] {
            Source::Constant(index) => {
                return Some(One::Constant(prepared.constants[index as usize]));
            }
            Source::Exact(_) => return None,
            Source::Segment(index) => index as usize,
        };
        // As by a run.
        let seconds = end - start;
        let distance = round_f32(time - (start + seconds * 0.5));
        let affine = Affine {
            scale: finite_scale(1.0 / seconds),
            offset: 0.0,
        };
        match &prepared.segments {
            Segments::Arc(arcs) => {
                let parameter = distance * affine.scale + affine.offset;
                Some(One::Arc(&arcs[index], parameter))
            }
            Segments::Polynomial(all) => Some(One::Polynomial(&all[index], affine, distance)),
        }
    }
}
