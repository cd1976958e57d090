//! ozz-animation-rs, on the keys that the others read: a sampling job for each pose.
//!
//! ```text
//! tumble-peers-ozz KEYS FOLDER    called by race.py
//! ```
//!
//! The library reads animations, but does not make them: [`archive`] writes one as ozz's own builder does without its
//! optimizer, every key kept. A job computes translations and scales too. These are constant here.

mod archive;

use std::hint::black_box;
use std::time::{Duration, Instant};
use std::{env, fs};

use glam::{DQuat, DVec3, Quat};
use ozz_animation_rs::{Animation, Archive, SamplingContext, SamplingJob, SamplingJobRef};
use ozz_animation_rs::{SoaQuat, SoaTransform};

/// As in the race of the others.
const ROUNDS: usize = 3;
const TIMED: usize = 100;
/// The calls whose poses are compared with the reference.
const CHECKED: usize = 2000;

/// The content of the file that `tumble-peers write-poses` writes.
pub struct Motion {
    pub tracks: usize,
    pub keys_per_track: usize,
    pub rate: f64,
    /// `[track][key]`.
    pub keys: Vec<Quat>,
    /// Of the calls: times that go on, and any times.
    times: [Vec<f64>; 2],
}

impl Motion {
    fn read(bytes: &[u8]) -> Self {
        let count = |index: usize| -> usize {
            let word = bytes[4 * index..][..4].try_into().expect("four bytes");
            u32::from_le_bytes(word) as usize
        };
        let (tracks, keys_per_track, calls) = (count(0), count(1), count(2));
        let rate = f64::from_le_bytes(bytes[12..20].try_into().expect("eight bytes"));
        let (times, keys) = bytes[20..].split_at(16 * calls);
        let times: Vec<f64> = bytemuck::pod_collect_to_vec(times);
        Self {
            tracks,
            keys_per_track,
            rate,
            keys: bytemuck::pod_collect_to_vec(keys),
            times: [times[..calls].to_vec(), times[calls..].to_vec()],
        }
    }

    pub fn duration(&self) -> f64 {
        (self.keys_per_track - 1) as f64 / self.rate
    }

    /// Slerp in f64, without a threshold.
    fn reference(&self, track: usize, time: f64) -> DQuat {
        let key = (time * self.rate)
            .floor()
            .min(self.keys_per_track as f64 - 2.0);
        let part = time * self.rate - key;
        let first = track * self.keys_per_track + key as usize;
        let [from, to] = [first, first + 1].map(|key| self.keys[key].as_dquat().normalize());
        let step = from.conjugate() * if from.dot(to) < 0.0 { -to } else { to };
        let half = step.xyz().length().atan2(step.w);
        let vector = step.xyz().normalize_or(DVec3::X) * (half * part).sin();
        from * DQuat::from_xyzw(vector.x, vector.y, vector.z, (half * part).cos())
    }
}

/// An animation, and all that a job needs.
struct Sampler<'a> {
    animation: &'a Animation,
    context: SamplingContext,
    pose: Vec<SoaTransform>,
}

impl<'a> Sampler<'a> {
    fn new(animation: &'a Animation) -> Self {
        Self {
            animation,
            context: SamplingContext::new(animation.num_tracks()),
            pose: vec![SoaTransform::default(); animation.num_soa_tracks()],
        }
    }

    fn sample(&mut self, time: f64) {
        let mut job: SamplingJobRef<'_> = SamplingJob::default();
        job.set_animation(self.animation);
        job.set_context(&mut self.context);
        job.set_output(&mut self.pose);
        job.set_ratio((time / f64::from(self.animation.duration())) as f32);
        job.run().expect("a job that is complete");
    }

    fn rotation(&self, track: usize) -> DQuat {
        let SoaQuat { x, y, z, w } = self.pose[track / 4].rotation;
        let [x, y, z, w] = [x, y, z, w].map(|lanes| f64::from(lanes[track % 4]));
        DQuat::from_xyzw(x, y, z, w).normalize()
    }
}

/// The angle of the rotation between two, exact for small ones.
fn angle_between(a: DQuat, b: DQuat) -> f64 {
    let step = a.conjugate() * b;
    2.0 * step.xyz().length().atan2(step.w.abs())
}

fn main() {
    let keys = env::args().nth(1).expect("tumble-peers-ozz KEYS FOLDER");
    let motion = Motion::read(&fs::read(keys).expect("keys"));
    let bytes = archive::of_motion(&motion);
    let bytes_per_key = bytes.len() as f64 / motion.keys.len() as f64;
    let mut archive = Archive::from_slice(&bytes).expect("an archive");
    let animation = Animation::from_archive(&mut archive).expect("an animation");
    let works = ["one pose, slerp, next time", "one pose, slerp, any time"];
    let mut samplers = works.map(|_| Sampler::new(&animation));
    let mut times = works.map(|_| Vec::new());
    for round in 0..=ROUNDS {
        for ((sampler, of_calls), times) in samplers.iter_mut().zip(&motion.times).zip(&mut times) {
            for some in of_calls.chunks_exact(TIMED) {
                let started = Instant::now();
                for &time in some {
                    sampler.sample(time);
                    black_box(&mut sampler.pose);
                }
                if round > 0 {
                    times.push(started.elapsed());
                }
            }
        }
    }
    for (index, work) in works.into_iter().enumerate() {
        let mut error = 0.0f64;
        for &time in &motion.times[index][..CHECKED] {
            samplers[index].sample(time);
            for track in 0..motion.tracks {
                let found = samplers[index].rotation(track);
                error = error.max(angle_between(found, motion.reference(track, time)));
            }
        }
        times[index].sort();
        let median: Duration = times[index][times[index].len() / 2];
        let parts = motion.times[index].len() / TIMED;
        println!(
            "{{\"name\": \"ozz-animation-rs SamplingJob\", \"work\": {work:?}, \"threads\": \"1\", \
             \"bytes_per_key\": {bytes_per_key:.1}, \"error\": {error:.1e}, \"ms\": {}}}",
            1e3 * median.as_secs_f64() * parts as f64,
        );
    }
}
