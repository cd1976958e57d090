//! Curves that turn little, in vector lanes of f32: what the kernels evaluate comes
//! straight from the keys, with nothing sampled and nothing fitted.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::cpu::{Gentle, InLanes, Lanes, gentle, in_lanes, signed};
use crate::joints::{Joints, UNKNOWN};
use crate::method::{Ends, Path};
use crate::segment::shader::{INNER, LONGEST_STEP};
use crate::segment::{Joint, PolynomialSegment};

/// Lanes of the widest vectors.
const VECTOR: usize = 16;

/// So few curves are worked out one by one: most lanes would be for nothing.
const FEW: usize = 6;

/// The curves of a block's intervals.
pub(super) struct GentleLanes {
    rule: Joints,
    /// At a track's ends.
    end: Joint,
    is_loop: bool,
    may_flip: bool,
    /// -1 where the sign of an interval's second key is turned.
    pub(super) flips: [f32; ROOM],
    /// Whether the keys of the interval, and of both beside it, are near each other.
    near: [bool; ROOM],
    /// Whole vectors of lanes, behind which no lane holds such a curve.
    wanted: usize,
    /// Of the key that an interval starts with.
    joints: [Joint; ROOM],
    powers: [[[f32; 4]; ROOM]; 7],
    holds: [bool; ROOM],
}

impl GentleLanes {
    pub(super) fn new(rule: Joints, ends: Ends, path: Path) -> Self {
        let end = Joints::end(ends);
        Self {
            rule,
            end,
            is_loop: ends == Ends::Loop,
            may_flip: path == Path::Shortest,
            flips: [1.0; ROOM],
            near: [false; ROOM],
            wanted: 0,
            joints: [end; ROOM],
            powers: [[[0.0; 4]; ROOM]; 7],
            holds: [false; ROOM],
        }
    }

    /// Finds out which keys are near each other; whether any curve may turn little, and
    /// whether all do.
    pub(super) fn look(&mut self, intervals: &Intervals, stretches: &[Stretch]) -> (bool, bool) {
        in_lanes(&mut Chords {
            lanes: self,
            intervals,
        });
        self.holds = [false; ROOM];
        let (mut last, mut others) = (None, 0);
        for lanes in stretches.iter().map(Stretch::lanes) {
            let near = &self.near[lanes.clone()];
            let place = near.iter().rposition(|&near| near);
            last = place.map(|place| lanes.start + place).or(last);
            others += near.iter().map(|&near| usize::from(!near)).sum::<usize>();
        }
        let Some(last) = last else {
            return (false, false);
        };
        // A lane's curve is worked out one lane before it.
        self.wanted = last.next_multiple_of(VECTOR);
        (true, others == 0)
    }

    /// Prepares them; the signs of the intervals' first keys are known.
    pub(super) fn prepare(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        let own = stretches.iter().flat_map(Stretch::lanes);
        let near: Vec<usize> = own.filter(|&lane| self.near[lane]).collect();
        let are_few = near.len() <= FEW;
        if are_few {
            let durations = &intervals.durations;
            for key in near.iter().flat_map(|&lane| [lane, lane + 1]) {
                self.joints[key] = self.rule.between(durations[key - 1], durations[key]);
            }
        } else {
            in_lanes(&mut JointLanes {
                lanes: self,
                intervals,
            });
        }
        for stretch in stretches.iter().filter(|_| !self.is_loop) {
            let end = match stretch.all {
                1 => UNKNOWN,
                _ => self.end,
            };
            if let Some(lane) = stretch.first() {
                self.joints[lane] = end;
            }
            if let Some(lane) = stretch.last() {
                self.joints[lane + 1] = end;
            }
        }
        if !are_few {
            in_lanes(&mut Curves {
                lanes: self,
                intervals,
            });
            return;
        }
        for lane in near {
            let curve = self.curve(intervals, lane - 1);
            for (powers, power) in self.powers.iter_mut().zip(curve.powers) {
                powers[lane] = power;
            }
            self.holds[lane] = curve.holds;
        }
    }

