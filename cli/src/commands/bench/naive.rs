//! The loop that a user would write today: glam, f32, a cursor for each track, rayon over tracks. Reported ratios are
//! relative to its time.

use glam::{Quat, Vec3};
use rayon::prelude::*;
use tumble::{Track, TrackSet};

use crate::commands::bench::workload::Workload;

/// Slerp by [`Quat::slerp`].
pub(crate) fn slerp(workload: &Workload, output: &mut [Quat]) {
    each_track(workload, output, |track, times, row| {
        let mut cursor = Cursor::new(track);
        for (&time, rotation) in times.iter().zip(row) {
            let t = cursor.advance(time);
            let i = cursor.interval;
            *rotation = track.keys[i].slerp(track.keys[i + 1], t);
        }
    });
}

/// Bessel-Overhauser as a product of scaled axes, its three vectors worked out when
/// the cursor moves.
pub(crate) fn cubic(workload: &Workload, output: &mut [Quat]) {
    each_track(workload, output, |track, times, row| {
        let mut cursor = Cursor::new(track);
        let mut vectors = (usize::MAX, [Vec3::ZERO; 3]);
        for (&time, rotation) in times.iter().zip(row) {
            let t = cursor.advance(time);
            let i = cursor.interval;
            if vectors.0 != i {
                vectors = (i, control_vectors(track, i));
            }
            *rotation = product(track.keys[i], vectors.1, t);
        }
    });
}

/// The product of scaled axes at a parameter.
fn product(key: Quat, [first, second, third]: [Vec3; 3], t: f32) -> Quat {
    let u = 1.0 - t;
    key * Quat::from_scaled_axis(first * (1.0 - u * u * u))
        * Quat::from_scaled_axis(second * (t * t * (3.0 - 2.0 * t)))
        * Quat::from_scaled_axis(third * (t * t * t))
}

/// A cursor for each track, for poses at times that only grow.
pub(crate) fn cursors(set: &TrackSet) -> Vec<Cursor<'_>> {
    set.tracks().map(Cursor::new).collect()
}

/// Every track at one time by [`Quat::slerp`].
pub(crate) fn slerp_pose(cursors: &mut [Cursor<'_>], time: f64, output: &mut [Quat]) {
    for (cursor, rotation) in cursors.iter_mut().zip(output) {
        let t = cursor.advance(time);
        let (keys, i) = (cursor.track.keys, cursor.interval);
        *rotation = keys[i].slerp(keys[i + 1], t);
    }
}

/// Every track at one time as in [`cubic`]. `known` has the vectors of the interval where each track was last.
pub(crate) fn cubic_pose(
    cursors: &mut [Cursor<'_>],
    time: f64,
    known: &mut [(usize, [Vec3; 3])],
    output: &mut [Quat],
) {
    for ((cursor, rotation), vectors) in cursors.iter_mut().zip(output).zip(known) {
        let t = cursor.advance(time);
        let (track, i) = (cursor.track, cursor.interval);
        if vectors.0 != i {
            *vectors = (i, control_vectors(track, i));
        }
        *rotation = product(track.keys[i], vectors.1, t);
    }
}

/// The position of a time in an interval, from 0 to 1.
fn parameter(track: Track<'_>, i: usize, time: f64) -> f32 {
    let (start, end) = (track.times[i], track.times[i + 1]);
    ((time - start) / (end - start)) as f32
}

fn each_track(
    workload: &Workload,
    output: &mut [Quat],
    evaluate: impl Fn(Track<'_>, &[f64], &mut [Quat]) + Sync,
) {
    let set: &TrackSet = &workload.set;
    let samples = output.len() / set.track_count();
    output
        .par_chunks_mut(samples)
        .with_min_len(if samples == 1 { 1024 } else { 1 })
        .enumerate()
        .for_each(|(index, row)| {
            let times = if workload.per_track {
                &workload.times[index * samples..][..samples]
            } else {
                &workload.times
            };
            evaluate(set.track(index), times, row);
        });
}

/// The interval of a time that only increases.
pub(crate) struct Cursor<'a> {
    track: Track<'a>,
    interval: usize,
}

impl<'a> Cursor<'a> {
    fn new(track: Track<'a>) -> Self {
        Self { track, interval: 0 }
    }

    /// Moves to the interval of `time`; returns the position in the interval, from 0 to 1.
    fn advance(&mut self, time: f64) -> f32 {
        let times = self.track.times;
        while self.interval + 2 < times.len() && times[self.interval + 1] <= time {
            self.interval += 1;
        }
        parameter(self.track, self.interval, time)
    }
}

fn step(track: Track<'_>, i: usize) -> Vec3 {
    let (from, to) = (track.keys[i], track.keys[i + 1]);
    let to = if from.dot(to) < 0.0 { -to } else { to };
    (from.inverse() * to).to_scaled_axis()
}

/// The tangent at an inner key, per second.
fn tangent(track: Track<'_>, i: usize) -> Vec3 {
    let before = (track.times[i] - track.times[i - 1]) as f32;
    let after = (track.times[i + 1] - track.times[i]) as f32;
    let left = Quat::from_scaled_axis(step(track, i - 1) * (after / before));
    let right = Quat::from_scaled_axis(step(track, i) * (before / after));
    (left * right).to_scaled_axis() / (before + after)
}

fn control_vectors(track: Track<'_>, i: usize) -> [Vec3; 3] {
    let third = (track.times[i + 1] - track.times[i]) as f32 / 3.0;
    let whole = step(track, i);
    let last = track.keys.len() - 2;
    let mut outgoing = (i > 0).then(|| tangent(track, i) * third);
    let mut incoming = (i < last).then(|| tangent(track, i + 1) * third);
    if outgoing.is_none() {
        outgoing = incoming.map(|incoming| whole * (2.0 / 3.0) - incoming);
    }
    if incoming.is_none() {
        incoming = outgoing.map(|outgoing| whole * (2.0 / 3.0) - outgoing);
    }
    let (Some(outgoing), Some(incoming)) = (outgoing, incoming) else {
        return [whole / 3.0; 3];
    };
    let middle = Quat::from_scaled_axis(-outgoing)
        * Quat::from_scaled_axis(whole)
        * Quat::from_scaled_axis(-incoming);
    [outgoing, middle.to_scaled_axis(), incoming]
}
