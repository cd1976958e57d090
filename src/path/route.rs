//! A path with its curves, cut into stretches of one smooth direction each.

use std::sync::Arc;

use glam::DVec3;

use crate::method::vector_curve::Curves;
use crate::path::lengths::Lengths;
use crate::path::options::{Direction, Follow, Frame, PathSpeed, Twist};
use crate::path::polynomial::Polynomial;
use crate::threads::stop;
use crate::tracks::vectors::VectorTrack;

/// The curves of a path, and when a body is where on them.
#[derive(Debug, Clone)]
pub(crate) struct Route {
    /// The first point.
    start: DVec3,
    /// The positions of each interval.
    pub(crate) curves: Vec<Polynomial>,
    pub(crate) slopes: Vec<Polynomial>,
    /// Where each interval's curve stops, and its slope divided by these zeros.
    divided: Vec<(Vec<f64>, Polynomial)>,
    /// Empty until they are [measured](Self::measure).
    pub(crate) lengths: Lengths,
    pub(crate) speed: PathSpeed,
    /// The keys' own times, seconds.
    pub(crate) times: Vec<f64>,
    pub(crate) is_closed: bool,
    /// The size of the path: the diagonal of its box.
    pub(crate) size: f64,
    /// The largest magnitude of a coordinate.
    pub(crate) far: f64,
}

/// A slope below this part of the largest coefficient vanishes.
const STOPPED: f64 = 1e-9;

/// A curve whose slope is this part of the path's size everywhere stands still: what is left of
/// equal keys after rounding.
const STILL: f64 = 1e-14;

