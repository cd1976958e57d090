//! The frame that does not rotate about its direction, carried along stretches.
//!
//! In a piece with the direction m at its middle, `q(t) = A(m→w) q_m R_z(ψ)`. Here `A = [1 + m·w; m × w] / |·|` is
//! the shortest rotation (the swing) from m to the direction w, and `ψ = ∫ (m × w)·w' / (1 + m·w) dt` is the roll
//! since the middle. Only the constant roll of a piece depends on the pieces before it.

use glam::{DQuat, DVec3};

use crate::fit::block::at;
use crate::math::quaternion::{Quaternion, sine_cosine};
use crate::path::carried_piece::{CHEBYSHEV, CarriedPiece, FROM, MIDDLE, SAMPLES, TO};
use crate::path::lanes::{self, LaneValues, RollResults, Rolling, find_directions};
use crate::path::stretch::PathStretch;
use crate::path::timed_path::TimedPath;
use crate::simd::dispatch::in_lanes;
use crate::simd::lanes::MAX_LANES;
use crate::threads::stop;

/// The largest sum of the last two Chebyshev coefficients; the error of the integral is a tenth of it.
const TOLERANCE: f64 = 3e-10;

/// The minimum length of a piece.
const SHORTEST: f64 = 1e-12;

/// The maximum number of pieces of a stretch. For very large or very close numbers no piece fits; the pieces then
/// stay as they are.
const MAX_PIECES: usize = 1 << 14;

/// A piece whose rotation is not known yet, with the relative rotations from its start to its end.
struct RelativePiece {
    stretch: usize,
    piece: CarriedPiece,
    /// The directions at its ends.
    directions: [DVec3; 2],
    /// The shortest rotations from the direction at the middle to these directions.
    swings: [DQuat; 2],
    /// The rolls from the start to the middle, and from there to the end.
    rolls: [DQuat; 2],
}

/// The pieces of some stretches, before a frame is carried along them.
pub(crate) struct RelativePieces {
    /// In the order of stretches and parameters.
    pieces: Vec<RelativePiece>,
    /// The index of each stretch's first piece, then the number of pieces.
    firsts: Vec<usize>,
}

impl RelativePieces {
    /// Divides stretches of any paths into pieces in which the roll is exact.
    pub(crate) fn new(stretches: &[(&TimedPath, &PathStretch)]) -> Self {
        let mut block = Box::<PieceBlock>::default();
        let whole = |(stretch, (_, part)): (usize, &(&TimedPath, &PathStretch))| PieceRange {
            stretch,
            from: part.from,
            to: part.to,
        };
        let mut waiting: Vec<PieceRange> = stretches.iter().enumerate().map(whole).collect();
        let mut counts = vec![1; stretches.len()];
        let mut pieces: Vec<RelativePiece> = Vec::with_capacity(stretches.len());
        let mut done = 0;
        while done < waiting.len() {
            if stop::is_stopped() {
                // The work was stopped; the caller notices it after this function has returned.
                (pieces, counts) = (Vec::new(), vec![0; stretches.len()]);
                break;
            }
            let some = done..waiting.len().min(done + MAX_LANES);
            done = some.end;
            block.find(stretches, &waiting[some.clone()]);
            for (lane, index) in some.enumerate() {
                let range @ PieceRange { stretch, from, to } = waiting[index];
                let middle = 0.5 * (from + to);
                let is_finest = to - from <= SHORTEST || counts[stretch] > MAX_PIECES;
                let rolled = &block.rolled;
                let is_exact = rolled.least[lane] > 0.5 && rolled.tail[lane] <= TOLERANCE;
                if !is_exact && !is_finest && from < middle && middle < to {
                    counts[stretch] += 1;
                    for (from, to) in [(from, middle), (middle, to)] {
                        waiting.push(PieceRange { stretch, from, to });
                    }
                    continue;
                }
                pieces.push(block.relative_piece(lane, range));
            }
        }
        // Usually no stretch was divided, and the pieces are already sorted.
        pieces.sort_by(|a, b| {
            let by_start = a.piece.from.total_cmp(&b.piece.from);
            a.stretch.cmp(&b.stretch).then(by_start)
        });
        let mut firsts = Vec::with_capacity(stretches.len() + 1);
        firsts.push(0);
        for count in counts {
            firsts.push(firsts[firsts.len() - 1] + count);
        }
        Self { pieces, firsts }
    }

    fn of(&self, stretch: usize) -> &[RelativePiece] {
        &self.pieces[self.firsts[stretch]..self.firsts[stretch + 1]]
    }

    /// The directions at both ends of a stretch.
    pub(crate) fn ends(&self, stretch: usize) -> [DVec3; 2] {
        let pieces = self.of(stretch);
        [
            pieces[0].directions[0],
            pieces[pieces.len() - 1].directions[1],
        ]
    }

