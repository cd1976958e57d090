//! A path with its curves, and the relation between time and position on it.

use std::ops::Range;

use glam::DVec3;

use crate::method::vector_curve::VectorCurves;
use crate::path::lengths::Lengths;
use crate::path::options::{Direction, Follow, PathFrame, Twist};
use crate::path::polynomial::Polynomial;
use crate::path::speed::{PathSpeed, eased, eased_speed};
use crate::tracks::set::vectors::VectorTrack;

/// The curves of a path, and the relation between time and position on them.
#[derive(Debug, Clone)]
pub(crate) struct TimedPath {
    /// The first point.
    start: DVec3,
    /// The positions of each interval.
    pub(crate) curves: Vec<Polynomial>,
    pub(crate) slopes: Vec<Polynomial>,
    /// The parameters at which each interval's curve stops, and its slope divided by these zeros.
    pub(crate) divided: Vec<(Vec<f64>, Polynomial)>,
    /// Empty until they are [measured](Self::measure).
    pub(crate) lengths: Lengths,
    pub(crate) speed: PathSpeed,
    /// The times of the keys in seconds.
    pub(crate) times: Vec<f64>,
    pub(crate) is_closed: bool,
    /// The size of the path: the diagonal of its box.
    pub(crate) size: f64,
    /// The largest magnitude of a coordinate.
    pub(crate) max_coordinate: f64,
}

/// A slope counts as zero below this fraction of the largest coefficient.
const STOPPED: f64 = 1e-9;

/// A curve stands still if its slope is below this fraction of the path's size everywhere: it is the rounding of
/// equal keys.
const STILL: f64 = 1e-14;

impl TimedPath {
    pub(crate) fn new(path: &VectorTrack, follow: &Follow) -> Self {
        let curves = VectorCurves::new(path, follow.method, follow.ends);
        let curves = (0..path.keys.len() - 1).map(|i| Polynomial(curves.of(i).powers()));
        let curves: Vec<Polynomial> = curves.collect();
        let ends = (curves.iter()).flat_map(|curve| [curve.at(0.0), curve.at(1.0)]);
        let size = diagonal(ends.clone());
        let max_coordinate = ends.fold(0.0f64, |largest, end| largest.max(end.abs().max_element()));
        let slope = |curve: &Polynomial| {
            let slope = curve.derivative();
            match slope.size() <= STILL * max_coordinate.max(size) {
                true => slope.map(|_| DVec3::ZERO),
                false => slope,
            }
        };
        let divided = |slope: &Polynomial| match slope.size() {
            0.0 => (Vec::new(), *slope),
            size => slope.without_zeros(STOPPED * size),
        };
        let slopes: Vec<Polynomial> = curves.iter().map(slope).collect();
        let divided = slopes.iter().map(divided).collect();
        let mut timed = Self {
            start: path.keys[0].as_dvec3(),
            curves,
            slopes,
            divided,
            lengths: Lengths::default(),
            speed: follow.speed,
            times: path.times.clone(),
            is_closed: follow.is_closed(),
            size,
            max_coordinate,
        };
        let is_minimal = follow.frame == PathFrame::Minimal;
        if (timed.is_closed && follow.twist == Twist::Spread && is_minimal)
            || follow.speed != PathSpeed::Keys
            || matches!(follow.direction, Direction::Ahead(_))
            || path.ups.iter().any(Option::is_some)
        {
            timed.measure();
        }
        timed
    }

    /// Computes the lengths, which not every path needs.
    pub(crate) fn measure(&mut self) {
        let stops = self.divided.iter().map(|curve| &curve.0[..]);
        self.lengths = Lengths::new(self.slopes.clone(), stops);
    }

    /// The position at a time.
    pub(crate) fn position(&self, time: f64) -> [DVec3; 2] {
        if self.curves.is_empty() {
            return [self.start, DVec3::ZERO];
        }
        let (interval, t) = self.locate(time);
        let slope = self.slopes[interval].at(t);
        let pace = self.pace(interval, t, slope.length());
        let velocity = match pace > 0.0 {
            true => slope / pace,
            false => DVec3::ZERO,
        };
        [self.curves[interval].at(t), velocity]
    }

