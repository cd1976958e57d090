//! Bevy's curves, as its animation player samples them: one sample at a time, a search
//! for each.

#[cfg(feature = "bevy")]
use bevy_animation::gltf_curves::CubicRotationCurve;
use bevy_curve::{Curve, UnevenSampleAutoCurve};
use glam::Quat;
use rayon::prelude::*;
use tumble::{Track, TrackSet};

fn tracks(set: &TrackSet) -> impl Iterator<Item = Track<'_>> {
    (0..set.track_count()).map(|index| set.track(index))
}

pub fn arcs(set: &TrackSet) -> Vec<UnevenSampleAutoCurve<bevy_math::Quat>> {
    let curve = |track: Track<'_>| {
        let keys = track.keys.iter();
        let quats = keys.map(|key| bevy_math::Quat::from_array(key.to_array()));
        let times = track.times.iter().map(|&time| time as f32);
        UnevenSampleAutoCurve::new(times.zip(quats)).expect("uneven times")
    };
    tracks(set).map(curve).collect()
}

/// With the tangents of the parabola through three keys, component by component.
#[cfg(feature = "bevy")]
pub fn hermite(set: &TrackSet) -> Vec<CubicRotationCurve> {
    let curve = |track: Track<'_>| {
        let mut keys: Vec<bevy_math::Vec4> = Vec::new();
        for key in track.keys {
            let mut value = bevy_math::Vec4::from_array(key.to_array());
            if keys.last().is_some_and(|last| last.dot(value) < 0.0) {
                value = -value;
            }
            keys.push(value);
        }
        let times: Vec<f32> = track.times.iter().map(|&time| time as f32).collect();
        let last = keys.len() - 1;
        let tangent = |i: usize| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
            (keys[after] - keys[before]) / (times[after] - times[before])
        };
        let values = (0..=last).flat_map(|i| [tangent(i), keys[i], tangent(i)]);
        CubicRotationCurve::new(times.iter().copied(), values).expect("uneven times")
    };
    tracks(set).map(curve).collect()
}

pub fn sample<C: Curve<bevy_math::Quat> + Sync>(curves: &[C], times: &[f32], output: &mut [Quat]) {
    let rows = output.par_chunks_mut(times.len());
    rows.zip(curves).for_each(|(row, curve)| {
        for (rotation, &time) in row.iter_mut().zip(times) {
            *rotation = Quat::from_array(curve.sample_clamped(time).to_array());
        }
    });
}

/// A sample of each curve, on this thread.
pub fn pose<C: Curve<bevy_math::Quat>>(curves: &[C], time: f32, output: &mut [Quat]) {
    for (rotation, curve) in output.iter_mut().zip(curves) {
        *rotation = Quat::from_array(curve.sample_clamped(time).to_array());
    }
}
