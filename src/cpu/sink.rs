//! Where the samples of a run are stored: in a slice by ordinary stores, or in whole cache lines
//! by streaming stores.

use std::slice;

use crate::simd::lanes::Lanes;
use crate::simd::line::Line;
use crate::twin::evaluate::{Evaluate, Parameters};

/// The most samples that one turn of the evaluation loop makes.
const MOST: usize = 16;

/// Evaluates a run in turns of the loop, [`Evaluate::samples`] samples each. With `FILTER`
/// components below 2^-64 become 0; with `FAR` samples are begun several turns ahead.
pub(crate) struct Turns<'a, L: Lanes, S: Evaluate, P, const FILTER: bool, const FAR: bool> {
    pub(crate) segment: &'a S,
    pub(crate) constant: L,
    pub(crate) begun: S::Begun<L>,
    pub(crate) parameters: P,
}

/// The turns of a run, whatever their parameters.
pub(crate) trait NextTurn<L: Lanes, S: Evaluate> {
    fn next(&mut self) -> S::Vectors<L>;
}

impl<L: Lanes, S: Evaluate, P: Parameters<L>, const FILTER: bool, const FAR: bool> NextTurn<L, S>
    for Turns<'_, L, S, P, FILTER, FAR>
{
    #[inline(always)]
    fn next(&mut self) -> S::Vectors<L> {
        let (own, parameters) = (self.begun, &mut self.parameters);
        let (begun, vectors) =
            (self.segment).evaluate::<L, FILTER, FAR>(self.constant, own, parameters);
        self.begun = begun;
        vectors
    }
}

pub(crate) trait Sink {
    /// Whether its stores bypass the caches.
    const STREAMS: bool;

    /// Stores the first `count` samples.
    fn take<L: Lanes, S: Evaluate>(self, count: usize, turns: impl NextTurn<L, S>);
}

/// Ordinary stores. Elements after `count` may be overwritten, up to the end of a turn.
impl Sink for &mut [[f32; 4]] {
    const STREAMS: bool = false;

    #[inline(always)]
    fn take<L: Lanes, S: Evaluate>(self, count: usize, mut turns: impl NextTurn<L, S>) {
        let samples = S::samples::<L>();
        let whole = count.next_multiple_of(samples).min(self.len());
        let mut all = self[..whole].chunks_exact_mut(samples);
        for rotations in &mut all {
            store(&turns.next(), rotations);
        }
        let rest = all.into_remainder();
        if !rest.is_empty() {
            let mut rotations = Rotations([[0.0; 4]; MOST]);
            store(&turns.next(), &mut rotations.0[..samples]);
            rest.copy_from_slice(&rotations.0[..rest.len()]);
        }
    }
}

#[repr(align(64))]
struct Rotations([[f32; 4]; MOST]);

#[inline(always)]
fn store<L: Lanes>(vectors: &impl AsRef<[L]>, rotations: &mut [[f32; 4]]) {
    let places = rotations.chunks_exact_mut(L::COUNT / 4);
    for (vector, place) in vectors.as_ref().iter().zip(places) {
        vector.store_side_by_side(place);
    }
}

/// Streaming stores: the whole cache lines of the result, and the staging lines before and after
/// them. The first sample of the first turn lies at the start of a line.
pub(crate) struct Places<'a> {
    /// The first line as it is staged, and how many of its rotations are there already; these
    /// stay.
    pub(crate) begun: (Line, usize),
    pub(crate) whole: &'a mut [Line],
    /// The staging line for the samples after the whole lines.
    pub(crate) rest: &'a mut Line,
}

impl Sink for Places<'_> {
    const STREAMS: bool = true;

    #[inline(always)]
    fn take<L: Lanes, S: Evaluate>(self, count: usize, mut turns: impl NextTurn<L, S>) {
        let rotations = L::COUNT / 4;
        let of_turn = S::samples::<L>() / rotations;
        let (begun, there) = self.begun;
        let begun: &[L::Block] = bytemuck::cast_slice(slice::from_ref(&begun));
        let whole: &mut [L::Block] = bytemuck::cast_slice_mut(self.whole);
        let rest = bytemuck::cast_slice_mut(slice::from_mut(self.rest));
        // From here on samples are counted in vectors.
        let (count, mut made) = (count.div_ceil(rotations), 0);
        while made < begun.len() {
            for (i, vector) in (made..).zip(turns.next().as_ref()) {
                let vector = match begun.get(i) {
                    Some(own) => {
                        let there = there.saturating_sub(i * rotations).min(rotations);
                        vector.behind(own, there)
                    }
                    None => *vector,
                };
                put(vector, i, whole, rest);
            }
            made += of_turn;
        }
        let first = made.min(whole.len());
        let mut all = whole[first..].chunks_exact_mut(of_turn);
        for places in &mut all {
            for (vector, place) in turns.next().as_ref().iter().zip(places) {
                vector.store_past_caches(place);
            }
            made += of_turn;
        }
        let whole = all.into_remainder();
        let left = count.saturating_sub(made);
        for first in (0..left).step_by(of_turn) {
            for (i, vector) in (first..).zip(turns.next().as_ref()) {
                put(*vector, i, whole, rest);
            }
        }
    }
}

/// Stores the `i`th vector: into a whole line, or into the rest after the whole lines.
#[inline(always)]
fn put<L: Lanes>(vector: L, i: usize, whole: &mut [L::Block], rest: &mut [L::Block]) {
    if let Some(place) = whole.get_mut(i) {
        vector.store_past_caches(place);
    } else if let Some(place) = rest.get_mut(i - whole.len()) {
        vector.store_side_by_side(bytemuck::cast_slice_mut(slice::from_mut(place)));
    }
}
