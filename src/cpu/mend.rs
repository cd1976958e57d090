//! Samples that were left out because their curves turn too much to be made straight from
//! the keys: their intervals alone are prepared.

use std::ops::Range;

use rayon::prelude::*;

use super::engine::CpuEngine;
use crate::clock::{Ticks, Timeline};
use crate::cycle::Cycle;
use crate::engine::Error;
use crate::method::Interpolation;
use crate::prepare::{BATCH, PartRef, Preparation, Prepared, flip};
use crate::tracks::TrackSet;

/// Intervals between two that are wanted, up to which they are prepared together.
const APART: usize = 16;

/// Some samples of a track.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) set: &'a TrackSet,
    pub(crate) index: usize,
    pub(crate) interpolation: &'a Interpolation,
    pub(crate) timeline: &'a Timeline,
    /// The first of them.
    pub(crate) first: usize,
    /// A key that none of them lies before, and its sign.
    pub(crate) key: usize,
    pub(crate) sign: f32,
}

/// Samples that were left out, and those between them.
struct Piece {
    intervals: Range<usize>,
    samples: Range<usize>,
    sign: f32,
}

impl CpuEngine {
    /// Works out what is 0 in a row.
    pub(crate) fn mend(&self, row: Row<'_>, mut output: &mut [[f32; 4]]) -> Result<(), Error> {
        let pieces = row.pieces(output);
        let mut from = row.first;
        let mut work = Vec::with_capacity(pieces.len());
        for piece in pieces {
            let others = &mut output[piece.samples.start - from..];
            let (own, others) = others.split_at_mut(piece.samples.len());
            (from, output) = (piece.samples.end, others);
            work.push((piece, own));
        }
        let new = || {
            let mut preparation = Preparation::new(row.interpolation);
            preparation.only_for(row.timeline, row.set);
            (Prepared::new(row.interpolation), preparation)
        };
        let track = row.set.track(row.index);
        work.into_par_iter().with_min_len(64).try_for_each_init(
            new,
            |(prepared, preparation), (piece, own)| {
                prepared.clear();
                preparation.push_piece(prepared, track, row.index, piece.intervals)?;
                if piece.sign < 0.0 {
                    prepared.negate(row.interpolation);
                }
                let part = PartRef {
                    prepared,
                    part: &prepared.parts[0],
                };
                Ok(self.part(part, row.timeline, &Cycle::own(piece.samples), own)?)
            },
        )
    }
}

impl<'a> Row<'a> {
    /// All samples of a track.
    pub(crate) fn whole(
        set: &'a TrackSet,
        index: usize,
        interpolation: &'a Interpolation,
        timeline: &'a Timeline,
    ) -> Self {
        Self {
            set,
            index,
            interpolation,
            timeline,
            first: 0,
            key: 0,
            sign: 1.0,
        }
    }

    fn pieces(&self, output: &[[f32; 4]]) -> Vec<Piece> {
        let (times, _) = self.set.times_and_keys(self.index);
        let last = times.len() - 1;
        let mut pieces: Vec<Piece> = Vec::new();
        let left_out = |(_, rotation): &(usize, &[f32; 4])| **rotation == [0.0; 4];
        for (i, _) in output.iter().enumerate().filter(left_out) {
            let sample = self.first + i;
            if matches!(self.timeline.ticks, Ticks::Times { .. }) {
                // They may be in any order.
                return vec![Piece {
                    intervals: 0..last,
                    samples: self.first..self.first + output.len(),
                    sign: 1.0,
                }];
            }
            let time = self.timeline.time(self.index, sample);
            let interval = times.partition_point(|&key| key <= time).saturating_sub(1);
            // Its neighbours too: a sample within rounding of a key is that key.
            let start = interval.saturating_sub(1).max(self.key);
            let end = (interval + 2).min(last);
            match pieces.last_mut() {
                Some(piece)
                    if start <= piece.intervals.end + APART && piece.intervals.len() < BATCH =>
                {
                    piece.intervals.end = end;
                    piece.samples.end = sample + 1;
                }
                _ => pieces.push(Piece {
                    intervals: start..end,
                    samples: sample..sample + 1,
                    sign: 1.0,
                }),
            }
        }
        self.align(&mut pieces);
        pieces
    }

    /// The signs of the first keys of pieces.
    fn align(&self, pieces: &mut [Piece]) {
        let keys: &[[f32; 4]] = bytemuck::cast_slice(self.set.times_and_keys(self.index).1);
        let (mut key, mut sign) = (self.key, self.sign);
        for piece in pieces {
            while key < piece.intervals.start {
                sign *= flip(keys[key], keys[key + 1]);
                key += 1;
            }
            // Pieces overlap by their neighbours.
            while key > piece.intervals.start {
                key -= 1;
                sign *= flip(keys[key], keys[key + 1]);
            }
            piece.sign = sign;
        }
    }
}
