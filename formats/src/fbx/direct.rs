//! Evaluates the transform of a node whose curves are in one layer, as `ufbx` does, but only from the curves that have
//! an effect.
//!
//! For each time, `ufbx` looks up nine properties by name and converts constant angles to quaternions again. Here
//! this is done once for each node, and each curve is searched from its last key on. Both results are compared at
//! several times; if they differ, `ufbx` is used for all times.

use std::cell::Cell;

use glam::{DQuat, DVec3};
use ufbx::{
    AnimCurve, AnimValue, Interpolation, Keyframe, MirrorAxis, Node, PropFlags, RotationOrder,
    Transform,
};

use crate::fbx::layers::is_spheric;
use crate::fbx::times::Properties;
use crate::fbx::{ROTATION, SCALE, TRANSLATION};

/// The largest difference between both results, relative to the largest number.
const SAME: f64 = 1e-12;

/// A node's transform as a sum of curves and constants:
/// T · Roff · Rp · Rpre · R · Rpost⁻¹ · Rp⁻¹ · Soff · Sp · S · Sp⁻¹.
pub(super) struct DirectEvaluator<'a> {
    translation: Vector<'a>,
    rotation: Vector<'a>,
    scale: Vector<'a>,
    order: RotationOrder,
    /// The constant rotations before and after that of the curves, if there are any.
    before: Option<DQuat>,
    behind: Option<DQuat>,
    /// Roff + Rp, Sp, and Sp + Soff - Rp; the last rotates with the node.
    offset: DVec3,
    scale_pivot: DVec3,
    rotated_offset: DVec3,
}

/// A vector whose components have curves.
struct Vector<'a> {
    rest: DVec3,
    curves: [Option<Curve<'a>>; 3],
}

/// A curve, and the location of the last search in it.
struct Curve<'a> {
    curve: &'a AnimCurve,
    keys: &'a [Keyframe],
    /// Index of the key after that location.
    next: Cell<usize>,
}

/// The factor from degrees to half of radians.
const HALF: f64 = std::f64::consts::PI / 180.0 * 0.5;

