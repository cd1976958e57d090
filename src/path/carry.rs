//! The frame that never turns about its direction, carried along stretches.
//!
//! In a piece with the direction m at its middle, `q(t) = A(m→w) q_m R_z(ψ)`, with the least turn
//! `A = [1 + m·w; m × w] / |·|` from m to the direction w, and `ψ = ∫ (m × w)·w' / (1 + m·w) dt` from
//! the middle on. Only the constant roll of a piece depends on the pieces before it.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::{DQuat, DVec3};

use crate::fit::double::fit::MOST;
use crate::fit::double::intervals::at;
use crate::math::quaternion::{Quaternion, sine_cosine};
use crate::path::lanes::{self, Rolled, Rolling, Row, find_directions};
use crate::path::route::{Route, Stretch};
use crate::simd::dispatch::in_lanes;
use crate::threads::stop;

/// The integrand of ψ is the polynomial through so many Chebyshev nodes of a piece.
pub(crate) const NODES: usize = 11;

/// The largest sum of its last two Chebyshev coefficients: the integral errs by a tenth of that.
const TOLERANCE: f64 = 3e-10;

/// No piece is shorter.
const SHORTEST: f64 = 1e-12;

/// A stretch has no more pieces: where numbers are so large or so near that none ever fits, they stay as
/// they are.
const MOST_PIECES: usize = 1 << 14;

/// The Chebyshev nodes cos(π (k + ½) / 11), and the polynomials there: cos(j π (k + ½) / 11) for node
/// k and degree j.
pub(crate) struct Chebyshev {
    nodes: [f64; NODES],
    pub(crate) cosines: [[f64; NODES]; NODES],
}

pub(crate) static CHEBYSHEV: LazyLock<Chebyshev> = LazyLock::new(|| {
    let cosine =
        |j: usize, k: usize| sine_cosine(PI * j as f64 * (k as f64 + 0.5) / NODES as f64).1;
    Chebyshev {
        nodes: std::array::from_fn(|k| cosine(1, k)),
        cosines: std::array::from_fn(|k| std::array::from_fn(|j| cosine(j, k))),
    }
});

/// The places of a piece's middle and ends, behind those of the nodes.
pub(crate) const MIDDLE: usize = NODES;
const FROM: usize = NODES + 1;
const TO: usize = NODES + 2;
const PLACES: usize = NODES + 3;

/// A piece of a stretch.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// The direction and the rotation at the middle.
    pub(crate) middle: DVec3,
    pub(crate) base: DQuat,
    /// Chebyshev coefficients of ψ.
    pub(crate) roll: [f64; NODES + 1],
}

/// A piece whose rotation is not known yet, and what turns one from its start to its end.
struct Unturned {
    stretch: usize,
    piece: Piece,
    /// The directions at its ends.
    ways: [DVec3; 2],
    /// The least turns to these from that at the middle.
    turns: [DQuat; 2],
    /// The rolls from the start to the middle, and from there to the end.
    rolls: [DQuat; 2],
}

/// The pieces of some stretches, before they are turned.
pub(crate) struct Uncarried {
    /// In the order of stretches and parameters.
    pieces: Vec<Unturned>,
    /// Where the pieces of each stretch begin, and where those of the last one end.
    firsts: Vec<usize>,
}

impl Uncarried {
    /// Cuts stretches of any paths into pieces in which the roll is exact.
    pub(crate) fn new(stretches: &[(&Route, &Stretch)]) -> Self {
        let mut block = Box::<Block>::default();
        let whole = |(stretch, (_, own)): (usize, &(&Route, &Stretch))| Waiting {
            stretch,
            from: own.from,
            to: own.to,
        };
        let mut waiting: Vec<Waiting> = stretches.iter().enumerate().map(whole).collect();
        let mut counts = vec![1; stretches.len()];
        let mut pieces: Vec<Unturned> = Vec::with_capacity(stretches.len());
        let mut done = 0;
        while done < waiting.len() {
            if stop::is_stopped() {
                // Whoever prepares paths looks again when this is done.
                (pieces, counts) = (Vec::new(), vec![0; stretches.len()]);
                break;
            }
            let some = done..waiting.len().min(done + MOST);
            done = some.end;
            block.find(stretches, &waiting[some.clone()]);
            for (lane, place) in some.enumerate() {
                let own @ Waiting { stretch, from, to } = waiting[place];
                let middle = 0.5 * (from + to);
                let is_finest = to - from <= SHORTEST || counts[stretch] > MOST_PIECES;
                let rolled = &block.rolled;
                let is_exact = rolled.least[lane] > 0.5 && rolled.rest[lane] <= TOLERANCE;
                if !is_exact && !is_finest && from < middle && middle < to {
                    counts[stretch] += 1;
                    for (from, to) in [(from, middle), (middle, to)] {
                        waiting.push(Waiting { stretch, from, to });
                    }
                    continue;
                }
                pieces.push(block.unturned(lane, own));
            }
        }
        // Most often no stretch was cut, and they are in order already.
        pieces.sort_by(|a, b| {
            let by_place = a.piece.from.total_cmp(&b.piece.from);
            a.stretch.cmp(&b.stretch).then(by_place)
        });
        let mut firsts = Vec::with_capacity(stretches.len() + 1);
        firsts.push(0);
        for count in counts {
            firsts.push(firsts[firsts.len() - 1] + count);
        }
        Self { pieces, firsts }
    }