impl Route {
    pub(crate) fn new(path: &VectorTrack, follow: &Follow) -> Self {
        let curves = Curves::new(path, follow.method, follow.ends);
        let curves = (0..path.keys.len() - 1).map(|i| Polynomial(curves.of(i).powers()));
        let curves: Vec<Polynomial> = curves.collect();
        let ends = (curves.iter()).flat_map(|curve| [curve.at(0.0), curve.at(1.0)]);
        let size = diagonal(ends.clone());
        let far = ends.fold(0.0f64, |far, end| far.max(end.abs().max_element()));
        let slope = |curve: &Polynomial| {
            let slope = curve.derivative();
            match slope.size() <= STILL * far.max(size) {
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
        let mut own = Self {
            start: path.keys[0].as_dvec3(),
            curves,
            slopes,
            divided,
            lengths: Lengths::default(),
            speed: follow.speed,
            times: path.times.clone(),
            is_closed: follow.is_closed(),
            size,
            far,
        };
        let is_minimal = follow.frame == Frame::Minimal;
        if (own.is_closed && follow.twist == Twist::Spread && is_minimal)
            || follow.speed != PathSpeed::Keys
            || matches!(follow.direction, Direction::Ahead(_))
            || path.ups.iter().any(Option::is_some)
        {
            own.measure();
        }
        own
    }

    /// Finds the lengths, which not every path needs.
    pub(crate) fn measure(&mut self) {
        let stops = self.divided.iter().map(|own| &own.0[..]);
        self.lengths = Lengths::new(self.slopes.clone(), stops);
    }

    /// The position at a time.
    pub(crate) fn position(&self, time: f64) -> [DVec3; 2] {
        if self.curves.is_empty() {
            return [self.start, DVec3::ZERO];
        }
        let (interval, t) = self.place(time);
        let slope = self.slopes[interval].at(t);
        let pace = self.pace(interval, t, slope.length());
        let velocity = match pace > 0.0 {
            true => slope / pace,
            false => DVec3::ZERO,
        };
        [self.curves[interval].at(t), velocity]
    }

    /// The times between two at which the path's own curves change.
    fn times_between(&self, from: f64, to: f64) -> Vec<f64> {
        let places = |interval: usize| {
            let stops = self.divided[interval].0.iter().copied();
            let places = stops.chain([0.0, 1.0]);
            places.map(move |t| self.time(interval, t))
        };
        let mut times: Vec<f64> = ((0..self.curves.len()).flat_map(places))
            .chain(self.joints(from..to))
            .filter(|&time| time > from && time < to)
            .collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The places in an interval from which the point this far ahead lies between two intervals.
    fn passings(&self, interval: usize, distance: f64) -> Vec<f64> {
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
}

/// The size of some points: the diagonal of their box.
pub(crate) fn diagonal(points: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let least = points.clone().fold(DVec3::INFINITY, DVec3::min);
    let most = points.fold(DVec3::NEG_INFINITY, DVec3::max);
    // Less than 0 where there is no point.
    (most - least).max(DVec3::ZERO).length()
}

/// A direction with its derivative by an interval's parameter.
pub(crate) type Way = [DVec3; 2];

/// A part of an interval with one smooth direction.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    pub(crate) interval: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) heading: Heading,
}

/// The direction on a stretch.
#[derive(Debug, Clone)]
pub(crate) enum Heading {
    /// One direction; not known yet where it is 0.
    Still(DVec3),
    /// That of a polynomial.
    Polynomial(Polynomial),
    /// To the point ahead on the path.
    Ahead(f64),
    /// To a body on another path, or to the last resort where both are at one place.
    Body(Arc<Route>, DVec3),
}

impl Stretch {
    /// The direction at a place.
    pub(crate) fn way(&self, route: &Route, t: f64) -> Way {
        let vector = match &self.heading {
            Heading::Still(way) => return [*way, DVec3::ZERO],
            Heading::Polynomial(own) => [own.at(t), own.derivative().at(t)],
            Heading::Ahead(distance) => self.ahead(route, t, *distance),
            Heading::Body(target, last) => {
                let slope = route.slopes[self.interval].at(t);
                let [place, velocity] = target.position(route.time(self.interval, t));
                let pace = route.pace(self.interval, t, slope.length());
                let to = place - route.curves[self.interval].at(t);
                if to.length() <= HELD * route.size.max(target.size) {
                    return [*last, DVec3::ZERO];
                }
                [to, velocity * pace - slope]
            }
        };
        direction(vector)
    }

    fn ahead(&self, route: &Route, t: f64, distance: f64) -> Way {
        let slope = route.slopes[self.interval].at(t);
        let (lengths, total) = (&route.lengths, route.lengths.total());
        let mut length = lengths.at(self.interval, t) + distance;
        if route.is_closed {
            length %= total;
        }
        let interval = lengths.interval(length);
        let at = lengths.parameter(interval, length);
        let beyond = (length - total).max(0.0);
        let leading = direction([route.slopes[interval].at(at), DVec3::ZERO])[0];
        let to =
            route.curves[interval].at(at) + leading * beyond - route.curves[self.interval].at(t);
        if to.length() < 1e-6 * distance {
            // Divided by its zeros, the slope has a direction where the curve stops too.
            let way = signed(&route.divided[self.interval], 0.5 * (self.from + self.to));
            return [way.at(t), way.derivative().at(t)];
        }
        [to, leading * slope.length() - slope]
    }
}

/// A body nearer to its centre of interest than this part of the path's size keeps its direction.
const HELD: f64 = 1e-9;

/// A vector as short as this has no direction.
pub(crate) const NO_DIRECTION: f64 = 1e-300;

/// A vector's direction and its derivative, from the vector's own.
fn direction([vector, change]: Way) -> Way {
    let length = vector.length();
    if length <= NO_DIRECTION {
        return [DVec3::ZERO; 2];
    }
    let way = vector / length;
    [way, (change - way * way.dot(change)) / length]
}

/// A polynomial whose zeros are divided out, with the sign that these give at a place.
pub(crate) fn signed((zeros, rest): &(Vec<f64>, Polynomial), at: f64) -> Polynomial {
    let passed = zeros.iter().filter(|&&zero| at < zero).count();
    match passed % 2 {
        1 => rest.map(|c| -c),
        _ => *rest,
    }
}

/// Cuts a path into stretches. What the direction is where a body stands is filled in from before,
/// at the start from after; there are none if it never moves.
pub(crate) fn stretches(
    route: &Route,
    direction: Direction,
    target: Option<&Arc<Route>>,
) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = Vec::with_capacity(route.curves.len());
    let mut cuts: Vec<f64> = Vec::new();
    for interval in 0..route.curves.len() {
        if stop::is_stopped() {
            // Whoever prepares paths looks again when this is done.
            return Vec::new();
        }
        let slope = &route.slopes[interval];
        // Where the direction is that of a polynomial, this without its zeros.
        let divided = match direction {
            Direction::Tangent if slope.size() > 0.0 => Some(route.divided[interval].clone()),
            Direction::Point(point) => {
                let mut own = route.curves[interval].map(|c| -c);
                own.0[0] += point;
                let tolerance = HELD * route.size;
                (own.size() > tolerance).then(|| own.without_zeros(tolerance))
            }
            _ => None,
        };
        cuts.clear();
        cuts.extend([0.0, 1.0]);
        if let Some((zeros, _)) = &divided {
            cuts.extend(zeros);
        }
        // At given speeds, a body's motion is not smooth where its curve stops.
        if route.speed != PathSpeed::Keys || matches!(direction, Direction::Ahead(_)) {
            cuts.extend(&route.divided[interval].0);
        }
        match (direction, target) {
            (Direction::Ahead(distance), _) => cuts.extend(route.passings(interval, distance)),
            (Direction::Track(_), Some(target)) => {
                let [from, to] = [0.0, 1.0].map(|t| route.time(interval, t));
                let times = target.times_between(from, to).into_iter();
                cuts.extend(times.map(|time| route.parameter(interval, time)));
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
                (None, Direction::Ahead(distance), _) if route.lengths.total() > 0.0 => {
                    Heading::Ahead(distance)
                }
                (None, Direction::Track(_), Some(target)) => {
                    Heading::Body(Arc::clone(target), DVec3::ZERO)
                }
                _ => Heading::Still(DVec3::ZERO),
            };
            let mut own = Stretch {
                interval,
                from,
                to,
                heading,
            };
            if let (Heading::Ahead(_), 0.0) = (&own.heading, slope.size()) {
                own.heading = Heading::Still(own.way(route, 0.5)[0]);
            }
            all.push(own);
        }
    }
    settle(route, &mut all);
    all
}

/// Fills in the directions of bodies that stand; takes all stretches where there is none.
fn settle(route: &Route, all: &mut Vec<Stretch>) {
    let mut first = all.iter().map(|own| own.way(route, own.from)[0]);
    let Some(mut last) = first.find(|way| *way != DVec3::ZERO) else {
        all.clear();
        return;
    };
    for own in all {
        match &mut own.heading {
            Heading::Still(way) if *way == DVec3::ZERO => *way = last,
            Heading::Body(_, resort) => *resort = last,
            _ => {}
        }
        last = own.way(route, own.to)[0];
    }
}