    /// Carries a rotation along a stretch, appends its pieces to a list, and returns the rotation at its end.
    pub(crate) fn carry(
        &self,
        stretch: usize,
        start: DQuat,
        pieces: &mut Vec<CarriedPiece>,
    ) -> DQuat {
        let mut rotation = start;
        for relative in self.of(stretch) {
            let unrolled = relative.swings[0].conjugate() * rotation;
            let base = unrolled * relative.rolls[0];
            rotation = relative.swings[1] * (base * relative.rolls[1]);
            pieces.push(CarriedPiece {
                base,
                ..relative.piece.clone()
            });
        }
        rotation
    }
}

/// A part of a stretch that is to become a piece.
#[derive(Clone, Copy)]
struct PieceRange {
    stretch: usize,
    from: f64,
    to: f64,
}

/// Pieces that are computed at once, one in each lane.
#[derive(Default)]
struct PieceBlock {
    parameters: [LaneValues; SAMPLES],
    directions: [[LaneValues; 3]; SAMPLES],
    derivatives: [[LaneValues; 3]; SAMPLES],
    rolled: RollResults,
}

impl PieceBlock {
    fn find(&mut self, stretches: &[(&TimedPath, &PathStretch)], waiting: &[PieceRange]) {
        for (lane, range) in waiting.iter().enumerate() {
            (self.parameters[FROM][lane], self.parameters[TO][lane]) = (range.from, range.to);
        }
        let ends = [self.parameters[FROM], self.parameters[TO]];
        let [from, to] = &ends;
        let centers: LaneValues = std::array::from_fn(|lane| 0.5 * (from[lane] + to[lane]));
        let halves: LaneValues = std::array::from_fn(|lane| 0.5 * (to[lane] - from[lane]));
        for (row, node) in self.parameters.iter_mut().zip(&CHEBYSHEV.nodes) {
            for ((parameter, center), half) in row.iter_mut().zip(&centers).zip(&halves) {
                *parameter = center + half * node;
            }
        }
        self.parameters[MIDDLE] = centers;
        let selected = waiting.iter().map(|range| stretches[range.stretch]);
        let derivatives = Some(&mut self.derivatives);
        find_directions(
            selected,
            &self.parameters,
            &mut self.directions,
            derivatives,
        );
        in_lanes(&mut Rolling {
            count: waiting.len(),
            directions: &self.directions,
            derivatives: &self.derivatives,
            ends: &ends,
            results: &mut self.rolled,
        });
    }

    fn relative_piece(
        &self,
        lane: usize,
        PieceRange { stretch, from, to }: PieceRange,
    ) -> RelativePiece {
        let direction = |sample: usize| DVec3::from_array(at(&self.directions[sample], lane));
        let found = &self.rolled;
        let roll = |end: usize| {
            let [sine, cosine] = at(&found.halves[end], lane);
            DQuat::from_xyzw(0.0, 0.0, sine, cosine)
        };
        let swing = |end: usize| or_identity(at(&found.swings[end], lane));
        RelativePiece {
            stretch,
            piece: CarriedPiece {
                from,
                to,
                middle: direction(MIDDLE),
                base: DQuat::IDENTITY,
                roll: at(&found.roll, lane),
            },
            directions: [direction(FROM), direction(TO)],
            swings: [swing(0), swing(1)],
            rolls: [roll(0), roll(1)],
        }
    }
}

/// The shortest rotation from one direction to another that is not opposite.
pub(crate) fn rotation_between(from: DVec3, to: DVec3) -> DQuat {
    or_identity(lanes::rotation_between(from.to_array(), to.to_array()))
}

/// The rotation, or the identity if numbers overflow.
fn or_identity(rotation: Quaternion) -> DQuat {
    let rotation = DQuat::from_array(rotation);
    if rotation.is_nan() {
        DQuat::IDENTITY
    } else {
        rotation
    }
}

/// The rotation carried around a corner: by the shortest rotation, or by 180° about the body's y axis if the
/// direction is reversed.
pub(crate) fn around_corner(rotation: DQuat, from: DVec3, to: DVec3) -> DQuat {
    if (from + to).length() < REVERSED {
        let half_turn = DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0);
        return rotation_between(-from, to) * rotation * half_turn;
    }
    rotation_between(from, to) * rotation
}

/// Directions count as reversed if they are nearer than this to being opposite.
const REVERSED: f64 = 1e-6;

/// The rotation about z by an angle.
pub(crate) fn about_z(angle: f64) -> DQuat {
    let (sine, cosine) = sine_cosine(0.5 * angle);
    DQuat::from_xyzw(0.0, 0.0, sine, cosine)
}