impl<'a> DirectEvaluator<'a> {
    /// `None` for a node whose transform has other parts.
    pub(super) fn of(
        node: &'a Node,
        properties: &Properties,
        value: impl Fn(usize) -> &'a AnimValue,
    ) -> Option<Self> {
        let scaled_above = node.parent.as_deref().is_some_and(|parent| {
            parent.inherit_scale_node.is_some() || parent.scale_helper.is_some()
        });
        if !properties.are_plain
            || node.is_root
            || node.is_scale_helper
            || node.has_adjust_transform
            || node.adjust_mirror_axis != MirrorAxis::None
            || scaled_above
        {
            return None;
        }
        let constant = |name: &str, without: f64| -> Option<DVec3> {
            let Some(found) = ufbx::find_prop(&node.element.props, name) else {
                return Some(DVec3::splat(without));
            };
            let odd = [PropFlags::CONNECTED, PropFlags::OVERRIDDEN];
            let is_odd = odd.into_iter().any(|flag| found.flags.has_any(flag));
            let at = &found.value_vec4;
            (!is_odd).then(|| DVec3::new(at.x, at.y, at.z))
        };
        let vector = |name: &str, without: f64, index: Option<usize>| -> Option<Vector<'a>> {
            let rest = constant(name, without)?;
            let Some(value) = index.map(&value) else {
                return Some(Vector {
                    rest,
                    curves: [None, None, None],
                });
            };
            let at = &value.default_value;
            Some(Vector {
                rest: DVec3::new(at.x, at.y, at.z),
                curves: value
                    .curves
                    .each_ref()
                    .map(|curve| curve.as_deref().map(Curve::of)),
            })
        };
        let angles = |name: &str, order| -> Option<Option<DQuat>> {
            let angles = constant(name, 0.0)?;
            Some((angles != DVec3::ZERO).then(|| euler_rotation(angles, order)))
        };
        let is_spaced = node.use_rotation_space;
        let space = |name: &str| match is_spaced {
            true => angles(name, RotationOrder::Xyz),
            false => Some(None),
        };
        let [rotation_pivot, scale_pivot] = [
            constant("RotationPivot", 0.0)?,
            constant("ScalingPivot", 0.0)?,
        ];
        Some(Self {
            translation: vector("Lcl Translation", 0.0, properties.translation)?,
            rotation: vector("Lcl Rotation", 0.0, properties.rotation)?,
            scale: vector("Lcl Scaling", 1.0, properties.scale)?,
            order: if is_spaced && !is_spheric(node) {
                node.rotation_order
            } else {
                RotationOrder::Xyz
            },
            before: space("PreRotation")?,
            behind: space("PostRotation")?.map(DQuat::conjugate),
            offset: constant("RotationOffset", 0.0)? + rotation_pivot,
            scale_pivot,
            rotated_offset: scale_pivot + constant("ScalingOffset", 0.0)? - rotation_pivot,
        })
    }

    /// Whether the results are those of `ufbx`.
    pub(super) fn is(&self, exact: impl Fn(f64) -> Transform, [begin, end]: [f64; 2]) -> bool {
        [0.0, 0.271, 0.618, 1.0].into_iter().all(|part| {
            let time = begin + part * (end - begin);
            let (exact, ours) = (exact(time), self.at(time, TRANSLATION | ROTATION | SCALE));
            let vectors =
                |of: &Transform| [&of.translation, &of.scale].map(|v| DVec3::new(v.x, v.y, v.z));
            let components = |of: &Transform| {
                let q = &of.rotation;
                DQuat::from_xyzw(q.x, q.y, q.z, q.w)
            };
            let are_near = |(a, b): (DVec3, DVec3)| {
                (a - b).abs().max_element() <= SAME * a.abs().max_element().max(1.0)
            };
            let (a, b) = (components(&exact), components(&ours));
            vectors(&exact)
                .into_iter()
                .zip(vectors(&ours))
                .all(are_near)
                && (a - b).length().min((a + b).length()) <= SAME
        })
    }

    /// The channels of these flags at a time; others have their rest values.
    pub(super) fn at(&self, time: f64, flags: u32) -> Transform {
        let mut found = Transform::default();
        let rotates_offset = self.rotated_offset != DVec3::ZERO || self.scale_pivot != DVec3::ZERO;
        let moves = flags & TRANSLATION != 0;
        let mut rotation = DQuat::IDENTITY;
        if flags & ROTATION != 0 || moves && rotates_offset {
            rotation = euler_rotation(self.rotation.at(time), self.order);
            if let Some(behind) = self.behind {
                rotation *= behind;
            }
            if let Some(before) = self.before {
                rotation = before * rotation;
            }
        }
        [
            found.rotation.x,
            found.rotation.y,
            found.rotation.z,
            found.rotation.w,
        ] = rotation.to_array();
        let mut scale = DVec3::ONE;
        if flags & SCALE != 0 || moves && rotates_offset {
            scale = self.scale.at(time);
        }
        [found.scale.x, found.scale.y, found.scale.z] = scale.to_array();
        if moves {
            let mut translation = self.translation.at(time) + self.offset;
            if rotates_offset {
                translation += rotation * (self.rotated_offset - self.scale_pivot * scale);
            }
            [
                found.translation.x,
                found.translation.y,
                found.translation.z,
            ] = translation.to_array();
        }
        found
    }

    /// Whether the curves of the channels of these flags are constant.
    pub(super) fn is_still(&self, flags: u32) -> bool {
        let rotates_offset = self.rotated_offset != DVec3::ZERO || self.scale_pivot != DVec3::ZERO;
        let carried = flags & TRANSLATION != 0 && rotates_offset;
        let has = |flag: u32| flags & flag != 0;
        (!has(TRANSLATION) || self.translation.is_still())
            && (!has(ROTATION) && !carried || self.rotation.is_still())
            && (!has(SCALE) && !carried || self.scale.is_still())
    }
}

