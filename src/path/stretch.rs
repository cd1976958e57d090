//! Division of a path into stretches with a smooth direction each.

use std::sync::Arc;

use glam::DVec3;

use crate::path::options::Direction;
use crate::path::polynomial::Polynomial;
use crate::path::speed::PathSpeed;
use crate::path::timed_path::TimedPath;
use crate::threads::stop;

/// A vector, or a direction, with its derivative by an interval's parameter.
pub(crate) type VectorAndRate = [DVec3; 2];

/// A part of an interval with one smooth direction.
#[derive(Debug, Clone)]
pub(crate) struct PathStretch {
    pub(crate) interval: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) heading: Heading,
}

/// The direction on a stretch.
#[derive(Debug, Clone)]
pub(crate) enum Heading {
    /// A constant direction; 0 if it is not known yet.
    Still(DVec3),
    /// The direction of a polynomial.
    Polynomial(Polynomial),
    /// To the point at this distance ahead on the path.
    Ahead(f64),
    /// To a body on another path; if both are at one point, the previous direction.
    Body(Arc<TimedPath>, DVec3),
}

impl PathStretch {
    /// The direction at a parameter.
    pub(crate) fn direction(&self, timed_path: &TimedPath, t: f64) -> VectorAndRate {
        let vector = match &self.heading {
            Heading::Still(direction) => return [*direction, DVec3::ZERO],
            Heading::Polynomial(polynomial) => [polynomial.at(t), polynomial.derivative().at(t)],
            Heading::Ahead(distance) => self.ahead(timed_path, t, *distance),
            Heading::Body(target, last) => {
                let slope = timed_path.slopes[self.interval].at(t);
                let [position, velocity] = target.position(timed_path.time(self.interval, t));
                let pace = timed_path.pace(self.interval, t, slope.length());
                let to = position - timed_path.curves[self.interval].at(t);
                if to.length() <= COINCIDENT * timed_path.size.max(target.size) {
                    return [*last, DVec3::ZERO];
                }
                [to, velocity * pace - slope]
            }
        };
        normalized(vector)
    }

    fn ahead(&self, timed_path: &TimedPath, t: f64, distance: f64) -> VectorAndRate {
        let slope = timed_path.slopes[self.interval].at(t);
        let (lengths, total) = (&timed_path.lengths, timed_path.lengths.total());
        let mut length = lengths.at(self.interval, t) + distance;
        if timed_path.is_closed {
            length %= total;
        }
        let interval = lengths.interval(length);
        let at = lengths.parameter(interval, length);
        let past_end = (length - total).max(0.0);
        let leading = normalized([timed_path.slopes[interval].at(at), DVec3::ZERO])[0];
        let to = timed_path.curves[interval].at(at) + leading * past_end
            - timed_path.curves[self.interval].at(t);
        if to.length() < 1e-6 * distance {
            // Divided by its zeros, the slope also has a direction at points where the curve stops.
            let tangent = signed(
                &timed_path.divided[self.interval],
                0.5 * (self.from + self.to),
            );
            return [tangent.at(t), tangent.derivative().at(t)];
        }
        [to, leading * slope.length() - slope]
    }
}

/// A body that is nearer to its target than this fraction of the path's size keeps its direction.
const COINCIDENT: f64 = 1e-9;

/// A vector of this length or less has no direction.
pub(crate) const NO_DIRECTION: f64 = 1e-300;

/// The direction of a vector and its derivative, from the vector and its derivative.
fn normalized([vector, change]: VectorAndRate) -> VectorAndRate {
    let length = vector.length();
    if length <= NO_DIRECTION {
        return [DVec3::ZERO; 2];
    }
    let unit = vector / length;
    [unit, (change - unit * unit.dot(change)) / length]
}

