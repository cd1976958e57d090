//! A path with its curves, cut into stretches of one smooth direction each.

use glam::DVec3;

use crate::path::lengths::Lengths;
use crate::path::options::{Direction, PathSpeed};
use crate::path::polynomial::Polynomial;
use crate::path::schedule::Schedule;

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
    pub(crate) schedule: Schedule,
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
    pub(crate) fn new(
        start: DVec3,
        curves: Vec<Polynomial>,
        schedule: Schedule,
        is_closed: bool,
    ) -> Self {
        let ends = || {
            curves
                .iter()
                .flat_map(|curve| [curve.at(0.0), curve.at(1.0)])
        };
        let least = ends().fold(DVec3::INFINITY, DVec3::min);
        let most = ends().fold(DVec3::NEG_INFINITY, DVec3::max);
        let size = if curves.is_empty() {
            0.0
        } else {
            (most - least).length()
        };
        let far = ends().fold(0.0f64, |far, end| far.max(end.abs().max_element()));
        let slopes: Vec<Polynomial> = curves
            .iter()
            .map(|curve| {
                let slope = curve.derivative();
                let is_still = slope.size() <= STILL * far.max(size);
                if is_still {
                    slope.map(|_| DVec3::ZERO)
                } else {
                    slope
                }
            })
            .collect();
        let divided: Vec<(Vec<f64>, Polynomial)> = slopes
            .iter()
            .map(|slope| match slope.size() {
                0.0 => (Vec::new(), *slope),
                size => slope.without_zeros(STOPPED * size),
            })
            .collect();
        Self {
            start,
            curves,
            slopes,
            divided,
            lengths: Lengths::default(),
            schedule,
            is_closed,
            size,
            far,
        }
    }

    /// Finds the lengths, which not every path needs.
    pub(crate) fn measure(&mut self) {
        let stops = self.divided.iter().map(|own| &own.0[..]);
        self.lengths = Lengths::new(self.slopes.clone(), stops);
    }

    /// Where an interval's curve stops.
    fn stops(&self, interval: usize) -> &[f64] {
        &self.divided[interval].0
    }

    /// The position at a time.
    pub(crate) fn position(&self, time: f64) -> [DVec3; 2] {
        if self.curves.is_empty() {
            return [self.start, DVec3::ZERO];
        }
        let (interval, t) = self.schedule.place(&self.lengths, time);
        let slope = self.slopes[interval].at(t);
        let pace = self
            .schedule
            .slope(&self.lengths, interval, t, slope.length());
        let velocity = if pace > 0.0 {
            slope / pace
        } else {
            DVec3::ZERO
        };
        [self.curves[interval].at(t), velocity]
    }

    /// The place at a length beyond a place, and how far it lies beyond an open path's end.
    fn ahead(&self, interval: usize, t: f64, distance: f64) -> (usize, f64, f64) {
        let total = self.lengths.total();
        let mut length = self.lengths.at(interval, t) + distance;
        if self.is_closed && total > 0.0 {
            length %= total;
        }
        let interval = self.lengths.interval(length);
        (
            interval,
            self.lengths.parameter(interval, length),
            (length - total).max(0.0),
        )
    }
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
    Body(Box<Route>, DVec3),
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
                let (schedule, lengths) = (&route.schedule, &route.lengths);
                let time = schedule.time(lengths, self.interval, t);
                let [place, velocity] = target.position(time);
                let pace = schedule.slope(lengths, self.interval, t, slope.length());
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
        let tangent = || {
            // Divided by its zeros, the slope has a direction where the curve stops too.
            let way = signed(&route.divided[self.interval], 0.5 * (self.from + self.to));
            [way.at(t), way.derivative().at(t)]
        };
        let (interval, at, beyond) = route.ahead(self.interval, t, distance);
        let leading = direction([route.slopes[interval].at(at), DVec3::ZERO])[0];
        let to =
            route.curves[interval].at(at) + leading * beyond - route.curves[self.interval].at(t);
        if to.length() < 1e-6 * distance {
            return tangent();
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
    if passed % 2 == 1 {
        rest.map(|c| -c)
    } else {
        *rest
    }
}

