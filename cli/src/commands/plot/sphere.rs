//! A ball seen from afar: paths of directions on it.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::commands::plot::figure::PlotCurve;
use crate::messages::colours::GRID;

/// The direction of a rotated axis, seen from the right and from above: x to
/// the right, y up, z towards the eye.
pub(crate) fn seen(rotation: Quat, axis: Vec3) -> DVec3 {
    to_view((rotation * axis).as_dvec3())
}

fn to_view(direction: DVec3) -> DVec3 {
    const RIGHT: f64 = 0.6;
    const ABOVE: f64 = 0.4;
    DQuat::from_rotation_x(ABOVE) * (DQuat::from_rotation_y(-RIGHT) * direction)
}

/// The parts of a path on the near or on the far side; neighbours share a point.
pub(crate) fn side(path: &[DVec3], front: bool) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<(f64, f64)> = Vec::new();
    for pair in path.windows(2) {
        if (pair[0].z + pair[1].z >= 0.0) == front {
            if piece.is_empty() {
                piece.push((pair[0].x, pair[0].y));
            }
            piece.push((pair[1].x, pair[1].y));
        } else if !piece.is_empty() {
            pieces.push(std::mem::take(&mut piece));
        }
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// The rim of the ball, and its circles of latitude and longitude, 30° apart.
pub(crate) fn graticule() -> Vec<PlotCurve> {
    let circle = |point: &dyn Fn(f64) -> DVec3| -> Vec<DVec3> {
        let steps = (0..=120).map(|step| point(f64::from(step).to_radians() * 3.0));
        steps.collect()
    };
    let mut curves = Vec::new();
    let mut draw = |pieces, width| {
        curves.push(PlotCurve {
            colour: GRID,
            width,
            opacity: 1.0,
            pieces,
        });
    };
    for degrees in (-60..=60).step_by(30) {
        let (height, radius) = f64::from(degrees).to_radians().sin_cos();
        let parallel = circle(&|a| to_view(DVec3::new(radius * a.cos(), height, radius * a.sin())));
        draw(side(&parallel, true), 1.0);
    }
    for degrees in (0..180).step_by(30) {
        let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
        let meridian = circle(&|a| to_view(DVec3::new(cosine * a.cos(), a.sin(), sine * a.cos())));
        draw(side(&meridian, true), 1.0);
    }
    let rim = circle(&|a| DVec3::new(a.cos(), a.sin(), 0.0));
    draw(
        vec![rim.iter().map(|point| (point.x, point.y)).collect()],
        1.5,
    );
    curves
}