    fn of(&self, stretch: usize) -> &[Unturned] {
        &self.pieces[self.firsts[stretch]..self.firsts[stretch + 1]]
    }

    /// The directions at both ends of a stretch.
    pub(crate) fn ends(&self, stretch: usize) -> [DVec3; 2] {
        let own = self.of(stretch);
        [own[0].ways[0], own[own.len() - 1].ways[1]]
    }

    /// Carries a rotation along a stretch, adds its pieces to others, and returns the rotation at the
    /// end.
    pub(crate) fn carry(&self, stretch: usize, start: DQuat, pieces: &mut Vec<Piece>) -> DQuat {
        let mut rotation = start;
        for own in self.of(stretch) {
            let unrolled = own.turns[0].conjugate() * rotation;
            let base = unrolled * own.rolls[0];
            rotation = own.turns[1] * (base * own.rolls[1]);
            pieces.push(Piece {
                base,
                ..own.piece.clone()
            });
        }
        rotation
    }
}

/// A part of a stretch that waits to become a piece.
#[derive(Clone, Copy)]
struct Waiting {
    stretch: usize,
    from: f64,
    to: f64,
}

/// Pieces that are found at once, one in each lane.
#[derive(Default)]
struct Block {
    places: [Row; PLACES],
    ways: [[Row; 3]; PLACES],
    changes: [[Row; 3]; PLACES],
    rolled: Rolled,
}

impl Block {
    fn find(&mut self, stretches: &[(&Route, &Stretch)], waiting: &[Waiting]) {
        for (lane, own) in waiting.iter().enumerate() {
            (self.places[FROM][lane], self.places[TO][lane]) = (own.from, own.to);
        }
        let ends = [self.places[FROM], self.places[TO]];
        let [from, to] = &ends;
        let centers: Row = std::array::from_fn(|lane| 0.5 * (from[lane] + to[lane]));
        let halves: Row = std::array::from_fn(|lane| 0.5 * (to[lane] - from[lane]));
        for (row, node) in self.places.iter_mut().zip(&CHEBYSHEV.nodes) {
            for ((place, center), half) in row.iter_mut().zip(&centers).zip(&halves) {
                *place = center + half * node;
            }
        }
        self.places[MIDDLE] = centers;
        let own = waiting.iter().map(|own| stretches[own.stretch]);
        let changes = Some(&mut self.changes);
        find_directions(own, &self.places, &mut self.ways, changes);
        in_lanes(&mut Rolling {
            count: waiting.len(),
            ways: &self.ways,
            changes: &self.changes,
            ends: &ends,
            own: &mut self.rolled,
        });
    }

    fn unturned(&self, lane: usize, Waiting { stretch, from, to }: Waiting) -> Unturned {
        let way = |place: usize| DVec3::from_array(at(&self.ways[place], lane));
        let found = &self.rolled;
        let roll = |end: usize| {
            let [sine, cosine] = at(&found.halves[end], lane);
            DQuat::from_xyzw(0.0, 0.0, sine, cosine)
        };
        let turn = |end: usize| turn_of(at(&found.turns[end], lane));
        Unturned {
            stretch,
            piece: Piece {
                from,
                to,
                middle: way(MIDDLE),
                base: DQuat::IDENTITY,
                roll: at(&found.roll, lane),
            },
            ways: [way(FROM), way(TO)],
            turns: [turn(0), turn(1)],
            rolls: [roll(0), roll(1)],
        }
    }
}

/// The turn by the least angle from one direction to another that is not opposite.
pub(crate) fn least_turn(from: DVec3, to: DVec3) -> DQuat {
    turn_of(lanes::least_turn(from.to_array(), to.to_array()))
}

/// A turn, or none where numbers overflow.
fn turn_of(turn: Quaternion) -> DQuat {
    let turn = DQuat::from_array(turn);
    if turn.is_nan() { DQuat::IDENTITY } else { turn }
}

/// The rotation carried over a corner: by the least turn, and where the direction is reversed by half
/// a turn about the body's y axis.
pub(crate) fn around_corner(rotation: DQuat, from: DVec3, to: DVec3) -> DQuat {
    if (from + to).length() < REVERSED {
        let half_turn = DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0);
        return least_turn(-from, to) * rotation * half_turn;
    }
    least_turn(from, to) * rotation
}

/// Directions nearer than this to being opposite are reversed.
const REVERSED: f64 = 1e-6;

/// The rotation about z by an angle.
pub(crate) fn about_z(angle: f64) -> DQuat {
    let (sine, cosine) = sine_cosine(0.5 * angle);
    DQuat::from_xyzw(0.0, 0.0, sine, cosine)
}