    /// The times between two at which one of the path's curves ends or stops.
    pub(crate) fn times_between(&self, from: f64, to: f64) -> Vec<f64> {
        let times_of = |interval: usize| {
            let stops = self.divided[interval].0.iter().copied();
            let parameters = stops.chain([0.0, 1.0]);
            parameters.map(move |t| self.time(interval, t))
        };
        let mut times: Vec<f64> = ((0..self.curves.len()).flat_map(times_of))
            .chain(self.joints(from..to))
            .filter(|&time| time > from && time < to)
            .collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The parameters of an interval for which the point at this distance ahead passes from one interval to the next.
    pub(crate) fn passings(&self, interval: usize, distance: f64) -> Vec<f64> {
        let (lengths, total) = (&self.lengths, self.lengths.total());
        let [from, to] = lengths.of(interval);
        let (rounds, distance) = match self.is_closed {
            true => (&[0.0, total][..], distance % total.max(1e-300)),
            false => (&[0.0][..], distance),
        };
        let starts = (0..self.curves.len()).map(|other| lengths.of(other)[0]);
        (starts.chain([total]))
            .flat_map(|start| rounds.iter().map(move |round| start + round - distance))
            .filter(|&length| length > from && length < to)
            .map(|length| lengths.parameter(interval, length))
            .collect()
    }

    /// The start and the end of the path in seconds.
    pub(crate) fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The key times at the ends of an interval.
    pub(crate) fn keys_of(&self, interval: usize) -> [f64; 2] {
        [self.times[interval], self.times[interval + 1]]
    }

    /// Whether the position depends on the speed instead of the key times.
    pub(crate) fn is_retimed(&self) -> bool {
        self.speed != PathSpeed::Keys && self.lengths.total() > 0.0
    }

    /// Whether a body stands still on its path; it may rotate nevertheless.
    pub(crate) fn stands(&self) -> bool {
        self.speed != PathSpeed::Keys && !self.is_retimed()
    }

    /// The time of a parameter of an interval.
    pub(crate) fn time(&self, interval: usize, t: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return if t == 1.0 { to } else { from + (to - from) * t };
        }
        let (start, end) = self.span();
        let part = self.lengths.at(interval, t) / self.lengths.total();
        start + (end - start) * self.speed.moment(part.min(1.0))
    }

    /// The parameter of an interval at a time in it.
    pub(crate) fn parameter(&self, interval: usize, time: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return ((time - from) / (to - from)).clamp(0.0, 1.0);
        }
        self.lengths.parameter(interval, self.length(time))
    }

    /// The interval and its parameter at a time.
    pub(crate) fn locate(&self, time: f64) -> (usize, f64) {
        let interval = if self.speed == PathSpeed::Keys {
            let last = self.curves.len() - 1;
            let after = self.times.partition_point(|&key| key <= time);
            after.saturating_sub(1).min(last)
        } else {
            self.lengths.interval(self.length(time))
        };
        (interval, self.parameter(interval, time))
    }

    /// The derivative of time by an interval's parameter where the body has this speed.
    pub(crate) fn pace(&self, interval: usize, t: f64, speed: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return to - from;
        }
        let (start, end) = self.span();
        let total = self.lengths.total();
        let rate = match self.speed {
            PathSpeed::Eased { start, end } => {
                let x = self.speed.moment(self.lengths.at(interval, t) / total);
                eased_speed(start, end, x)
            }
            _ => 1.0,
        };
        speed * (end - start) / (total * rate).max(1e-300)
    }

    /// The times within a range at which the speed is not smooth.
    pub(crate) fn joints(&self, times: Range<f64>) -> impl Iterator<Item = f64> + use<> {
        let (from, to) = self.span();
        let parts = match self.speed {
            PathSpeed::Eased { start, end } => [start, 1.0 - end],
            _ => [0.0; 2],
        };
        let joints = parts.map(|part| from + (to - from) * part).into_iter();
        joints.filter(move |&time| time > times.start && time < times.end)
    }

    /// The length covered at a time.
    fn length(&self, time: f64) -> f64 {
        let (start, end) = self.span();
        let x = ((time - start) / (end - start)).clamp(0.0, 1.0);
        self.lengths.total()
            * match self.speed {
                PathSpeed::Eased { start, end } => eased(start, end, x),
                _ => x,
            }
    }
}

/// The size of some points: the diagonal of their box.
pub(crate) fn diagonal(points: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let smallest = points.clone().fold(DVec3::INFINITY, DVec3::min);
    let largest = points.fold(DVec3::NEG_INFINITY, DVec3::max);
    // Without points, the difference is negative: the size is then 0.
    (largest - smallest).max(DVec3::ZERO).length()
}
