//! `tumble.retarget`: motions on other skeletons.

use std::sync::Arc;

use glam::DQuat;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tumble_formats::retarget::{
    HipsScale, RestAlignment, RetargetError, RetargetOptions, RetargetReport,
};

use crate::arrays::doubles;
use crate::clip::Clip;
use crate::errors::{in_python, input, of_track};
use crate::names::{one_of, option_of};
use crate::run::interruptible;

/// Carries a motion over to another skeleton; returns the clip and a report.
///
/// * `target`: a clip with the skeleton.
/// * `bones`: the pairs of joints, a dict of names of the target's joints to those of the source's. By default
///   joints are paired by the parts of the body that their names mean (VRM, Mixamo, SMPL, LAFAN1, CMU, Xsens,
///   Unreal, SOMA).
/// * `rest`: "same" if both skeletons rest in the same pose; "directions" to turn the limbs of the target to the
///   directions of the source's; "auto" to do this only if a direction differs by more than 5 degrees.
/// * `rest_frame`: the index of the key of the source whose pose is its rest pose, such as a T-pose in which takes
///   begin.
/// * `scale`: the factor for the hips' translations: "hips" for the ratio of their heights, "legs" for that of the
///   lengths of the legs, or a number.
/// * `axes`: the rotation x y z w from the axes of the source to those of the target; by default it is derived from
///   the positions of hips, head and legs.
///
/// In the world, each joint rotates away from its rest pose as its partner does. Times are those of the source.
/// Joints without a partner keep their rest rotations; translations of joints other than the hips are lost. The
/// report is a dict:
///
/// * `pairs`, `resting`, `dropped`: the paired joints, the joints of the target without a partner, and those of the
///   source without one.
/// * `furthest_dropped`: of the dropped joints, the one that rotates furthest from its rest pose, with the angle in
///   degrees; or None.
/// * `aligned`: the angle in degrees by which the rest pose of each joint was aligned.
/// * `scale`, `axes`, `axes_assumed`: the factor and the rotation that were used, and whether the rotation is only
///   assumed.
/// * `dropped_translation`: the largest translation that was lost, in the unit of the source.
/// * `largest_difference`: caused by rounding, in rad.
/// * `ends`: the largest distances of hands and feet from those of the source, in heights of the hips.
/// * `below_ground`: the largest distance of a foot below the lowest joint of the rest pose, in the unit of the target.
/// * `stood_along`: the axis along which an SMPL body stands, if it was found and is not y (the motion was then
///   rotated to y up); else None.
/// * `rests_along`: the axes along which the body stands in its rest pose and in the motion, if these differ (then
///   give `rest_frame`); else None.
///
/// >>> import tumble
/// >>> keys = [[[0, 0, 0, 1], [0, 0, 1, 0]], [[0, 0, 0, 1], [0, 0, 0, 1]]]
/// >>> made = dict(layout="track", parents=[None, 0], offsets=[[0, 1, 0], [0, 1, 0]])
/// >>> source = tumble.Clip([0.0, 1.0], keys, names=["a", "b"], **made)
/// >>> target = tumble.Clip([0.0, 1.0], keys, names=["root", "tip"], **made)
/// >>> clip, report = tumble.retarget(source, target, bones={"root": "a", "tip": "b"})
/// >>> report["pairs"]
/// {'root': 'a', 'tip': 'b'}
#[pyfunction]
#[pyo3(signature = (clip, target, *, bones=None, rest=None, rest_frame=None, scale=None, axes=None), text_signature = "(clip, target, *, bones=None, rest='auto', rest_frame=None, scale='hips', axes=None)")]
pub(crate) fn retarget<'py>(
    clip: &Bound<'py, Clip>,
    target: &Bound<'py, Clip>,
    bones: Option<&Bound<'py, PyDict>>,
    rest: Option<&Bound<'py, PyAny>>,
    rest_frame: Option<usize>,
    scale: Option<&Bound<'py, PyAny>>,
    axes: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Clip, Bound<'py, PyDict>)> {
    let py = clip.py();
    let mut pairs = Vec::new();
    for (joint, partner) in bones.into_iter().flatten() {
        pairs.push((joint.extract()?, partner.extract()?));
    }
    let options = RetargetOptions {
        bones: pairs,
        rest: rest.map_or(Ok(RestAlignment::Auto), |rest| option_of(rest, "rest"))?,
        rest_frame,
        scale: scale.map_or(Ok(HipsScale::Hips), scale_of)?,
        axes: axes.map(axes_of).transpose()?,
    };
    let (source, target) = (clip.get().clone(), target.get().clone());
    let (motion, report) = interruptible(py, move || {
        tumble_formats::retarget::retarget(&source.motion, &target.motion, &options)
            .map_err(|error| of_retarget(&error))
    })?;
    let made = Clip {
        motion: Arc::new(motion),
        source: None,
    };
    Ok((made, report_of(py, &report)?))
}

fn scale_of(scale: &Bound<'_, PyAny>) -> PyResult<HipsScale> {
    match scale.is_instance_of::<PyString>() {
        true => one_of(
            scale,
            "scale",
            &[("hips", HipsScale::Hips), ("legs", HipsScale::Legs)],
        ),
        false => Ok(HipsScale::Factor(scale.extract()?)),
    }
}

fn axes_of(axes: &Bound<'_, PyAny>) -> PyResult<DQuat> {
    let numbers = doubles(axes, "axes")?;
    let rotation = <[f64; 4]>::try_from(&numbers.values[..]).map(DQuat::from_array);
    match rotation {
        Ok(rotation) if rotation.length() > 1e-6 && rotation.is_finite() => {
            Ok(rotation.normalize())
        }
        _ => Err(input("axes: give a rotation, x y z w")),
    }
}

fn of_retarget(error: &RetargetError) -> PyErr {
    match error {
        RetargetError::Track(error) => of_track(error),
        error => input(in_python(&error.to_string())),
    }
}

fn report_of<'py>(py: Python<'py>, report: &RetargetReport) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    let pairs = PyDict::new(py);
    for (joint, partner) in &report.pairs {
        pairs.set_item(joint, partner)?;
    }
    let aligned = PyDict::new(py);
    for (joint, degrees) in &report.aligned {
        aligned.set_item(joint, degrees)?;
    }
    found.set_item("pairs", pairs)?;
    found.set_item("resting", &report.resting)?;
    found.set_item("dropped", &report.dropped)?;
    found.set_item("furthest_dropped", &report.furthest_dropped)?;
    found.set_item("aligned", aligned)?;
    found.set_item("scale", report.scale)?;
    found.set_item("axes", report.axes.to_array())?;
    found.set_item("axes_assumed", report.are_axes_assumed)?;
    found.set_item("dropped_translation", report.dropped_translation)?;
    found.set_item("largest_difference", report.largest_difference)?;
    let ends = PyDict::new(py);
    for (joint, distance) in &report.ends {
        ends.set_item(joint, distance)?;
    }
    found.set_item("ends", ends)?;
    found.set_item("below_ground", report.below_ground)?;
    found.set_item(
        "stood_along",
        report.stood_along.map(|axis| axis.to_array()),
    )?;
    let axes = report
        .rests_along
        .map(|axes| axes.map(|axis| axis.to_array()));
    found.set_item("rests_along", axes)?;
    Ok(found)
}
