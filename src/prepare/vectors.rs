//! Prepares translations and scales: a segment is a cubic in each component about the middle of its
//! interval. It is a polynomial already, so nothing is fitted.

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};

use crate::curve::options::{Ends, Quantity};
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::shape::Shape;
use crate::math::canonical::{canonical, round_f32};
use crate::math::quaternion::ratio;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::time::spans::{Beyond, NONE, Part, Source};
use crate::time::wrap::WrapMode;
use crate::tracks::vectors::VectorTrack;

/// Adds the vectors of the `index`th track; a track without vectors is held at `rest`.
pub(crate) fn add(
    prepared: &mut Prepared,
    index: usize,
    track: Option<&VectorTrack>,
    rest: Vec3,
    method: VectorMethod,
    interpolation: &Interpolation,
) {
    let still = VectorTrack {
        times: vec![0.0],
        keys: vec![rest],
        tangents: Vec::new(),
    };
    let track = track.unwrap_or(&still);
    let last = track.keys.len() - 1;
    let first_key = prepared.constants.len() as u32;
    let stored = |key: &Vec3| [canonical(key.x), canonical(key.y), canonical(key.z), 0.0];
    prepared.constants.extend(track.keys.iter().map(stored));
    let first_span = prepared.spans.len();
    let slopes = Slopes {
        track,
        method,
        ends: interpolation.ends,
    };
    let mut beyond = [NONE; 2];
    for i in 0..last {
        let key = first_key + i as u32;
        let is_frozen = interpolation.ends == Ends::Frozen
            && slopes.use_neighbours()
            && last > 1
            && (i == 0 || i + 1 == last);
        if method == VectorMethod::Step || is_frozen {
            prepared.push_span(track.times[i], Source::Constant(key), NONE);
            continue;
        }
        let [start, end] = [i, i + 1].map(|key| track.keys[key].as_dvec3());
        let [leaving, arriving] = slopes.of(i);
        let segments = &mut prepared.segments.polynomials;
        let source = Source::Segment(segments.len() as u32);
        segments.push(cubic(start, leaving, arriving, end));
        prepared.push_span(track.times[i], source, key);
        let rate = ratio(1.0, track.times[i + 1] - track.times[i]);
        let sides = [
            (i == 0, interpolation.before, start, leaving),
            (i + 1 == last, interpolation.after, end, arriving),
        ];
        for (beyond, (at_end, outside, from, slope)) in beyond.iter_mut().zip(sides) {
            if at_end && outside == WrapMode::Extrapolate {
                *beyond = prepared.exact.len() as u32;
                prepared.exact.push(line(from, slope * rate));
            }
        }
    }
    let held = |beyond: u32, key: u32| if beyond == NONE { key } else { NONE };
    let times = (track.times[0], track.times[last]);
    let goes_on = beyond != [NONE; 2];
    prepared.parts.push(Part {
        track: index as u32,
        first_key: 0,
        spans: first_span..first_span + last,
        end: track.times[last],
        before: held(beyond[0], first_key),
        after: held(beyond[1], first_key + last as u32),
        beyond: (goes_on || prepared.wrap.repeats()).then(|| {
            Box::new(Beyond {
                from_before: beyond[0],
                from_after: beyond[1],
                ..Beyond::new(&[times.0, times.1])
            })
        }),
    });
}

/// The cubic with these ends and slopes per unit of the parameter, in powers about its middle.
fn cubic(start: DVec3, leaving: DVec3, arriving: DVec3, end: DVec3) -> PolynomialSegment {
    let rise = end - start;
    let powers = [
        (start + end) * 0.5 + (leaving - arriving) * 0.125,
        rise * 1.5 - (leaving + arriving) * 0.25,
        (arriving - leaving) * 0.5,
        leaving + arriving - rise * 2.0,
    ];
    let mut segment = PolynomialSegment::zeroed();
    for (coefficients, power) in segment.coefficients.iter_mut().zip(powers) {
        *coefficients = [power.x, power.y, power.z, 0.0].map(round_f32);
    }
    segment
}

/// A straight line from a point, with this slope per second.
fn line(from: DVec3, slope: DVec3) -> Curve {
    let shape = Shape::LINE;
    let mut numbers = shape.shared;
    numbers[..3].copy_from_slice(&from.to_array());
    numbers[4..7].copy_from_slice(&slope.to_array());
    Curve {
        shape,
        numbers,
        piece: Piece::WHOLE,
        quantity: Quantity::Rotation,
        rate: 1.0,
        pace: None,
    }
}

/// The slopes with which a method's curves leave and reach their keys.
struct Slopes<'a> {
    track: &'a VectorTrack,
    method: VectorMethod,
    ends: Ends,
}

impl Slopes<'_> {
    fn use_neighbours(&self) -> bool {
        matches!(
            self.method,
            VectorMethod::CatmullRom | VectorMethod::BesselOverhauser
        )
    }

    fn rise(&self, i: usize) -> DVec3 {
        self.track.keys[i + 1].as_dvec3() - self.track.keys[i].as_dvec3()
    }

    fn duration(&self, i: usize) -> f64 {
        self.track.times[i + 1] - self.track.times[i]
    }

    /// The slopes of interval `i` at its first and its last key, per unit of its parameter.
    fn of(&self, i: usize) -> [DVec3; 2] {
        let last = self.track.keys.len() - 2;
        let (rise, duration) = (self.rise(i), self.duration(i));
        if self.method == VectorMethod::GltfCubic {
            let tangent = |key: usize, side: usize| match self.track.tangents.get(key) {
                Some(both) => both[side].as_dvec3() * duration,
                None => DVec3::ZERO,
            };
            return [tangent(i, 1), tangent(i + 1, 0)];
        }
        if !self.use_neighbours() || last == 0 {
            return [rise; 2];
        }
        let closed = self.ends == Ends::Loop;
        let before = i.checked_sub(1).or(closed.then_some(last));
        let after = (i < last).then_some(i + 1).or(closed.then_some(0));
        let leaving = before.map(|before| self.at_key(before, i, duration));
        let arriving = after.map(|after| self.at_key(i, after, duration));
        match (leaving, arriving) {
            (None, Some(arriving)) => [self.at_end(rise, arriving), arriving],
            (Some(leaving), None) => [leaving, self.at_end(rise, leaving)],
            (leaving, arriving) => [leaving.unwrap_or(rise), arriving.unwrap_or(rise)],
        }
    }

    /// The slope at the key between two intervals, per unit of the parameter of an interval that
    /// lasts `duration` seconds.
    fn at_key(&self, before: usize, after: usize, duration: f64) -> DVec3 {
        let (left, right) = (self.rise(before), self.rise(after));
        if self.method == VectorMethod::CatmullRom {
            return (left + right) * 0.5;
        }
        let (h, next_h) = (self.duration(before), self.duration(after));
        let rate = (left * ratio(next_h, h) + right * ratio(h, next_h)) * ratio(1.0, h + next_h);
        rate * duration
    }

    fn at_end(&self, rise: DVec3, other: DVec3) -> DVec3 {
        match self.ends {
            Ends::Natural => rise * 1.5 - other * 0.5,
            Ends::Clamped { .. } => DVec3::ZERO,
            Ends::Secant => rise,
            Ends::Parabolic | Ends::Loop | Ends::Frozen => rise * 2.0 - other,
        }
    }
}