impl Vector<'_> {
    fn at(&self, time: f64) -> DVec3 {
        let rest = self.rest.to_array();
        let axis = |axis: usize| match &self.curves[axis] {
            Some(curve) => curve.at(time, rest[axis]),
            None => rest[axis],
        };
        DVec3::new(axis(0), axis(1), axis(2))
    }

    fn is_still(&self) -> bool {
        self.curves.iter().flatten().all(Curve::is_still)
    }
}

impl<'a> Curve<'a> {
    fn of(curve: &'a AnimCurve) -> Self {
        Self {
            curve,
            keys: curve.keyframes.as_ref(),
            next: Cell::new(1),
        }
    }

    /// Evaluates the curve as `ufbx_evaluate_curve` does, operation by operation.
    fn at(&self, time: f64, rest: f64) -> f64 {
        let keys = self.keys;
        let is_outside = || time < self.curve.min_time || time > self.curve.max_time;
        let next = match keys {
            [] => return rest,
            [only] => return only.value,
            _ if is_outside() => return ufbx::evaluate_curve(self.curve, time, rest),
            _ => self.next(time),
        };
        let (Some(before), Some(next)) = (next.checked_sub(1).map(|i| &keys[i]), keys.get(next))
        else {
            // Before the first key or after the last one.
            return keys[next.min(keys.len() - 1)].value;
        };
        if before.time == time {
            return before.value;
        }
        let per_interval = 1.0 / (next.time - before.time);
        let t = (time - before.time) * per_interval;
        match before.interpolation {
            Interpolation::ConstantPrev => before.value,
            Interpolation::ConstantNext => next.value,
            Interpolation::Linear => before.value * (1.0 - t) + next.value * t,
            Interpolation::Cubic => {
                let x1 = f64::from(before.right.dx) * per_interval;
                let x2 = 1.0 - f64::from(next.left.dx) * per_interval;
                let t = bezier_parameter(x1, x2, t);
                let (t2, u) = (t * t, 1.0 - t);
                let (t3, u2) = (t2 * t, u * u);
                let u3 = u2 * u;
                let y1 = before.value + f64::from(before.right.dy);
                let y2 = next.value - f64::from(next.left.dy);
                u3 * before.value + 3.0 * (u2 * t * y1 + u * t2 * y2) + t3 * next.value
            }
        }
    }

    /// Index of the first key after a time.
    fn next(&self, time: f64) -> usize {
        let keys = self.keys;
        let is_it = |index: usize| {
            let before = index.checked_sub(1).and_then(|index| keys.get(index));
            before.is_some_and(|key| key.time <= time)
                && keys.get(index).is_some_and(|key| time < key.time)
        };
        let last = self.next.get();
        let found = match [last, last + 1].into_iter().find(|&index| is_it(index)) {
            Some(found) => found,
            None => keys.partition_point(|key| key.time <= time),
        };
        self.next.set(found);
        found
    }

    fn is_still(&self) -> bool {
        let Some(first) = self.keys.first() else {
            return true;
        };
        let is_flat = |pair: &[Keyframe]| {
            pair[1].value == first.value
                && (pair[0].interpolation != Interpolation::Cubic
                    || pair[0].right.dy == 0.0 && pair[1].left.dy == 0.0)
        };
        let is_slope = |of: &ufbx::Extrapolation| of.mode == ufbx::ExtrapolationMode::Slope;
        self.keys.windows(2).all(is_flat)
            && (self.keys.len() < 2
                || !is_slope(&self.curve.pre_extrapolation)
                    && !is_slope(&self.curve.post_extrapolation))
    }
}

