//! The frame that never turns about its direction, carried along stretches.
//!
//! In a piece with the direction m at its middle, `q(t) = A(m→w) q_m R_z(ψ)`, with the least turn
//! `A = [1 + m·w; m × w] / |·|` from m to the direction w, and `ψ = ∫ (m × w)·w' / (1 + m·w) dt` from
//! the middle on. Only the constant roll of a piece depends on the pieces before it.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::{DQuat, DVec3};

use crate::fit::double::fit::MOST;
use crate::math::quaternion::sine_cosine;
use crate::path::lanes::{Carried, Integrand, Row, Ways};
use crate::path::route::{Route, Stretch};

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
/// k and degree j, 0 beyond the last degree.
struct Chebyshev {
    nodes: [f64; NODES],
    cosines: [Row; NODES],
}

static CHEBYSHEV: LazyLock<Chebyshev> = LazyLock::new(|| {
    let cosine =
        |j: usize, k: usize| sine_cosine(PI * j as f64 * (k as f64 + 0.5) / NODES as f64).1;
    let own = |j, k| if j < NODES { cosine(j, k) } else { 0.0 };
    Chebyshev {
        nodes: std::array::from_fn(|k| cosine(1, k)),
        cosines: std::array::from_fn(|k| std::array::from_fn(|j| own(j, k))),
    }
});

/// The lanes of a piece's middle and ends, behind those of the nodes.
const MIDDLE: usize = NODES;
const FROM: usize = NODES + 1;
const TO: usize = NODES + 2;

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

/// Carries a rotation along a stretch: its pieces, and the rotation at the end.
pub(crate) fn carry(route: &Route, stretch: &Stretch, start: DQuat) -> (Vec<Piece>, DQuat) {
    let mut pieces = Vec::new();
    let mut waiting = vec![(stretch.from, stretch.to)];
    let mut rotation = start;
    while let Some((from, to)) = waiting.pop() {
        let (mut piece, fits, [first, last]) = Piece::new(route, stretch, from, to);
        let middle = 0.5 * (from + to);
        let is_finest = to - from <= SHORTEST || pieces.len() + waiting.len() >= MOST_PIECES;
        if !fits && !is_finest && from < middle && middle < to {
            waiting.extend([(middle, to), (from, middle)]);
            continue;
        }
        let unrolled = least_turn(piece.middle, first).conjugate() * rotation;
        piece.base = unrolled * about_z(-piece.roll(-1.0));
        rotation = piece.rotation(last, to);
        pieces.push(piece);
    }
    (pieces, rotation)
}

/// The rotations of a body at places of a stretch with these pieces, to which rolls are added.
pub(crate) fn rotations(
    route: &Route,
    stretch: &Stretch,
    pieces: &[Piece],
    places: &Row,
    rolls: &Row,
    body: DQuat,
) -> [Row; 4] {
    let of = |t: f64| pieces.partition_point(|piece| piece.from <= t).max(1) - 1;
    let ways = Ways::new(route, stretch, places);
    let own = places.map(of);
    let carried = |piece: usize| Carried {
        piece: &pieces[piece],
        ways: &ways,
        places,
        rolls,
        body: body.to_array(),
        rotations: [[0.0; MOST]; 4],
    };
    let mut found = carried(own[0]).find();
    // Where places lie on several pieces, each piece gives the rotations of its own.
    let [first, last] = [own.iter().min(), own.iter().max()].map(|piece| *piece.unwrap_or(&0));
    for piece in (first..=last).filter(|piece| *piece != own[0] && own.contains(piece)) {
        let other = carried(piece).find();
        for lane in (0..MOST).filter(|&lane| own[lane] == piece) {
            for (found, other) in found.iter_mut().zip(&other) {
                found[lane] = other[lane];
            }
        }
    }
    found
}

impl Piece {
    /// A piece without its rotation, whether its roll is exact, and the directions at its ends.
    fn new(route: &Route, stretch: &Stretch, from: f64, to: f64) -> (Self, bool, [DVec3; 2]) {
        let (center, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut places = [center; MOST];
        for (place, node) in places.iter_mut().zip(&CHEBYSHEV.nodes) {
            *place = center + half * node;
        }
        (places[FROM], places[TO]) = (from, to);
        let ways = Ways::new(route, stretch, &places);
        let [middle, first, last] = [MIDDLE, FROM, TO].map(|lane| DVec3::from(ways.at(lane)));
        let mut integrand = Integrand {
            ways: &ways,
            middle: middle.to_array(),
            half,
            cosines: &CHEBYSHEV.cosines,
            to_middle: [0.0; MOST],
            coefficients: [0.0; MOST],
        };
        integrand.find();
        let least = integrand.to_middle[..NODES]
            .iter()
            .fold(1.0f64, |a, &b| a.min(b));
        let own = &integrand.coefficients[..NODES];
        // The integral of T_j is (T_{j+1}/(j+1) - T_{j-1}/(j-1))/2.
        let mut roll: [f64; NODES + 1] = std::array::from_fn(|j| {
            let next = own.get(j + 1).copied().unwrap_or(0.0);
            if j == 0 {
                0.0
            } else {
                (own[j - 1] - next) / (2 * j) as f64
            }
        });
        let rest = own[NODES - 1].abs() + own[NODES - 2].abs();
        // T_j(0) is 1, 0, -1, 0 and so on.
        let at_middle: f64 = (2..=NODES)
            .step_by(2)
            .map(|j| if j % 4 == 0 { roll[j] } else { -roll[j] })
            .sum();
        roll[0] = -at_middle;
        let piece = Self {
            from,
            to,
            middle,
            base: DQuat::IDENTITY,
            roll,
        };
        let fits = least > 0.5 && rest <= TOLERANCE;
        (piece, fits, [first, last])
    }

    /// ψ at x, from -1 to 1, by Clenshaw's recurrence.
    fn roll(&self, x: f64) -> f64 {
        let (mut next, mut own) = (0.0, 0.0);
        for c in self.roll[1..].iter().rev() {
            (next, own) = (own, c + 2.0 * x * own - next);
        }
        self.roll[0] + x * own - next
    }

    fn rotation(&self, way: DVec3, t: f64) -> DQuat {
        let x = (2.0 * t - self.from - self.to) / (self.to - self.from).max(f64::MIN_POSITIVE);
        let roll = about_z(self.roll(x.clamp(-1.0, 1.0)));
        least_turn(self.middle, way) * (self.base * roll)
    }
}

/// The turn by the least angle from one direction to another that is not opposite.
pub(crate) fn least_turn(from: DVec3, to: DVec3) -> DQuat {
    let axis = from.cross(to);
    let own = DQuat::from_xyzw(axis.x, axis.y, axis.z, 1.0 + from.dot(to));
    let length = own.length();
    if length > 0.0 {
        own / length
    } else {
        DQuat::IDENTITY
    }
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
