//! Twin of `shaders/stores/euler.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::shader::*;
use crate::twin::arc_tangent::{arc_tangent, flushed, root};

#[inline(always)]
fn select<T>(otherwise: T, value: T, condition: bool) -> T {
    if condition { value } else { otherwise }
}

#[inline(always)]
pub(super) fn wrapped(angle: f32) -> f32 {
    let low = select(angle, (angle + 2.0 * PI) + 2.0 * PI_LOW, angle < -PI);
    select(low, (low - 2.0 * PI) - 2.0 * PI_LOW, low > PI)
}

#[inline(always)]
pub(crate) fn euler(rotation: [f32; 4], detail: u32) -> [f32; 3] {
    let symmetric = detail & SYMMETRIC != 0;
    let intrinsic = detail & INTRINSIC != 0;
    let sign = select(1.0, -1.0, detail & NEGATIVE != 0);
    let w = rotation[3];
    let i = rotation[(detail & 3) as usize];
    let j = rotation[(detail >> 2 & 3) as usize];
    let k = rotation[(detail >> 4 & 3) as usize] * sign;
    let a = flushed(select(w - j, w, symmetric));
    let b = flushed(select(i + k, i, symmetric));
    let c = flushed(select(j + w, j, symmetric));
    let d = flushed(select(k - i, k, symmetric));
    let near = root(c * c + d * d);
    let wide = root(a * a + b * b);
    let half_sum = arc_tangent(b, a);
    let half_difference = arc_tangent(d, c);
    let closed = near < GIMBAL;
    let open = wide < GIMBAL;
    let locked = closed || open;
    let sum = half_sum + half_difference;
    let difference = half_sum - half_difference;
    let opposite = select(-half_difference, half_difference, intrinsic);
    let together = 2.0 * select(opposite, half_sum, closed);
    let third_sign = select(sign, 1.0, symmetric);
    let outer = select(
        select(difference, sum * third_sign, intrinsic),
        together,
        locked,
    );
    let inner = select(select(sum * third_sign, difference, intrinsic), 0.0, locked);
    let first = select(outer, outer * third_sign, locked && intrinsic);
    let whole = 2.0 * arc_tangent(near, wide);
    let second = select((whole - HALF_PI) - HALF_PI_LOW, whole, symmetric);
    [
        wrapped(first) * DEGREES,
        wrapped(second) * DEGREES,
        wrapped(inner) * DEGREES,
    ]
}

#[inline(always)]
pub(crate) fn store(rotation: [f32; 4], detail: u32) -> [f32; 3] {
    euler(rotation, detail).map(canonical)
}