    /// The curve of lane `j + 1`.
    #[inline(always)]
    fn curve(&self, intervals: &Intervals, j: usize) -> Gentle {
        let Intervals {
            from, to, signs, ..
        } = intervals;
        let flips = &self.flips;
        let own = signs[j + 1] as f32;
        let sign_before = own * flips[j];
        let sign_end = own * flips[j + 1];
        let sign_after = sign_end * flips[j + 2];
        let (first, last) = (self.joints[j + 1], self.joints[j + 2]);
        let start = signed(from[j + 1], own);
        let end = signed(to[j + 1], sign_end);
        let before = signed(from[j], sign_before);
        let after = signed(to[j + 2], sign_after);
        // Where there is no neighbour, the key again.
        let before = either(first.kind == INNER, before, start);
        let after = either(last.kind == INNER, after, end);
        gentle([before, start, end, after], first, last)
    }

    /// Whether a lane has its curve.
    pub(super) fn holds(&self, lane: usize) -> bool {
        self.holds[lane]
    }

    /// Writes it.
    #[inline]
    pub(super) fn write(&self, lane: usize, segment: &mut PolynomialSegment) {
        for (own, power) in segment.coefficients.iter_mut().zip(&self.powers) {
            *own = power[lane];
        }
    }
}

struct Chords<'a> {
    lanes: &'a mut GentleLanes,
    intervals: &'a Intervals,
}

impl InLanes for Chords<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (mut flips, mut own, mut near) = ([1.0; ROOM], [false; ROOM], [false; ROOM]);
        let Intervals { from, to, .. } = self.intervals;
        let turned = if self.lanes.may_flip { -1.0 } else { 1.0 };
        for j in 0..self.intervals.whole32() {
            let ([ax, ay, az, aw], [bx, by, bz, bw]) = (from[j], to[j]);
            let dot = ax * bx + ay * by + az * bz + aw * bw;
            let flip = if dot < 0.0 { turned } else { 1.0 };
            let (x, y) = (bx * flip - ax, by * flip - ay);
            let (z, w) = (bz * flip - az, bw * flip - aw);
            flips[j] = flip;
            own[j] = x * x + y * y + z * z + w * w <= LONGEST_STEP;
        }
        for j in 1..LANES {
            near[j] = own[j - 1] & own[j] & own[j + 1];
        }
        (self.lanes.flips, self.lanes.near) = (flips, near);
    }
}

struct JointLanes<'a> {
    lanes: &'a mut GentleLanes,
    intervals: &'a Intervals,
}

impl InLanes for JointLanes<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut joints = self.lanes.joints;
        let durations = &self.intervals.durations;
        for j in 0..LANES {
            joints[j + 1] = self.lanes.rule.between(durations[j], durations[j + 1]);
        }
        self.lanes.joints = joints;
    }
}

struct Curves<'a> {
    lanes: &'a mut GentleLanes,
    intervals: &'a Intervals,
}

impl InLanes for Curves<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut powers = [[[0.0; ROOM]; 4]; 7];
        let mut holds = [false; ROOM];
        // The lane before each is context, at least.
        let lanes = &*self.lanes;
        for j in 0..lanes.wanted.min(LANES) {
            let curve = lanes.curve(self.intervals, j);
            for power in 0..7 {
                for c in 0..4 {
                    powers[power][c][j + 1] = curve.powers[power][c];
                }
            }
            holds[j + 1] = curve.holds;
        }
        self.lanes.holds = holds;
        for power in 0..7 {
            let [x, y, z, w] = &powers[power];
            for j in 0..ROOM {
                self.lanes.powers[power][j] = [x[j], y[j], z[j], w[j]];
            }
        }
    }
}

#[inline(always)]
fn either(first: bool, a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        if first { a[0] } else { b[0] },
        if first { a[1] } else { b[1] },
        if first { a[2] } else { b[2] },
        if first { a[3] } else { b[3] },
    ]
}