/// Cuts a path into stretches. What the direction is where a body stands is filled in from before,
/// at the start from after; `None` if it never moves.
pub(crate) fn stretches(
    route: &Route,
    direction: Direction,
    target: Option<&Route>,
    speed: PathSpeed,
) -> Option<Vec<Stretch>> {
    let mut all: Vec<Stretch> = Vec::with_capacity(route.curves.len());
    let mut cuts: Vec<f64> = Vec::new();
    for interval in 0..route.curves.len() {
        // At given speeds, a body's motion is not smooth where its curve stops.
        cuts.clear();
        if speed != PathSpeed::Keys {
            cuts.extend(route.stops(interval));
        }
        let slope = &route.slopes[interval];
        let seen;
        let polynomial = match direction {
            Direction::Tangent if slope.size() == 0.0 => Some(None),
            Direction::Tangent => Some(Some(&route.divided[interval])),
            Direction::Point(point) => {
                let mut own = route.curves[interval].map(|c| -c);
                own.0[0] += point;
                let tolerance = HELD * route.size;
                seen = (own.size() > tolerance).then(|| own.without_zeros(tolerance));
                Some(seen.as_ref())
            }
            _ => None,
        };
        if let Some((zeros, _)) = polynomial.flatten() {
            cuts.extend(zeros);
        }
        match direction {
            Direction::Tangent | Direction::Point(_) => {}
            Direction::Ahead(distance) => {
                cuts.extend(route.stops(interval));
                let [from, to] = route.lengths.of(interval);
                let total = route.lengths.total();
                let rounds: &[f64] = if route.is_closed { &[0.0, 1.0] } else { &[0.0] };
                for other in 0..=route.curves.len() {
                    let start = match route.curves.len() == other {
                        true => total,
                        false => route.lengths.of(other)[0],
                    };
                    for round in rounds {
                        let length = start + round * total - distance % total.max(1e-300);
                        let length = if route.is_closed {
                            length
                        } else {
                            start - distance
                        };
                        if length > from && length < to {
                            cuts.push(route.lengths.parameter(interval, length));
                        }
                    }
                }
            }
            Direction::Track(_) => {
                if let Some(target) = target {
                    let times =
                        [0.0, 1.0].map(|t| route.schedule.time(&route.lengths, interval, t));
                    for time in target.times_between(times[0], times[1]) {
                        cuts.push(route.schedule.parameter(&route.lengths, interval, time));
                    }
                }
            }
        }
        cuts.extend([0.0, 1.0]);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        if let Some(last) = cuts.last_mut() {
            *last = 1.0;
        }
        for pair in cuts.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let heading = match (polynomial, direction, target) {
                (Some(Some(divided)), ..) => {
                    Heading::Polynomial(signed(divided, 0.5 * (from + to)))
                }
                (None, Direction::Ahead(distance), _) if route.lengths.total() > 0.0 => {
                    Heading::Ahead(distance)
                }
                (None, Direction::Track(_), Some(target)) => {
                    Heading::Body(Box::new(target.clone()), DVec3::ZERO)
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
    settle(route, &mut all).then_some(all)
}

/// Fills in the directions of bodies that stand. Returns whether there is any.
fn settle(route: &Route, all: &mut [Stretch]) -> bool {
    let first = all.iter().map(|own| own.way(route, own.from)[0]);
    let Some(mut last) = first.into_iter().find(|way| *way != DVec3::ZERO) else {
        return false;
    };
    let is_open = |own: &Stretch| match &own.heading {
        Heading::Still(way) => *way == DVec3::ZERO,
        Heading::Body(..) => true,
        _ => false,
    };
    if !all.iter().any(is_open) {
        return true;
    }
    for own in all {
        match &mut own.heading {
            Heading::Still(way) if *way == DVec3::ZERO => *way = last,
            Heading::Body(_, resort) => *resort = last,
            _ => {}
        }
        last = own.way(route, own.to)[0];
    }
    true
}

impl Route {
    /// The times between two at which the path's own curves change.
    fn times_between(&self, from: f64, to: f64) -> Vec<f64> {
        let ends = self.curves.len();
        let mut times: Vec<f64> = (0..ends)
            .flat_map(|interval| {
                let stops = self.stops(interval).iter().copied();
                let places = stops.chain([0.0, 1.0]);
                places.map(move |t| self.schedule.time(&self.lengths, interval, t))
            })
            .chain(self.schedule.joints(from..to))
            .filter(|&time| time > from && time < to)
            .collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}
