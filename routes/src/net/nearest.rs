//! Finds the nearest point of a Bézier surface, by halving and then by Newton's method.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DMat2, DVec2, DVec3};

use crate::edges::Distance;
use crate::net::bernstein::Derivatives;
use crate::net::{Net, OnNet};

/// The largest number of parts that are searched: around the centre of a sphere none can be dropped.
const MAX_PARTS: usize = 2000;
/// Size in u and v at which parts are not halved any more.
const SMALLEST: f64 = 1.0 / 256.0;
/// Number of steps of Newton's method, which doubles the digits each time, and of halvings of a step.
const STEPS: usize = 60;

/// A part of the surface with the control points of this part.
struct NetPart {
    net: Net,
    low: DVec2,
    high: DVec2,
}

pub(super) fn nearest(net: &Net, point: DVec3) -> OnNet {
    let mut best = OnNet {
        uv: DVec2::ZERO,
        point,
        distance: f64::INFINITY,
    };
    let mut parts = vec![NetPart {
        net: net.clone(),
        low: DVec2::ZERO,
        high: DVec2::ONE,
    }];
    let mut heap = BinaryHeap::from([Reverse((Distance(0.0), 0))]);
    while let Some(Reverse((Distance(least), index))) = heap.pop() {
        // The part lies within the box of its control points, so no point of it is nearer than that box.
        if least >= best.distance || parts.len() > MAX_PARTS {
            break;
        }
        let (low, high) = (parts[index].low, parts[index].high);
        let found = newton(net, point, DVec2::midpoint(low, high));
        if found.distance < best.distance {
            best = found;
        }
        if (high - low).max_element() <= SMALLEST {
            continue;
        }
        for half in halves(&parts[index]) {
            let least = half.net.box_distance(point);
            if least < best.distance {
                heap.push(Reverse((Distance(least), parts.len())));
                parts.push(half);
            }
        }
    }
    best
}

impl Net {
    fn box_distance(&self, point: DVec3) -> f64 {
        let low = self
            .points
            .iter()
            .copied()
            .fold(DVec3::INFINITY, DVec3::min);
        let high = self
            .points
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        (low - point).max(point - high).max(DVec3::ZERO).length()
    }
}

/// Both halves along the longer side, by de Casteljau's algorithm.
fn halves(part: &NetPart) -> [NetPart; 2] {
    let NetPart { net, low, high } = part;
    let along_u = high.x - low.x >= high.y - low.y;
    let (count, lines) = match along_u {
        true => (net.rows, net.columns),
        false => (net.columns, net.rows),
    };
    let index = |line: usize, i: usize| match along_u {
        true => i * net.columns + line,
        false => line * net.columns + i,
    };
    let (mut first, mut second) = (net.clone(), net.clone());
    for line in 0..lines {
        let mut means: Vec<DVec3> = (0..count).map(|i| net.points[index(line, i)]).collect();
        for i in 0..count {
            first.points[index(line, i)] = means[0];
            second.points[index(line, count - 1 - i)] = means[count - 1 - i];
            for k in 0..count - 1 - i {
                means[k] = DVec3::midpoint(means[k], means[k + 1]);
            }
        }
    }
    let (mut end, mut begin) = (*high, *low);
    let middle = DVec2::midpoint(*low, *high);
    if along_u {
        (end.x, begin.x) = (middle.x, middle.x);
    } else {
        (end.y, begin.y) = (middle.y, middle.y);
    }
    [
        NetPart {
            net: first,
            low: *low,
            high: end,
        },
        NetPart {
            net: second,
            low: begin,
            high: *high,
        },
    ]
}

/// The nearest point from `start` on: one at which no direction within the square leads nearer to `point`.
fn newton(net: &Net, point: DVec3, start: DVec2) -> OnNet {
    let mut uv = start;
    let mut here = net.derivatives(uv);
    for _ in 0..STEPS {
        let Some(step) = step(&here, point, uv) else {
            break;
        };
        // Halve the step until it reduces the distance.
        let mut part = 1.0;
        let next = loop {
            let tried = (uv + part * step).clamp(DVec2::ZERO, DVec2::ONE);
            if tried == uv || part < 1e-9 {
                break None;
            }
            let there = net.derivatives(tried);
            if there.point.distance_squared(point) < here.point.distance_squared(point) {
                break Some((tried, there));
            }
            part /= 2.0;
        };
        match next {
            Some(next) => (uv, here) = next,
            None => {
                // The distance does not change in its last digit any more, but the derivatives still locate the
                // minimum.
                let last = (uv + step).clamp(DVec2::ZERO, DVec2::ONE);
                if (last - uv).length() < 1e-7 {
                    uv = last;
                }
                break;
            }
        }
    }
    let found = net.at(uv);
    OnNet {
        uv,
        point: found,
        distance: found.distance(point),
    }
}

/// Newton's step for the square of the distance, in the coordinates that may change. A coordinate at its bound that
/// would leave the square does not change.
fn step(here: &Derivatives, point: DVec3, uv: DVec2) -> Option<DVec2> {
    let away = here.point - point;
    let slope = DVec2::new(away.dot(here.u), away.dot(here.v));
    let is_held =
        |value: f64, slope: f64| value <= 0.0 && slope > 0.0 || value >= 1.0 && slope < 0.0;
    let (fixed_u, fixed_v) = (is_held(uv.x, slope.x), is_held(uv.y, slope.y));
    let (gauss_uu, gauss_vv) = (here.u.length_squared(), here.v.length_squared());
    let gauss_uv = here.u.dot(here.v);
    let uu = gauss_uu + away.dot(here.uu);
    let vv = gauss_vv + away.dot(here.vv);
    let mixed = gauss_uv + away.dot(here.uv);
    // Where the squared distance is not convex, use that of the tangent plane.
    let one = |full: f64, gauss: f64, slope: f64| {
        let by = if full > 0.0 { full } else { gauss };
        if by > 0.0 { -slope / by } else { 0.0 }
    };
    let step = match (fixed_u, fixed_v) {
        (true, true) => return None,
        (true, false) => DVec2::new(0.0, one(vv, gauss_vv, slope.y)),
        (false, true) => DVec2::new(one(uu, gauss_uu, slope.x), 0.0),
        (false, false) => {
            let full = DMat2::from_cols_array(&[uu, mixed, mixed, vv]);
            let gauss = DMat2::from_cols_array(&[gauss_uu, gauss_uv, gauss_uv, gauss_vv]);
            let is_convex = uu > 0.0 && full.determinant() > 1e-12 * uu * vv.abs();
            let by = if is_convex { full } else { gauss };
            match by.determinant().abs() > 1e-14 * gauss_uu * gauss_vv {
                true => -(by.inverse() * slope),
                // At a collapsed side, one derivative is 0, so only the other one is used.
                false => DVec2::new(one(uu, gauss_uu, slope.x), one(vv, gauss_vv, slope.y)),
            }
        }
    };
    (step.is_finite() && step != DVec2::ZERO).then_some(step)
}