/// A polynomial divided by its zeros, with the sign that the zeros define at a parameter.
pub(crate) fn signed((zeros, rest): &(Vec<f64>, Polynomial), at: f64) -> Polynomial {
    let passed = zeros.iter().filter(|&&zero| at < zero).count();
    match passed % 2 {
        1 => rest.map(|c| -c),
        _ => *rest,
    }
}

/// Divides a path into stretches. A body that stands still keeps the previous direction, or at the start the next
/// one. There are no stretches if it never moves.
pub(crate) fn stretches(
    timed_path: &TimedPath,
    direction: Direction,
    target: Option<&Arc<TimedPath>>,
) -> Vec<PathStretch> {
    let mut all: Vec<PathStretch> = Vec::with_capacity(timed_path.curves.len());
    let mut cuts: Vec<f64> = Vec::new();
    for interval in 0..timed_path.curves.len() {
        if stop::is_stopped() {
            // The work was stopped; the caller notices it after this function has returned.
            return Vec::new();
        }
        let slope = &timed_path.slopes[interval];
        // If the direction is a polynomial: the polynomial divided by its zeros.
        let divided = match direction {
            Direction::Tangent if slope.size() > 0.0 => Some(timed_path.divided[interval].clone()),
            Direction::Point(point) => {
                let mut to_point = timed_path.curves[interval].map(|c| -c);
                to_point.0[0] += point;
                let tolerance = COINCIDENT * timed_path.size;
                (to_point.size() > tolerance).then(|| to_point.without_zeros(tolerance))
            }
            _ => None,
        };
        cuts.clear();
        cuts.extend([0.0, 1.0]);
        if let Some((zeros, _)) = &divided {
            cuts.extend(zeros);
        }
        // At constant or eased speed, the motion is not smooth at points where the curve stops.
        if timed_path.speed != PathSpeed::Keys || matches!(direction, Direction::Ahead(_)) {
            cuts.extend(&timed_path.divided[interval].0);
        }
        match (direction, target) {
            (Direction::Ahead(distance), _) => cuts.extend(timed_path.passings(interval, distance)),
            (Direction::Track(_), Some(target)) => {
                let [from, to] = [0.0, 1.0].map(|t| timed_path.time(interval, t));
                let times = target.times_between(from, to).into_iter();
                cuts.extend(times.map(|time| timed_path.parameter(interval, time)));
            }
            _ => {}
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        if let Some(last) = cuts.last_mut() {
            *last = 1.0;
        }
        for pair in cuts.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let heading = match (&divided, direction, target) {
                (Some(divided), ..) => Heading::Polynomial(signed(divided, 0.5 * (from + to))),
                (None, Direction::Ahead(distance), _) if timed_path.lengths.total() > 0.0 => {
                    Heading::Ahead(distance)
                }
                (None, Direction::Track(_), Some(target)) => {
                    Heading::Body(Arc::clone(target), DVec3::ZERO)
                }
                _ => Heading::Still(DVec3::ZERO),
            };
            let mut stretch = PathStretch {
                interval,
                from,
                to,
                heading,
            };
            if let (Heading::Ahead(_), 0.0) = (&stretch.heading, slope.size()) {
                stretch.heading = Heading::Still(stretch.direction(timed_path, 0.5)[0]);
            }
            all.push(stretch);
        }
    }
    settle(timed_path, &mut all);
    all
}

/// Sets the directions of bodies that stand still; removes all stretches if there is no direction.
fn settle(timed_path: &TimedPath, all: &mut Vec<PathStretch>) {
    let mut first = all
        .iter()
        .map(|stretch| stretch.direction(timed_path, stretch.from)[0]);
    let Some(mut last) = first.find(|direction| *direction != DVec3::ZERO) else {
        all.clear();
        return;
    };
    for stretch in all {
        match &mut stretch.heading {
            Heading::Still(direction) if *direction == DVec3::ZERO => *direction = last,
            Heading::Body(_, resort) => *resort = last,
            _ => {}
        }
        last = stretch.direction(timed_path, stretch.to)[0];
    }
}