/// Solves B(t) = x0 by Newton's method, where B is the cubic Bézier polynomial with the control values 0, p1, p2, 1.
fn bezier_parameter(p1: f64, p2: f64, x0: f64) -> f64 {
    let (p1_3, p2_3) = (p1 * 3.0, p2 * 3.0);
    let (a, b, c) = (p1_3 - p2_3 + 1.0, p2_3 - p1_3 - p1_3, p1_3);
    let (a_3, b_2) = (3.0 * a, 2.0 * b);
    let mut t = x0;
    let mut step = || {
        let t2 = t * t;
        let off = a * (t2 * t) + b * t2 + c * t - x0;
        t -= off / (a_3 * t2 + b_2 * t + c);
        (t, off.abs() <= 8.881_784_197_001_252e-16)
    };
    // Most times need only two steps of Newton's iteration.
    let mut found = step();
    for _ in 0..10 {
        if found.1 {
            break;
        }
        found = step();
    }
    found.0
}

/// The rotation of Euler angles in degrees.
fn euler_rotation(angles: DVec3, order: RotationOrder) -> DQuat {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.to_array().map(|angle| libm::sincos(angle * HALF));
    let [x, y, z] = [
        DQuat::from_xyzw(sx, 0.0, 0.0, cx),
        DQuat::from_xyzw(0.0, sy, 0.0, cy),
        DQuat::from_xyzw(0.0, 0.0, sz, cz),
    ];
    // The rotation about the first axis is applied first, so it is the rightmost factor.
    match order {
        RotationOrder::Xyz => z * y * x,
        RotationOrder::Xzy => y * z * x,
        RotationOrder::Yzx => x * z * y,
        RotationOrder::Yxz => z * x * y,
        RotationOrder::Zxy => y * x * z,
        RotationOrder::Zyx => x * y * z,
        RotationOrder::Spheric => DQuat::IDENTITY,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::*;
    use crate::budget::Budget;
    use crate::fbx::load;
    use crate::fbx::times::Takes;
    use crate::limits::Limits;

    /// Most nodes that curves move are evaluated here, and give `ufbx`'s values at every time.
    #[test]
    fn curves_give_what_ufbx_does() {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let fixtures = package.join("tests/fixtures/fbx");
        let shared = Some(package.join("../../shared/data/fbx")).filter(|folder| folder.is_dir());
        let has_shared = shared.is_some();
        let files = |folder: PathBuf| {
            fs::read_dir(folder)
                .unwrap()
                .map(|entry| entry.unwrap().path())
        };
        let (mut here, mut asked) = (0, 0);
        for path in [fixtures].into_iter().chain(shared).flat_map(files) {
            let bytes = fs::read(&path).unwrap();
            let budget = Budget::of(bytes.len(), Limits::default());
            let Ok(scene) = load("t", &bytes, &budget) else {
                continue;
            };
            for stack in &scene.anim_stacks {
                let layers: Vec<usize> = (0..stack.layers.len()).collect();
                let Ok(takes) = Takes::of(&scene, stack, &layers, &budget) else {
                    continue;
                };
                for (&node, properties) in &takes.properties {
                    let node = &scene.nodes[node];
                    let value = |index: usize| -> &AnimValue {
                        &stack.layers[0].anim_props[index].anim_value
                    };
                    let exact = |time: f64| ufbx::evaluate_transform(&stack.anim, node, time);
                    let direct = DirectEvaluator::of(node, properties, value);
                    let Some(direct) = direct.filter(|direct| direct.is(exact, takes.span)) else {
                        asked += 1;
                        continue;
                    };
                    here += 1;
                    let [begin, end] = takes.span;
                    for step in -20..=220 {
                        let time = begin + (end - begin) * f64::from(step) / 200.0;
                        let of = format!("{}, {}, {time} s", path.display(), &*node.element.name);
                        assert!(direct.is(exact, [time; 2]), "{of}");
                    }
                }
            }
        }
        assert!(here >= 5 && asked >= 1, "{here} {asked}");
        // Most other nodes belong to one character, whose bones inherit scales as usual.
        assert!(!has_shared || here >= 30, "{here} {asked}");
    }
}
