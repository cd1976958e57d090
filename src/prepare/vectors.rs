//! Prepares translations and scales: a segment is a cubic in each component about the middle of its
//! interval. It is a polynomial already, so nothing is fitted.

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};

use crate::curve::options::Quantity;
use crate::fit::double::curve::Curve;
use crate::fit::double::shape::Shape;
use crate::math::canonical::{canonical, round_f32, round_quat};
use crate::math::quaternion::ratio;
use crate::method::interpolation::Interpolation;
use crate::method::vector_curve::{Cubic, Curves};
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
        ups: Vec::new(),
    };
    let track = track.unwrap_or(&still);
    let last = track.keys.len() - 1;
    let first_key = prepared.constants.len() as u32;
    let stored = |key: &Vec3| [canonical(key.x), canonical(key.y), canonical(key.z), 0.0];
    prepared.constants.extend(track.keys.iter().map(stored));
    let first_span = prepared.spans.len();
    let curves = Curves::new(track, method, interpolation.ends);
    let mut beyond = [NONE; 2];
    let mut held_keys = [first_key, first_key + last as u32];
    for i in 0..last {
        let key = first_key + i as u32;
        if curves.is_held(i) {
            prepared.push_span(track.times[i], Source::Constant(key), NONE);
            continue;
        }
        let curve = curves.of(i);
        let Cubic {
            start,
            leaving,
            arriving,
            end,
        } = curve;
        let segments = &mut prepared.segments.polynomials;
        let source = Source::Segment(segments.len() as u32);
        segments.push(segment(&curve));
        let meets_key = curves.meets_keys();
        prepared.push_span(track.times[i], source, if meets_key { key } else { NONE });
        if !meets_key {
            for (at_end, held, value) in [(i == 0, 0, start), (i + 1 == last, 1, end)] {
                if at_end {
                    held_keys[held] =
                        prepared.constant(round_quat([value.x, value.y, value.z, 0.0]));
                }
            }
        }
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
        before: held(beyond[0], held_keys[0]),
        after: held(beyond[1], held_keys[1]),
        beyond: (goes_on || prepared.wrap.repeats()).then(|| {
            Box::new(Beyond {
                from_before: beyond[0],
                from_after: beyond[1],
                ..Beyond::new(&[times.0, times.1])
            })
        }),
    });
}

/// A cubic in powers about its middle.
fn segment(cubic: &Cubic) -> PolynomialSegment {
    let &Cubic {
        start,
        leaving,
        arriving,
        end,
    } = cubic;
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
    Curve::new(shape, numbers, Quantity::Rotation, 1.0)
}
