//! ultraviolet: eight samples of one interval at a time.

use glam::Quat;
use tumble::Track;
use ultraviolet::{Bivec3x8, Rotor3x8, Slerp, f32x8};

fn rotor(key: Quat) -> Rotor3x8 {
    let [x, y, z, w] = key.to_array().map(f32x8::splat);
    Rotor3x8::new(w, Bivec3x8::new(-z, y, -x))
}

pub fn slerp(track: Track<'_>, times: &[f32], row: &mut [Quat]) {
    let mut first = 0;
    for i in 0..track.times.len() - 1 {
        let (start, end) = (track.times[i] as f32, track.times[i + 1] as f32);
        let is_last = i + 2 == track.times.len();
        let rest = &times[first..];
        let count = if is_last {
            rest.len()
        } else {
            rest.iter().take_while(|&&time| time < end).count()
        };
        if count == 0 {
            continue;
        }
        let (from, to) = (rotor(track.keys[i]), rotor(track.keys[i + 1]));
        let scale = 1.0 / (end - start);
        let samples = times[first..first + count].chunks(8);
        for (times, rotations) in samples.zip(row[first..first + count].chunks_mut(8)) {
            let mut lanes = [0.0; 8];
            for (lane, time) in lanes.iter_mut().zip(times) {
                *lane = (time - start) * scale;
            }
            let q = from.slerp(to, f32x8::new(lanes));
            let [x, y, z, w] = q.into_quaternion_array().map(f32x8::to_array);
            for (j, rotation) in rotations.iter_mut().enumerate() {
                *rotation = Quat::from_xyzw(x[j], y[j], z[j], w[j]);
            }
        }
        first += count;
    }
}
