//! States in other frames: their mirror images, and states in the heading frames of their roots.

use std::ops::Range;

use glam::{DQuat, DVec3};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tumble::crowd::MotionStates;
use tumble_formats::learning::{
    self, Ground, HeadingFrame, HeadingSource, mirrored_point, mirrored_rotation,
};

use crate::errors::{guarded, input};
use crate::motions::{MANY, rows};
use crate::names::option_named;
use crate::run::stoppable;

/// The partners of joints on the other side: those of `pairs`, or by the words for sides in the names. The tree of the
/// joints has to be symmetric: the parent of a joint's partner is the partner of its parent.
#[pyfunction]
pub(crate) fn joint_partners(
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    pairs: Option<Vec<usize>>,
) -> PyResult<Vec<usize>> {
    let joints = parents.len();
    let name = |joint: usize| names.get(joint).map_or("", String::as_str);
    let shown = |joint: usize| format!("joint {joint} ({})", name(joint));
    let pairs = match pairs {
        Some(pairs) => pairs,
        None => {
            let pairs = learning::mirror_pairs(&names);
            if let Some(&alone) = learning::without_partner(&names, &pairs).first() {
                return Err(input(format!(
                    "pairs: {} has no partner on the other side; give the partner of each joint",
                    shown(alone)
                )));
            }
            if joints > 1
                && pairs
                    .iter()
                    .enumerate()
                    .all(|(joint, &other)| joint == other)
            {
                return Err(input(
                    "pairs: no joint has a name with a side, such as `left_hip`; give the partner of each joint",
                ));
            }
            pairs
        }
    };
    let partner = |joint: usize| pairs.get(joint).copied();
    if pairs.len() != joints || (0..joints).any(|it| partner(it).and_then(partner) != Some(it)) {
        return Err(input(format!(
            "pairs: give {joints} indices, one for each joint, so that each joint is the partner of its partner"
        )));
    }
    for joint in 0..joints {
        if parents[pairs[joint]] != parents[joint].map(|parent| pairs[parent]) {
            return Err(input(format!(
                "pairs: {} and its partner, {}, do not have parents that are partners",
                shown(joint),
                shown(pairs[joint])
            )));
        }
    }
    Ok(pairs)
}

/// The states that are mirrored, the axis across the plane, and the partner of each joint.
type MirroredStates<'py> = (PyReadonlyArray1<'py, bool>, usize, Vec<usize>);

/// The axis that points up, the source of the heading, the root, the parents of the joints, and how many states after one
/// another have the frame of the first of them.
type HeadingStates = (String, String, Vec<Option<usize>>, usize);

