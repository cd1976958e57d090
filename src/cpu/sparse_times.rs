//! Sparse times: a few explicit times of each of many tracks, such as the poses of a crowd. Each
//! lane evaluates one sample, and no runs are listed.

use bytemuck::Zeroable;

use crate::cpu::evaluate::one;
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, PartRef};
use crate::shader::{ArcSegment, Form};
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::{Lanes, canonical};
use crate::time::runs::RunSource;
use crate::twin::evaluate_arc::{norm_squared, on_arc};

/// Samples that are evaluated together.
const LANES: usize = 64;

/// A window of a clip at sparse times, evaluated by one lookup for each sample.
pub(crate) struct FewTimes<'a> {
    pub(crate) clip: &'a ClipData,
    /// Sample `k` of track `t` lies at `times[t × stride + k]`.
    pub(crate) times: &'a [f64],
    pub(crate) stride: usize,
    pub(crate) window: &'a Window,
    /// `[track][sample]`.
    pub(crate) output: &'a mut [[f32; 4]],
    /// Tracks with a sample that takes more than a lookup, outside the keys or on a curve that is
    /// evaluated in f64, as places in the window: the caller evaluates their rows.
    pub(crate) others: Vec<usize>,
}

/// Samples on arcs, gathered until the block is full.
#[derive(Zeroable)]
struct Block {
    middles: [[f32; 4]; LANES],
    tangents: [[f32; 4]; LANES],
    parameters: [f32; LANES],
    /// Where each sample is stored in the output.
    places: [usize; LANES],
    count: usize,
}

impl InLanes for FewTimes<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let samples = self.window.samples.clone();
        let mut block = Block::zeroed();
        for (i, track) in self.window.tracks.clone().enumerate() {
            let Some(PartRef { prepared, part }) = self.clip.only_part(track) else {
                self.others.push(i);
                continue;
            };
            let times = &self.times[track * self.stride..][samples.clone()];
            for (k, &time) in times.iter().enumerate() {
                let place = i * samples.len() + k;
                let (index, distance, affine) = match prepared.spans.source_at(part, time) {
                    Some(RunSource::Constant(index)) => {
                        self.output[place] = prepared.constants[index as usize];
                        continue;
                    }
                    Some(RunSource::Segment(index, distance, affine)) => {
                        (index as usize, distance.of(0, || time), affine)
                    }
                    _ => {
                        self.others.push(i);
                        break;
                    }
                };
                let segments = &prepared.segments;
                match segments.form {
                    Form::Arc => {
                        let parameter = distance * affine.scale + affine.offset;
                        block.push(&segments.arcs[index], parameter, place);
                        if block.count == LANES {
                            block.flush::<L>(self.output);
                        }
                    }
                    Form::Polynomial => {
                        let segment = &segments.polynomials[index];
                        self.output[place] = one(segment, affine, distance);
                    }
                }
            }
        }
        block.flush::<L>(self.output);
    }
}

impl Block {
    #[inline(always)]
    fn push(&mut self, segment: &ArcSegment, parameter: f32, place: usize) {
        self.middles[self.count] = segment.middle;
        self.tangents[self.count] = segment.tangent;
        self.parameters[self.count] = parameter;
        self.places[self.count] = place;
        self.count += 1;
    }

    #[inline(always)]
    fn flush<L: Lanes>(&mut self, output: &mut [[f32; 4]]) {
        let mut rotations = [[0.0; 4]; LANES];
        for j in (0..self.count).step_by(L::COUNT) {
            let middle = L::load_rotations(&self.middles[j..]);
            let tangent = L::load_rotations(&self.tangents[j..]);
            let parameter = L::load(&self.parameters[j..]);
            let found = on_arc(middle, tangent, norm_squared(tangent), parameter);
            L::store_rotations(canonical(found), &mut rotations[j..j + L::COUNT]);
        }
        for (&place, rotation) in self.places[..self.count].iter().zip(rotations) {
            output[place] = rotation;
        }
        self.count = 0;
    }
}