/// Changes arrays of states in place, which are those of `Motions.sample`: first some become their mirror images, then all
/// are expressed in heading frames.
#[pyfunction]
pub(crate) fn reframe(
    py: Python<'_>,
    arrays: [Option<Bound<'_, PyArrayDyn<f32>>>; 5],
    joints: usize,
    mirror: Option<MirroredStates<'_>>,
    heading: Option<HeadingStates>,
) -> PyResult<()> {
    let mut outputs = arrays
        .iter()
        .map(|array| {
            array
                .as_ref()
                .map(PyArrayMethods::try_readwrite)
                .transpose()
        })
        .collect::<Result<Vec<_>, _>>()
        .map_err(|error| input(format!("out: {error}")))?;
    let count = arrays.iter().flatten().map(|array| match array.shape() {
        [.., numbers] => array.len() / numbers,
        [] => 0,
    });
    let all = count.max().unwrap_or(0);
    let [r, p, w, v, a] = &mut outputs[..] else {
        return Ok(());
    };
    let mut states = MotionStates {
        rotations: rows(r, all)?,
        positions: rows(p, all)?,
        world_rotations: rows(w, all)?,
        velocities: rows(v, all)?,
        angular_velocities: rows(a, all)?,
    };
    let frame = match &heading {
        None => None,
        Some((up, source, parents, count)) => {
            let (ground, source): (Ground, HeadingSource) =
                (option_named(up, "up")?, option_named(source, "heading")?);
            Some((ground, source, &parents[..], *count))
        }
    };
    let mirror = mirror.as_ref();
    let mirror = mirror.map(|(mask, axis, pairs)| Ok((mask.as_slice()?, *axis, &pairs[..])));
    let mirror = mirror
        .transpose()
        .map_err(|error: numpy::AsSliceError| input(error.to_string()))?;
    let work = || {
        if let Some((mask, axis, pairs)) = mirror {
            let marked = mask
                .iter()
                .enumerate()
                .filter(|(_, is_mirrored)| **is_mirrored);
            for (instance, _) in marked {
                mirror_state(
                    &mut states,
                    instance * joints..(instance + 1) * joints,
                    axis,
                    pairs,
                );
            }
        }
        if let Some((ground, source, parents, count)) = frame {
            let each = (joints * count).max(1);
            for first in (0..all).step_by(each) {
                let of = |root: usize| root_frame(&states, first + root, (ground, source));
                let root = parents.iter().position(Option::is_none).unwrap_or(0);
                let frame = of(root);
                to_frame(&mut states, first..first + each, &frame, parents);
            }
        }
        Ok(())
    };
    py.detach(|| match all < MANY {
        true => guarded(work),
        false => stoppable(work),
    })
}

/// Changes some rows of an array that is not left out.
fn each<const N: usize>(rows: &mut [[f32; N]], at: Range<usize>, of: impl Fn(&mut [[f32; N]])) {
    if let Some(rows) = rows.get_mut(at) {
        of(rows);
    }
}

fn point([x, y, z]: [f32; 3]) -> DVec3 {
    DVec3::new(x.into(), y.into(), z.into())
}

fn rotation(xyzw: [f32; 4]) -> DQuat {
    DQuat::from_array(xyzw.map(f64::from))
}

/// A state becomes its mirror image, which is exact.
fn mirror_state(states: &mut MotionStates<'_>, at: Range<usize>, axis: usize, pairs: &[usize]) {
    fn exchanged<const N: usize>(
        rows: &mut [[f32; N]],
        pairs: &[usize],
        of: impl Fn([f32; N]) -> [f32; N],
    ) {
        for (joint, &partner) in pairs.iter().enumerate() {
            if joint < partner {
                rows.swap(joint, partner);
            }
        }
        for row in rows {
            *row = of(*row);
        }
    }
    let of_point = |row| mirrored_point(point(row), axis).as_vec3().to_array();
    // An angular velocity is mirrored as the vector of a rotation.
    let of_rate = |row| (-mirrored_point(point(row), axis)).as_vec3().to_array();
    let of_rotation = |row| mirrored_rotation(rotation(row), axis).as_quat().to_array();
    for rotations in [&mut states.rotations, &mut states.world_rotations] {
        each(rotations, at.clone(), |rows| {
            exchanged(rows, pairs, of_rotation);
        });
    }
    for vectors in [&mut states.positions, &mut states.velocities] {
        each(vectors, at.clone(), |rows| exchanged(rows, pairs, of_point));
    }
    let rates = &mut states.angular_velocities;
    each(rates, at, |rows| exchanged(rows, pairs, of_rate));
}

/// The heading frame of a root, whose rotation relative to its parent is that in the world.
fn root_frame(
    states: &MotionStates<'_>,
    root: usize,
    (ground, source): (Ground, HeadingSource),
) -> HeadingFrame {
    let rotations = [&states.world_rotations, &states.rotations];
    let found = rotations.into_iter().find_map(|array| array.get(root));
    let rotation = found.map_or(DQuat::IDENTITY, |&xyzw| rotation(xyzw).normalize());
    let position = states
        .positions
        .get(root)
        .map_or(DVec3::ZERO, |&row| point(row));
    HeadingFrame::of(position, rotation, ground, source)
}

/// Expresses states in a heading frame.
fn to_frame(
    states: &mut MotionStates<'_>,
    at: Range<usize>,
    frame: &HeadingFrame,
    parents: &[Option<usize>],
) {
    let of_rotation = |row: &mut [f32; 4]| {
        *row = frame.rotation(rotation(*row)).as_quat().to_array();
    };
    let of_vectors = |rows: &mut [[f32; 3]]| {
        for row in rows {
            *row = frame.vector(point(*row)).as_vec3().to_array();
        }
    };
    each(states.world_rotations, at.clone(), |rows| {
        rows.iter_mut().for_each(of_rotation);
    });
    // Only the rotations of roots are changed. Those of other joints are relative to their parents, so they are the
    // same in every frame.
    each(states.rotations, at.clone(), |rows| {
        for state in rows.chunks_mut(parents.len()) {
            let roots = state
                .iter_mut()
                .zip(parents)
                .filter(|(_, parent)| parent.is_none());
            roots.for_each(|(row, _)| of_rotation(row));
        }
    });
    each(states.positions, at.clone(), |rows| {
        for row in rows {
            *row = frame.position(point(*row)).as_vec3().to_array();
        }
    });
    each(states.velocities, at.clone(), of_vectors);
    each(states.angular_velocities, at, of_vectors);
}
